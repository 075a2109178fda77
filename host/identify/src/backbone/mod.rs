//! Stiffness and damping of a backbone from its free oscillations: thesis section 3.1, with (3.1) as what is minimised.
//!
//! A backbone is held fast at one end, the module at its other end is pulled aside and let go, and a motion capture system
//! records how it turns: angles about x (torsion), y (stiff) and z (soft), one axis after the other or all at once. What is
//! fitted is the simulated body itself ([`hal_sim::body`]): six numbers of its hinges for all runs together, and for each run
//! where the backbone stood and how it moved at the first sample, so that neither the angle nor the time of the release need be
//! known, and where the cameras' zero is.
//!
//! In order:
//!
//! 1. `release`: the samples from the release on;
//! 2. `start`: as long as angles are small the axes do not mix and all is linear in the start, so that every pair of
//!    stiffness and damping of a grid is judged by a linear fit: no guess is needed, and no local minimum is taken for the best one;
//! 3. `fit`: Levenberg and Marquardt on everything at once, each axis weighted by what it leaves; intervals from the
//!    curvature, widened where what is left is correlated.
//!
//! An oscillation tells a stiffness against the moment of inertia that it swings: `k` is as exact as the mass and the size of the
//! module at the end ([`BackboneFit::inertia_kg_m2`] is what was taken).

#[cfg(feature = "bayes")]
mod bayes;
mod error;
mod fit;
mod oscillation;
mod rig;
mod section;
mod start;

pub use error::BackboneError;
pub use fit::{BackboneFit, HeldOut, HingeFit, Interval, Method, Options, Search, Track, identify, identify_until};
pub use oscillation::Oscillation;
pub use rig::{Gravity, rotation_vector};
pub use section::{Section, SectionError};

/// The fields of `[backbone]` that hold the six numbers, in their order.
pub const FIELDS: [&str; 6] = [
    "torsion_nm_per_rad",
    "stiff_nm_per_rad",
    "soft_nm_per_rad",
    "torsion_nm_s_per_rad",
    "stiff_nm_s_per_rad",
    "soft_nm_s_per_rad",
];

#[cfg(test)]
mod tests;
