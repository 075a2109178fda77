//! The plant that a robot file describes, at its nominal values: driver, supply, shaft and wiper. A simulation runs it, and a
//! diagnosis fits it.

use robot_file::robot::{Robot, Sensor};

use crate::driver::Driver;
use crate::shaft::Shaft;
use crate::supply::Supply;

/// From the commanded duty to where the wiper stands.
#[derive(Clone, Debug)]
pub struct Plant {
    /// PWM register and dead time.
    pub driver: Driver,
    /// What feeds the bridge.
    pub supply: Supply,
    /// Winding, gears and load, with every effect's law.
    pub shaft: Shaft,
    /// Half of the wiper's play, rad; 0 for a sensor without a wiper.
    pub half_play: f64,
}

impl Plant {
    /// From the file, its cell at a state of charge (0 … 1).
    #[must_use]
    pub fn new(robot: &Robot, charge: f64) -> Self {
        let half_play = match &robot.sensor {
            Sensor::Potentiometer(sensor) => 0.5 * sensor.hysteresis_deg.value.to_radians(),
            Sensor::Ideal | Sensor::Encoder(_) => 0.0,
        };
        Self { driver: Driver::new(robot), supply: Supply::new(robot, charge), shaft: shaft(robot), half_play }
    }
}

/// The shaft with the effects that the file lists.
#[must_use]
pub fn shaft(robot: &Robot) -> Shaft {
    let motor = &robot.motor;
    Shaft {
        resistance_ohm: motor.resistance_ohm.value,
        inductance_h: motor.inductance_h.value,
        torque_constant: motor.torque_constant_nm_per_a.value,
        inertia_kg_m2: motor.rotor_inertia_kg_m2.value + robot.load.inertia_kg_m2.value,
        viscous: motor.viscous_nm_s_per_rad.value,
        laws: robot.effects.laws(),
    }
}

/// Where a wiper with play stands after its shaft has moved to an angle (rad), from where it stood (rad).
#[inline]
#[must_use]
pub fn dragged(wiper: f64, half_play: f64, shaft_angle: f64) -> f64 {
    wiper.max(shaft_angle - half_play).min(shaft_angle + half_play)
}
