//! The drive of a servo that was told where to go: its position control, a gain and a limit.
//!
//! `duty = clamp(kp · (goal − angle) / full scale, −most … most)`, the angles in rad. It is the law that BAM identified on
//! Dynamixel and Feetech servos, there `clip(error_gain · kp · (goal − angle), ±max_pwm)`, so that the full scale is
//! 1/`error_gain`: M. Duclusaud, G. Passault, V. Padois, O. Ly, "Extended Friction Models for the Physics Simulation of Servo
//! Actuators", 2025.

/// What a servo's position control does with its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PositionControl {
    /// The gain as it is set in the servo.
    pub gain: Option<f64>,
    /// Gain times error, rad, at which the duty is 1; 1 where nothing is said.
    pub full_scale_rad: Option<f64>,
    /// The largest duty; 1 where nothing is said.
    pub most_duty: Option<f64>,
}

impl PositionControl {
    /// The duty for an error; `None` without a gain.
    pub(super) fn duty(&self, goal_rad: f64, angle_rad: f64) -> Option<f64> {
        let most = self.most_duty.unwrap_or(1.0);
        let duty = self.gain? * (goal_rad - angle_rad) / self.full_scale_rad.unwrap_or(1.0);
        Some(duty.clamp(-most, most))
    }

    pub(super) fn overridden_by(self, other: &Self) -> Self {
        Self {
            gain: other.gain.or(self.gain),
            full_scale_rad: other.full_scale_rad.or(self.full_scale_rad),
            most_duty: other.most_duty.or(self.most_duty),
        }
    }

    pub(super) fn words(&self) -> String {
        let gain = self.gain.map_or_else(|| "none".into(), |gain| gain.to_string());
        let (scale, most) = (self.full_scale_rad.unwrap_or(1.0), self.most_duty.unwrap_or(1.0));
        format!("P gain {gain}, full scale {scale} rad, duty up to {most}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_duty_grows_with_the_error_up_to_its_limit() {
        let control = PositionControl { gain: Some(32.0), full_scale_rad: Some(1.0 / 0.158), most_duty: Some(0.9625) };
        assert!((control.duty(0.3, 0.2).unwrap() - 32.0 * 0.158 * 0.1).abs() < 1e-12);
        assert_eq!(control.duty(-1.0, 1.0), Some(-0.9625));
        assert_eq!(PositionControl::default().duty(1.0, 0.0), None);
    }
}
