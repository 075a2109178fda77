//! `foot_anisotropy`: the feet's friction differs along and across their module.
//!
//! An elliptic friction limit with the axes of the module (S. Goyal, A. Ruina, J. Papadopoulos, Wear 143, 1991).

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Friction across the module against that along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootAnisotropy {
    /// Friction across the module as a share of the friction along it, 1; positive.
    pub lateral_share: f64,
}

impl Effect for FootAnisotropy {
    type State = ();

    const SPEC: Spec = Spec {
        name: "foot_anisotropy",
        summary: "The feet's friction differs along and across the module.",
        title: "anisotropic friction of the feet",
        clause: "feet that grip differently along and across their module",
        law: "(f_x/(µ N))² + (f_y/(µ N·lateral_share))² ≤ 1",
        source: "S. Goyal, A. Ruina, J. Papadopoulos, Wear 143, 1991",
        parameters: &[Parameter::new(
            "lateral_share",
            "Friction across the module as a share of the friction along it, which is `ground.friction`.",
            0.01,
            100.0,
        )
        .believed(1.0, 0.7, 1.43)],
        acts: Acts::Foot,
        shows_in: Coordinate::Ground,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: Some("turns with the module"),
    };

    fn from_values(values: &[f64]) -> Self {
        Self { lateral_share: values[0] }
    }

    #[inline]
    fn lateral_share(&self) -> f64 {
        self.lateral_share
    }
}
