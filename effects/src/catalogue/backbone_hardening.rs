//! `backbone_hardening`: a backbone grows stiffer the more it is bent.
//!
//! `τ = −K q (1 + share·(n q)²)` of each of its n triples of hinges, q being the hinge's angle: `n q` is the turn of the whole
//! backbone where its hinges share it evenly, so that the number of segments does not matter. The first term by which an
//! elastic moment that is odd in the bend differs from a line.

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Stiffness that grows with the square of the bend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackboneHardening {
    /// Torsion, stiff and soft bending: how much stiffer at a turn of 1 rad over the whole backbone, share.
    pub shares: [f64; 3],
}

impl Effect for BackboneHardening {
    type State = ();

    const SPEC: Spec = Spec {
        name: "backbone_hardening",
        summary: "The backbones grow stiffer the more they are turned.",
        title: "hardening backbones",
        clause: "backbones that grow stiffer the more they bend",
        law: "τ = −K q (1 + share·(n q)²) of each of a backbone's n hinges about an axis",
        source: "the first odd term beyond a linear spring: G. Duffing, Erzwungene Schwingungen, 1918",
        parameters: &[
            Parameter::new(
                "torsion_share",
                "How much stiffer at a turn of 1 rad over the whole backbone, share: torsion.",
                0.0,
                1e4,
            )
            .believed(0.0, 0.0, 2.0),
            Parameter::new("stiff_share", "The same of the stiff bending.", 0.0, 1e4).believed(0.0, 0.0, 2.0),
            Parameter::new("soft_share", "The same of the soft bending.", 0.0, 1e4).believed(0.0, 0.0, 2.0),
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
        Self { shares: [values[0], values[1], values[2]] }
    }

    fn hardening(&self) -> [f64; 3] {
        self.shares
    }
}
