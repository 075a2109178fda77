//! Specimens that differ from their robot file, as motors from one bag do.

use robot_file::robot::{Quantity, Robot};

use crate::random::{Source, Stream};

/// Relative half-widths of a specimen's spread around the file's values, each drawn uniformly, 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spreads {
    /// Of the winding's resistance.
    pub resistance: f64,
    /// Of the torque constant.
    pub torque_constant: f64,
    /// Of the inertia, rotor and load by the same factor.
    pub inertia: f64,
    /// Of the drag: viscous damping and every friction torque by the same factor.
    pub drag: f64,
}

impl Spreads {
    /// Every specimen is the file.
    pub const NONE: Self = Self { resistance: 0.0, torque_constant: 0.0, inertia: 0.0, drag: 0.0 };
    /// R, K ±15 %, J ±30 %, drag ±20 %.
    pub const MISMATCHED: Self = Self { resistance: 0.15, torque_constant: 0.15, inertia: 0.3, drag: 0.2 };
}

/// A specimen: a copy of the file whose values are scaled by factors drawn from the seed. Ranges and sources stay the
/// file's; the controller's numbers are not touched.
#[must_use]
pub fn draw(robot: &Robot, seed: u64, spreads: &Spreads) -> Robot {
    let mut stream = Stream::new(seed, Source::Variation);
    let mut factor = |spread: f64| stream.uniform(1.0 - spread, 1.0 + spread);
    let (resistance, torque_constant) = (factor(spreads.resistance), factor(spreads.torque_constant));
    let (inertia, drag) = (factor(spreads.inertia), factor(spreads.drag));
    let mut specimen = robot.clone();
    let scale = |quantity: &mut Quantity, factor: f64| quantity.value *= factor;
    scale(&mut specimen.motor.resistance_ohm, resistance);
    scale(&mut specimen.motor.torque_constant_nm_per_a, torque_constant);
    scale(&mut specimen.motor.rotor_inertia_kg_m2, inertia);
    scale(&mut specimen.load.inertia_kg_m2, inertia);
    if let Some(eccentric) = &mut specimen.eccentric {
        scale(&mut eccentric.mass_kg, inertia);
    }
    scale(&mut specimen.motor.viscous_nm_s_per_rad, drag);
    for (_, parameter, quantity) in specimen.effects.quantities_mut() {
        if parameter.drag {
            scale(quantity, drag);
        }
    }
    specimen
}
