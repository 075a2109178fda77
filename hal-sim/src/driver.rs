//! From the commanded duty to the duty at the switches: PWM register and dead time. What else is lost on the way are
//! effects ([`effects::Laws::duty`], [`effects::Laws::bridge`]).

use control::Actuation;
use robot_file::robot::Robot;

/// The PWM unit and the bridge's timing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Driver {
    /// Steps from duty 0 to 1; 0: continuous.
    pub pwm_steps: f64,
    /// Duty lost in every period that switches: dead time × PWM frequency, 1.
    pub dead_duty: f64,
}

impl Driver {
    /// A driver that follows exactly.
    pub const IDEAL: Self = Self { pwm_steps: 0.0, dead_duty: 0.0 };

    /// From the robot file.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let driver = &robot.driver;
        Self {
            pwm_steps: driver.pwm_steps.value.round().max(0.0),
            dead_duty: driver.dead_time_s.value * driver.pwm_frequency_hz.value,
        }
    }

    /// The duty at the switches, −1 … 1; `None`: every switch is off.
    ///
    /// A NaN is what a float-to-integer conversion makes of it: a zero in the compare register (the bridge brakes).
    #[must_use]
    pub fn effective(&self, actuation: Actuation) -> Option<f64> {
        if !actuation.enable {
            return None;
        }
        Some(self.switched(if actuation.duty.is_nan() { 0.0 } else { f64::from(actuation.duty) }))
    }

    /// The duty at the switches, −1 … 1, of one that is commanded. Beyond ±1 the register saturates. A full duty does not
    /// switch and loses no dead time.
    #[must_use]
    pub fn switched(&self, duty: f64) -> f64 {
        let mut share = duty.abs().min(1.0);
        if self.pwm_steps > 0.0 {
            share = (share * self.pwm_steps).round() / self.pwm_steps;
        }
        if share < 1.0 {
            share = (share - self.dead_duty).max(0.0);
        }
        share.copysign(duty)
    }
}
