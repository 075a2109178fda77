//! A shaft that follows its frequency exactly, from one to the next as fast as its motor can.

use hal_sim::body::Drive;
use robot_file::Robot;

/// A shaft whose speed goes to each new frequency in a ramp, whatever torque that takes: from +7 to −7 Hz in no time at all the body would
/// get a blow that no motor can give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RampedShaft {
    angle: f64,
    speed: f64,
    acceleration: f64,
}

impl RampedShaft {
    /// At rest at an angle (rad). Its acceleration is what the robot's motor gives at standstill with the whole supply on its winding:
    /// `K U / (R J)`, J of rotor and load.
    #[must_use]
    pub fn new(robot: &Robot, angle: f64) -> Self {
        let motor = &robot.motor;
        let torque = motor.torque_constant_nm_per_a.value * robot.supply.rail_v.value / motor.resistance_ohm.value;
        let inertia = motor.rotor_inertia_kg_m2.value + robot.load.inertia_kg_m2.value;
        Self { angle, speed: 0.0, acceleration: torque / inertia }
    }

    /// Angle, rad, counter-clockwise, not wrapped.
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// How fast its speed changes, rad/s².
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        self.acceleration
    }

    /// Turns on for a step (s) towards a speed (rad/s); what it did in the step's middle.
    pub fn advance(&mut self, target: f64, step_s: f64) -> Drive {
        let most = self.acceleration * step_s;
        let acceleration = (target - self.speed).clamp(-most, most) / step_s;
        let drive = Drive::Motor {
            angle: self.angle + 0.5 * step_s * (self.speed + 0.25 * step_s * acceleration),
            speed: self.speed + 0.5 * step_s * acceleration,
            acceleration,
            rotor_inertia: 0.0,
        };
        self.angle += step_s * (self.speed + 0.5 * step_s * acceleration);
        self.speed += step_s * acceleration;
        drive
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reaches_its_speed_in_a_ramp_and_keeps_it() {
        let mut shaft = RampedShaft { angle: 0.2, speed: 0.0, acceleration: 1000.0 };
        for _ in 0..500 {
            shaft.advance(40.0, 1e-4);
        }
        // 40 ms of ramp make 0.8 rad, 10 ms at 40 rad/s 0.4 rad.
        assert!((shaft.angle() - 1.4).abs() < 1e-9 && (shaft.speed - 40.0).abs() < 1e-9, "{shaft:?}");
        let Drive::Motor { angle, speed, acceleration, .. } = shaft.advance(-40.0, 1e-4) else { panic!("no motor") };
        assert!((angle - (1.4 + 40.0 * 5e-5 - 0.5 * 1000.0 * 25e-10)).abs() < 1e-9);
        assert!((speed - (40.0 - 0.05)).abs() < 1e-9 && (acceleration + 1000.0).abs() < 1e-6);
    }
}
