//! What bridge, supply and winding can hide.

use super::{Effect, Shape};
use crate::blind::laws::{Battery, Bridge, CommandDrop, Deadband, Discharge, Heating, Loss};
use crate::blind::world::{Latency, World};

/// Puts a loss of a size into a world.
pub fn apply(shape: &Shape, effect: Effect, size: f64, world: &mut World) {
    let rig = world.rig;
    let stall_a = rig.rail_v / rig.resistance_ohm;
    match effect {
        Effect::DriverDrop => drop(shape, size, world),
        Effect::DriverDropByCommand => {
            world.command_drop = Some(CommandDrop {
                volts: size * shape.either(1.0, 0.8),
                growth: shape.either(0.0, shape.between(3, 0.1, 0.3)),
            });
            if let super::Law::First = shape.law {
                // A little of it is a transistor's resistance.
                let ohm = 0.03 * size / stall_a;
                world.losses.push(Loss::Saturating { volts: 0.0, knee_a: 1e-3, ohm });
            }
        }
        Effect::DriverDeadband => {
            let width = 0.02 * size;
            world.deadband = Some(Deadband {
                width,
                corner: shape.either(shape.between(3, 0.1, 0.25) * width, 0.0),
                stretched: shape.either(false, true),
            });
        }
        Effect::DriverDeadTime => world.losses.push(Loss::DeadTime {
            rail_v: rig.rail_v,
            lost: 0.02 * size,
            knee_a: shape.either(shape.between(3, 5e-4, 2e-3), shape.between(3, 3e-3, 6e-3)),
            until_duty: shape.either(1.0, 0.98),
        }),
        Effect::BatterySag => sag(shape, size, world),
        Effect::BatteryDischarge => {
            world.discharge = Some(Discharge {
                fall_v_per_as: size,
                levels_off_as: shape.either(f64::INFINITY, shape.between(3, 8.0, 16.0) * stall_a),
            });
        }
        Effect::WindingHeating => {
            let housing = shape.either(0.0, shape.between(4, 0.2, 0.4));
            world.heating = Some(Heating {
                kelvin_per_watt: (1.0 - housing) * 60.0 * size,
                time_s: shape.between(3, 1.5, 5.0),
                housing_kelvin_per_watt: housing * 60.0 * size,
                housing_s: 40.0,
            });
        }
        Effect::CommandLatency => {
            world.latency =
                Some(Latency { time_s: 1e-3 * size, jitter: shape.either(0.0, shape.between(3, 0.05, 0.15)) });
        }
        // From four times the stall current, which nothing draws, down to a fifth of it.
        _ => world
            .losses
            .push(Loss::Clip { ampere: stall_a * (0.8 / size).clamp(0.2, 4.0), ohm: 10.0 * rig.resistance_ohm }),
    }
}

fn drop(shape: &Shape, size: f64, world: &mut World) {
    // The curve scales as a whole: a small drop that is as soft as a large one would be no drop.
    let (knee_a, ohm) = (size * shape.between(3, 2e-3, 5e-3), size * shape.between(4, 0.3, 0.9));
    match shape.law {
        super::Law::First => {
            world.bridge = Some(Bridge {
                transistors_v: size,
                knee_a,
                transistor_ohm: ohm,
                diode_v: size * shape.between(5, 0.85, 1.1),
                diode_log_v: size * shape.between(6, 0.01, 0.03),
                diode_ohm: size * shape.between(4, 0.25, 0.8),
            });
        }
        super::Law::Second => world.losses.push(Loss::Saturating { volts: size, knee_a: 0.6 * knee_a, ohm }),
    }
}

fn sag(shape: &Shape, size: f64, world: &mut World) {
    let (series_ohm, slow_ohm) = (size * shape.between(3, 0.45, 0.6), size * shape.between(5, 0.3, 0.5));
    let (fast_ohm, fast_s) = (size * shape.between(4, 0.10, 0.2), shape.between(6, 0.03, 0.12));
    let slow_s = shape.between(7, 0.8, 3.0);
    let stall_a = world.rig.rail_v / world.rig.resistance_ohm;
    match shape.law {
        super::Law::First => {
            world.battery = Some(Battery { series_ohm, pair_ohm: [fast_ohm, slow_ohm], pair_s: [fast_s, slow_s] });
        }
        super::Law::Second => {
            world.battery =
                Some(Battery { series_ohm: 0.5 * series_ohm, pair_ohm: [0.0, slow_ohm], pair_s: [1.0, slow_s] });
            let ampere = 0.7 * stall_a;
            world.losses.push(Loss::Polarisation { volts: 0.5 * series_ohm * ampere, ampere });
        }
    }
}
