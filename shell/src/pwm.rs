//! What the three wires of an H-bridge carry for an actuation.

use control::Actuation;

/// The wires of the bridge during a PWM period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wires {
    /// The bridge drives; low opens every switch.
    pub enable: bool,
    /// Steps of the period that the first input is high.
    pub in1: u16,
    /// The same of the second.
    pub in2: u16,
}

/// Slow decay, with `steps` in a period: PWM on the first input and the second low turns the shaft counter-clockwise; the
/// other way round clockwise. While both are low the motor is short-circuited through the lower switches, so that its current
/// goes on flowing. NaN opens the bridge.
#[must_use]
pub fn slow_decay(actuation: Actuation, steps: u16) -> Wires {
    let Actuation { duty, enable } = actuation;
    if !enable || duty.is_nan() {
        return Wires { enable: false, in1: 0, in2: 0 };
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to steps")]
    let high = (duty.abs().min(1.0) * f32::from(steps) + 0.5) as u16;
    let (in1, in2) = if duty > 0.0 { (high, 0) } else { (0, high) };
    Wires { enable: true, in1, in2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: u16 = 2048;

    fn driven(duty: f32) -> (u16, u16) {
        let wires = slow_decay(Actuation { duty, enable: true }, STEPS);
        assert!(wires.enable);
        (wires.in1, wires.in2)
    }

    #[test]
    fn the_sign_chooses_the_input_and_the_other_is_low() {
        assert_eq!(driven(0.5), (1024, 0));
        assert_eq!(driven(-0.25), (0, 512));
        assert_eq!(driven(0.0), (0, 0));
        assert_eq!(driven(-0.0), (0, 0));
    }

    #[test]
    fn a_whole_period_is_the_most() {
        for duty in [1.0, 1.5, f32::INFINITY] {
            assert_eq!(driven(duty), (STEPS, 0));
            assert_eq!(driven(-duty), (0, STEPS));
        }
    }

    #[test]
    fn steps_are_rounded_to_the_nearest() {
        assert_eq!(driven(0.4 / 2048.0), (0, 0));
        assert_eq!(driven(0.6 / 2048.0), (1, 0));
        assert_eq!(driven(-2047.6 / 2048.0), (0, 2048));
    }

    #[test]
    fn off_and_no_number_open_the_bridge() {
        let open = Wires { enable: false, in1: 0, in2: 0 };
        assert_eq!(slow_decay(Actuation::OFF, STEPS), open);
        assert_eq!(slow_decay(Actuation { duty: 1.0, enable: false }, STEPS), open);
        assert_eq!(slow_decay(Actuation { duty: f32::NAN, enable: true }, STEPS), open);
    }
}
