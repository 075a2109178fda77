//! Frictions that can be hidden.

use std::f64::consts::PI;

use super::{Effect, Shape};
use crate::blind::laws::{Bristle, Patch, Weakening};
use crate::blind::world::World;

/// Puts a friction of a size into a world.
pub fn apply(shape: &Shape, effect: Effect, size: f64, world: &mut World) {
    let stall = world.rig.stall_torque();
    let level = size * stall;
    let bristle = shape.bristle();
    match effect {
        Effect::CoulombFriction => slip(shape, Bristle { coulomb_nm: 0.02 * level, ..bristle }, world),
        Effect::StribeckFriction => world.bristles.push(Bristle {
            coulomb_nm: 0.02 * level,
            static_ratio: shape.between(3, 1.6, 2.5),
            stribeck_speed: shape.between(4, 6.0, 25.0),
            weakening: shape.either(Weakening::Exponential(shape.between(5, 1.4, 2.0)), Weakening::Hyperbolic),
            ..bristle
        }),
        Effect::LoadFriction => {
            let loss_driving = 0.1 * size;
            world.bristles.push(Bristle {
                loss_driving,
                loss_driven: loss_driving * shape.either(shape.between(3, 1.08, 1.2), 1.0),
                loss_power: shape.either(1.0, shape.between(3, 0.8, 1.2)),
                loss_reference_nm: 0.5 * stall,
                ..bristle
            });
        }
        Effect::DirectionalFriction => {
            // Up to twice as much one way as the other, and no less than a fifth more.
            let lean = shape.between(3, 0.1, 0.35) * if shape.between(4, -1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
            slip(shape, Bristle { coulomb_nm: 0.02 * level, lean, ..bristle }, world);
        }
        Effect::FrictionPatch => {
            let (middle, half_width) = (shape.between(3, -PI, PI), shape.between(4, 0.3, 0.8));
            let window = Patch::Window { middle, half_width, edge: 0.05 };
            let patch = shape.either(window, Patch::Bell { middle, width: 0.6 * half_width });
            world.bristles.push(Bristle { coulomb_nm: 0.05 * level, patch: Some(patch), ..bristle });
        }
        Effect::GearMesh => {
            let teeth = shape.between(3, 5.0, 12.0).round();
            // Of two wheels, and twice a tooth; nothing that comes once a turn, as a patch does.
            let orders = [(teeth, 0.45, 1.0), (teeth + 2.0, 0.35, 4.0), (2.0 * teeth, 0.3, 2.0)];
            let phase = shape.between(4, 0.0, PI);
            let mesh = Patch::Mesh(orders.map(|(order, share, more)| (order, share, more * phase)));
            world.bristles.push(Bristle { coulomb_nm: 0.03 * level, patch: Some(mesh), ..bristle });
        }
        Effect::StickingTooth => {
            let tooth = Patch::Window {
                middle: shape.between(3, -PI, PI),
                half_width: shape.between(4, 0.06, 0.15),
                edge: 0.01,
            };
            world.bristles.push(Bristle {
                coulomb_nm: 0.03 * level,
                static_ratio: 4.0,
                stribeck_speed: shape.between(5, 4.0, 12.0),
                patch: Some(tooth),
                ..bristle
            });
        }
        _ => {
            let loss_driving = 0.1 * size;
            world.load_memory_s = shape.between(3, 0.15, 0.5);
            world.bristles.push(Bristle { loss_driving, loss_driven: loss_driving, remembers_load: true, ..bristle });
        }
    }
}

/// One bristle, or two of other lengths that share the level: a contact that begins to slip bit by bit.
fn slip(shape: &Shape, bristle: Bristle, world: &mut World) {
    let share = shape.either(1.0, shape.between(5, 0.4, 0.7));
    world.bristles.push(Bristle { coulomb_nm: share * bristle.coulomb_nm, ..bristle });
    if share < 1.0 {
        world.bristles.push(Bristle {
            coulomb_nm: (1.0 - share) * bristle.coulomb_nm,
            presliding: shape.between(6, 2.0, 4.0) * bristle.presliding,
            ..bristle
        });
    }
}
