//! What else can turn or hold the shaft.

use std::f64::consts::{PI, TAU};

use super::{Effect, Shape};
use crate::blind::laws::{Bias, Drag, Gravity, Grease, Ripple, TwoInertias};
use crate::blind::world::World;

/// Puts a torque of a size onto a world's shaft.
pub fn apply(shape: &Shape, effect: Effect, size: f64, world: &mut World) {
    let stall = world.rig.stall_torque();
    match effect {
        Effect::GravityTilt => {
            world.gravity = Some(Gravity {
                torque_nm: 0.03 * size * stall,
                direction: shape.between(3, -PI, PI),
                second_share: shape.either(shape.between(4, 0.02, 0.05), 0.0),
                second_direction: shape.between(5, -PI, PI),
                swings_out: shape.either(0.0, shape.between(4, 0.03, 0.08)),
            });
        }
        Effect::BiasTorque => {
            let sign = if shape.between(3, -1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
            world.bias = Some(Bias {
                torque_nm: sign * 0.02 * size * stall,
                once_share: shape.either(shape.between(4, 0.03, 0.06), 0.0),
                fades_per_s: shape.either(0.0, shape.between(4, 0.005, 0.015)),
            });
        }
        Effect::TorqueRipple => {
            world.ripple = Some(Ripple {
                torque_nm: 0.05 * size * stall,
                per_turn: shape.between(3, 5.0, 15.0).round(),
                phase: shape.between(4, -PI, PI),
                second_share: shape.either(0.0, shape.between(5, 0.06, 0.12)),
            });
        }
        Effect::Backlash => two(shape, 0.03 * size, 3000.0, world),
        Effect::ShaftCompliance => two(shape, 0.0, TAU * 15.0 / size.sqrt(), world),
        Effect::QuadraticDrag => drag(0.05 * size * stall, shape.either(2.0, shape.between(3, 1.8, 2.2)), world),
        Effect::CubicDrag => drag(0.05 * size * stall, shape.either(3.0, shape.between(3, 2.8, 3.4)), world),
        _ => {
            let watt = world.rig.viscous * (0.5 * world.rig.free_speed()).powi(2);
            world.grease = Some(Grease {
                thinning_per_w: size / watt,
                time_s: shape.between(3, 1.5, 5.0),
                stays: shape.either(0.0, shape.between(4, 0.1, 0.3)),
            });
        }
    }
}

fn drag(torque_nm: f64, power: f64, world: &mut World) {
    world.drags.push(Drag { torque_nm, reference: world.rig.free_speed(), power });
}

/// Two inertias with a natural frequency, rad/s.
fn two(shape: &Shape, half_gap: f64, natural: f64, world: &mut World) {
    let load_share = shape.between(3, 0.25, 0.5);
    let reduced = world.rig.inertia_kg_m2 * load_share * (1.0 - load_share);
    let stiffness = reduced * natural * natural;
    world.two = Some(TwoInertias {
        load_share,
        stiffness,
        damping: 2.0 * shape.between(4, 0.05, 0.2) * reduced * natural,
        half_gap,
        load_drag_share: shape.between(5, 0.2, 0.6),
        // The twist that a third of the stall torque gives.
        doubles_at: shape.either(f64::INFINITY, world.rig.stall_torque() / (3.0 * stiffness)),
        soft_contact: shape.either(0.0, 0.05 * half_gap),
    });
}
