//! `coulomb_friction`: a constant torque against the motion.
//!
//! `g(ω) = torque_nm`, carried by a bristle of the presliding length: `ds/dt = (ω/δ)(1 − s·sign ω)`, torque `−g·s` (P. R. Dahl,
//! "A solid friction model", 1968). The bristle itself is the shaft's: `hal_sim::shaft`.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Constant friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoulombFriction {
    /// Sliding level, N·m.
    pub torque_nm: f64,
    /// Presliding length δ, rad; positive.
    pub presliding_rad: f64,
}

/// The level at which a friction slides far from rest, as a fit moves it.
pub(super) fn sliding_level(sizes: &Sizes) -> FitNumber {
    let torque = sizes.torque_nm;
    FitNumber::linear("sliding_torque", "the sliding friction", 0.01 * torque, 0.02 * torque, [0.0, torque])
}

/// The presliding length of the one bristle, as a fit moves it.
pub(super) fn presliding_length(starts: [f64; 2]) -> FitNumber {
    FitNumber::log("presliding", "the presliding length", starts, [3e-4, 0.15], 2.0)
}

impl Effect for CoulombFriction {
    type State = ();

    const SPEC: Spec = Spec {
        name: "coulomb_friction",
        summary: "Constant friction; excluded by `stribeck_friction`, which contains it.",
        title: "Coulomb friction",
        clause: "a constant torque against the motion",
        law: "g = torque, on a bristle ds/dt = (ω/δ)(1 − s·sign ω)",
        source: "P. R. Dahl, \"A solid friction model\", 1968",
        parameters: &[
            Parameter::drag("torque_nm", "Sliding level.", 0.0, 10.0),
            Parameter::new("presliding_deg", "Presliding length (Dahl).", 0.001, 30.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Speed,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "driver_drop",
                when: "the bridge always drives",
                experiment: "turn the shaft up to speed and let it coast with the bridge open (enable = 0), from several \
                             speeds: friction brakes on, the driver's drop does not",
            },
            Confusion {
                with: "stribeck_friction",
                when: "the shaft never passes slowly through rest",
                experiment: "raise the duty slowly through zero from rest, both ways, a dozen times: a breakaway above the \
                             sliding torque shows Stribeck friction",
            },
            Confusion {
                with: "load_friction",
                when: "torque hardly varies",
                experiment: "accelerate hard and coast freely through the same speeds: only load friction differs between \
                             the two",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { torque_nm: values[0], presliding_rad: values[1] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        vec![sliding_level(sizes), presliding_length([4e-3, 2e-2])]
    }

    #[inline]
    fn friction_level(&self, _angle: f64, _speed: f64, _transmitted_nm: f64) -> f64 {
        self.torque_nm
    }

    #[inline]
    fn presliding(&self) -> Option<f64> {
        Some(self.presliding_rad)
    }
}
