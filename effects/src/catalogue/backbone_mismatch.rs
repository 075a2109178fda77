//! `backbone_mismatch`: the backbones are not equally stiff and damped.
//!
//! `K_b = share·K` about all three axes, and the same of the damping: a mixture or a section that differs from cast to cast
//! changes them together.

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Backbones that have numbers of their own: the thesis's robot has three.
const BACKBONES: usize = 3;

/// Stiffness and damping backbone by backbone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackboneMismatch {
    /// From the front: stiffness as a share of the file's, 1.
    pub stiffness_shares: [f64; BACKBONES],
    /// From the front: damping as a share of the file's, 1.
    pub damping_shares: [f64; BACKBONES],
}

/// A key of the table.
const fn share_of(key: &'static str, meaning: &'static str, low: f64) -> Parameter {
    Parameter::new(key, meaning, low, 100.0)
}

impl Effect for BackboneMismatch {
    type State = ();

    const SPEC: Spec = Spec {
        name: "backbone_mismatch",
        summary: "The backbones are not equally stiff and damped; those behind the third are as the file says.",
        title: "unequal backbones",
        clause: "backbones that are not equally stiff and damped",
        law: "K_b = stiffness_share·K, D_b = damping_share·D about all three axes, K and D being those of `[backbone]`",
        source: "linear elasticity: stiffness and damping go with the modulus and the section",
        parameters: &[
            share_of("stiffness_1_share", "Stiffness of backbone 1, share of the file's.", 0.01).believed(1.0, 0.8, 1.25),
            share_of("stiffness_2_share", "Of backbone 2; 1 where there is none.", 0.01).believed(1.0, 0.8, 1.25),
            share_of("stiffness_3_share", "Of backbone 3; 1 where there is none.", 0.01).believed(1.0, 0.8, 1.25),
            share_of("damping_1_share", "Damping of backbone 1, share of the file's.", 0.0).believed(1.0, 0.7, 1.43),
            share_of("damping_2_share", "Of backbone 2; 1 where there is none.", 0.0).believed(1.0, 0.7, 1.43),
            share_of("damping_3_share", "Of backbone 3; 1 where there is none.", 0.0).believed(1.0, 0.7, 1.43),
        ],
        acts: Acts::Ground,
        shows_in: Coordinate::Ground,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self {
            stiffness_shares: [values[0], values[1], values[2]],
            damping_shares: [values[3], values[4], values[5]],
        }
    }

    fn backbone_shares(&self, backbone: usize) -> [f64; 2] {
        let of = |shares: &[f64; BACKBONES]| shares.get(backbone).copied().unwrap_or(1.0);
        [of(&self.stiffness_shares), of(&self.damping_shares)]
    }
}
