//! Data sets of a rig whose robot file already lists effects, with one more hidden.
//!
//! The listed effects have numbers 10–30 % off like the motor's and plain laws: they are tens of times the noise, so a
//! richer law of a listed effect would be a second hidden one. Only the hidden effect is rich. The sensor is a
//! potentiometer with its blind arc left empty. Duties start where friction and drop let the shaft move.

use super::hidden::{Effect, Shape};
use super::laws::{Battery, Bridge, Bristle};
use super::rig::{RigError, number};
use super::sensing::Sensor;
use super::world::{Drive, World};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// What can be hidden beside the effects of the default robot: those of the eight that its file does not list.
pub const EFFECTS: [Effect; 3] = [Effect::LoadFriction, Effect::GravityTilt, Effect::SensorDelay];

/// Sizes to draw from, in the units of [`Shape::apply`]: clearly visible beside what is there already.
#[must_use]
pub fn sizes(effect: Effect) -> (f64, f64) {
    match effect {
        Effect::LoadFriction => (1.5, 3.0),
        Effect::GravityTilt => (1.0, 3.0),
        _ => (2.0, 4.5),
    }
}

/// Puts the listed effects into a world and its sensor.
///
/// # Errors
/// The robot file lists an effect without one of its numbers.
pub fn furnish(
    robot_file: &str,
    world: &mut World,
    sensor: &mut Sensor,
    shape: &Shape,
    rng: &mut Pcg64,
) -> Result<(), RigError> {
    let root: toml::Table = robot_file.parse()?;
    let listed = |name: &str| root.get("effects").is_some_and(|effects| effects.get(name).is_some());
    let mut off = |path: &str| -> Result<f64, RigError> {
        let share = rng.random_range(0.10..0.30);
        Ok(number(&root, path)? * if rng.random_bool(0.5) { 1.0 + share } else { 1.0 - share })
    };
    if listed("coulomb_friction") {
        let coulomb_nm = off("effects.coulomb_friction.torque_nm")?;
        world.bristles = vec![Bristle { coulomb_nm, elastic_share: 0.0, micro_damping: 0.0, ..shape.bristle() }];
    }
    if listed("driver_drop") {
        let volts = off("effects.driver_drop.drop_v")?;
        let ohm = off("effects.driver_drop.slope_ohm")?;
        world.bridge = Some(Bridge {
            transistors_v: volts,
            knee_a: 1e-3,
            transistor_ohm: ohm,
            diode_v: volts,
            diode_log_v: 0.0,
            diode_ohm: ohm,
        });
    }
    if listed("battery_sag") {
        let relaxation = off("effects.battery_sag.relaxation_ohm")?;
        let time = off("effects.battery_sag.relaxation_s")?;
        world.battery = Some(Battery {
            series_ohm: off("effects.battery_sag.resistance_ohm")?,
            pair_ohm: [0.0, relaxation],
            pair_s: [1.0, time],
        });
    }
    if listed("sensor_nonlinearity") {
        // Up to 3°, in two harmonics.
        let size = rng.random_range(0.02..0.05);
        let phase: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..TAU));
        sensor.harmonics = vec![(0.7 * size, phase[0]), (0.3 * size, phase[1])];
    }
    sensor.bits = 12;
    sensor.noise = rng.random_range(2e-3..4e-3);
    sensor.blind_half_width = rng.random_range(28.0f64..33.0).to_radians();
    Ok(())
}

/// Lifts duties over what friction and drop swallow.
pub fn lift(drives: &mut [Drive], world: &World) {
    let friction = world.bristles.first().map_or(0.0, |bristle| bristle.coulomb_nm / world.rig.stall_torque());
    let drop = world.bridge.map_or(0.0, |bridge| bridge.transistors_v / world.rig.rail_v);
    let swallowed = (friction + drop).min(0.8);
    for drive in drives.iter_mut().filter(|drive| drive.duty.abs() > 0.02) {
        let lifted = swallowed + (1.0 - swallowed) * drive.duty.abs();
        drive.duty = (lifted * 1e5).round() / 1e5 * drive.duty.signum();
    }
}
