//! Position control, thesis (4.7) and (4.8): `e = θ_target − θ`, `u = Kp e + Ki ∫e + Kd de/dt`, P alone by default, on
//! a moving average of the angle.

use crate::angle::wrap;
use crate::estimator::Estimate;
use crate::parameters::{Parameters, WINDOW};
use crate::scalar::{clamp, sign};

/// Moving average of wrapped angles, newest first.
#[derive(Clone, Copy, Debug)]
pub struct MovingAverage {
    angles: [f32; WINDOW],
    filled: u16,
}

impl Default for MovingAverage {
    fn default() -> Self {
        Self { angles: [0.0; WINDOW], filled: 0 }
    }
}

impl MovingAverage {
    /// Takes in an angle (rad) and gives the mean of the last `length`, rad, −π … π.
    pub fn push(&mut self, angle: f32, length: u16) -> f32 {
        let mut carried = angle;
        for slot in &mut self.angles {
            core::mem::swap(slot, &mut carried);
        }
        self.filled = self.filled.saturating_add(1).min(length.max(1));
        let mut sum = 0.0;
        for old in self.angles.iter().take(usize::from(self.filled)) {
            sum += wrap(old - angle);
        }
        wrap(angle + sum / f32::from(self.filled))
    }
}

/// PID position controller with a moving average on the angle.
#[derive(Clone, Copy, Debug)]
pub struct PositionControl {
    target: f32,
    integral: f32,
    last_error: Option<f32>,
    average: MovingAverage,
}

impl PositionControl {
    /// Creates a controller that moves to `target`, rad.
    #[must_use]
    pub fn new(target: f32) -> Self {
        Self { target: wrap(target), integral: 0.0, last_error: None, average: MovingAverage::default() }
    }

    /// The target, rad.
    #[must_use]
    pub fn target(&self) -> f32 {
        self.target
    }

    /// Replaces the target, rad, and keeps the integrator.
    pub fn retarget(&mut self, target: f32) {
        self.target = wrap(target);
        self.last_error = None;
    }

    /// The PID law on an angle (rad) that is `elapsed` (s) younger than the last: V. `saturated` is the side (±1) on
    /// which the last demand was beyond the supply.
    pub fn voltage(&mut self, p: &Parameters, angle: f32, saturated: f32, elapsed: f32) -> f32 {
        let c = &p.position;
        let averaged = self.average.push(angle, c.average);
        let error = wrap(self.target - averaged);
        // A sample without a period behind it has no slope.
        let slope = match self.last_error {
            Some(last) if elapsed > 0.5 * p.tick => wrap(error - last) / elapsed,
            _ => 0.0,
        };
        self.last_error = Some(error);
        // Integrating on would only wind up while the supply gives no more on that side.
        if saturated * error <= 0.0 && error.abs() > c.tolerance {
            let most = p.bridge.rail / (c.integral + 1e-9);
            self.integral = clamp(self.integral + error * elapsed, -most, most);
        }
        if error.abs() <= c.tolerance {
            return 0.0;
        }
        c.proportional * error + c.integral * self.integral + c.derivative * slope
    }

    /// Voltage that carries the estimated drag toward the target, V; 0 within the tolerance.
    #[must_use]
    pub fn drag_voltage(&self, p: &Parameters, x: &Estimate) -> f32 {
        let error = wrap(self.target - x.angle);
        if error.abs() <= p.position.tolerance || x.drag <= 0.0 {
            return 0.0;
        }
        // Beyond breakaway only while the shaft is slow: once it slides, friction is a welcome brake.
        let slow = clamp(1.0 - x.speed.abs() * 0.05, 0.0, 1.0);
        sign(error) * slow * p.position.drag_share * x.drag * p.motor.resistance / p.motor.torque_constant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_average_goes_over_the_seam() {
        let mut average = MovingAverage::default();
        for angle in [3.1, -3.1, 3.1, -3.1] {
            average.push(angle, 4);
        }
        let mean = average.push(3.1, 4);
        assert!(mean.abs() > 3.0, "{mean}");
    }

    #[test]
    fn the_average_has_its_length() {
        let mut average = MovingAverage::default();
        for _ in 0..20 {
            average.push(1.0, 4);
        }
        assert!((average.push(0.0, 4) - 0.75).abs() < 1e-6);
        assert!((average.push(0.0, 1)).abs() < 1e-6);
    }
}
