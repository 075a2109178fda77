//! What the tests share: the 26:1 motor's shaft, and small ways to run things.

pub mod body;

use std::path::Path;

use control::Actuation;
use effects::{CoulombFriction, DriverDrop, GravityTilt, Laws, LoadFriction, StribeckFriction};
use hal_sim::shaft::{Shaft, ShaftState, Stepper, Terminals};
use robot_file::robot::{Potentiometer, Robot, Sensor};

/// The thesis's linear motor with the 26:1 gearmotor's numbers: no friction, no gravity, an ideal bridge.
pub const LINEAR: Shaft = Shaft {
    resistance_ohm: 15.0,
    inductance_h: 150e-6,
    torque_constant: 0.0209,
    inertia_kg_m2: 1.4e-6,
    viscous: 1.12e-6,
    laws: Laws::NONE,
};

/// The same motor with everything: Stribeck and load friction, a tilted axis, an L293DD.
pub const FULL: Shaft = Shaft {
    laws: Laws {
        stribeck_friction: Some(StribeckFriction {
            torque_nm: 2.2e-3,
            breakaway_excess_nm: 0.4e-3,
            speed_rad_per_s: 5.0,
            presliding_rad: 3e-3,
        }),
        load_friction: Some(LoadFriction { coefficient: 0.05, presliding_rad: 3e-3 }),
        gravity_tilt: Some(GravityTilt { torque_nm: 0.29e-3, direction_rad: 0.7 }),
        driver_drop: Some(DriverDrop { drop_v: 2.07, knee_a: 0.0, slope_ohm: 0.89 }),
        ..Laws::NONE
    },
    ..LINEAR
};

/// Coulomb friction alone.
pub const fn coulomb(torque_nm: f64, presliding_rad: f64) -> Laws {
    Laws { coulomb_friction: Some(CoulombFriction { torque_nm, presliding_rad }), ..Laws::NONE }
}

pub const STEP: f64 = 1e-4;

pub fn driven(voltage: f64) -> Terminals {
    Terminals::Driven { voltage }
}

/// Runs for a time (s) at constant terminals.
pub fn run(stepper: &Stepper, state: &mut ShaftState, terminals: Terminals, time: f64) {
    for _ in 0..(time / stepper.step()).round() as usize {
        stepper.advance(state, terminals);
    }
}

/// Relative difference.
pub fn apart(a: f64, b: f64) -> f64 {
    (a - b).abs() / b.abs()
}

/// The project's default robot.
pub fn default_robot() -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    Robot::load(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// The default robot's potentiometer.
pub fn potentiometer(robot: &mut Robot) -> &mut Potentiometer {
    match &mut robot.sensor {
        Sensor::Potentiometer(potentiometer) => potentiometer,
        other => panic!("the default robot's sensor is {other:?}"),
    }
}

/// The default robot with a quiet converter: no noise, spikes, nonlinearity or jitter, no hysteresis, no linearity error.
pub fn quiet_robot() -> Robot {
    let mut robot = default_robot();
    let sensor = potentiometer(&mut robot);
    sensor.hysteresis_deg.value = 0.0;
    let adc = &mut sensor.adc;
    for quantity in [&mut adc.noise_lsb, &mut adc.spike_share, &mut adc.inl_lsb, &mut adc.jitter_s] {
        (quantity.value, quantity.low, quantity.high) = (0.0, 0.0, 0.0);
    }
    robot.effects.remove("sensor_nonlinearity");
    robot
}

pub fn drive(duty: f32) -> Actuation {
    Actuation { duty, enable: true }
}
