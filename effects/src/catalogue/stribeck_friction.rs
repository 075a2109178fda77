//! `stribeck_friction`: friction that is highest at rest and falls with speed.
//!
//! `g(ω) = torque + excess·exp(−(ω/ω_s)²)`, on the same bristle as Coulomb friction, which it contains (B.
//! Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994).

use super::coulomb_friction::{presliding_length, sliding_level};
use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Friction that falls with speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StribeckFriction {
    /// Sliding level at speed, N·m.
    pub torque_nm: f64,
    /// How much higher the level is at rest, N·m.
    pub breakaway_excess_nm: f64,
    /// Stribeck speed ω_s, rad/s; positive.
    pub speed_rad_per_s: f64,
    /// Presliding length δ, rad; positive.
    pub presliding_rad: f64,
}

impl Effect for StribeckFriction {
    type State = ();

    const SPEC: Spec = Spec {
        name: "stribeck_friction",
        summary: "Friction that falls with speed.",
        title: "Stribeck friction",
        clause: "friction that is highest at rest and falls with speed",
        law: "g = torque + breakaway_excess·exp(−(ω/ω_s)²), on Coulomb friction's bristle",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994",
        parameters: &[
            Parameter::drag("torque_nm", "Sliding level at speed.", 0.0, 10.0),
            Parameter::drag("breakaway_excess_nm", "How much higher at rest.", 0.0, 10.0),
            Parameter::new("speed_rad_per_s", "Stribeck speed.", 0.001, 1000.0),
            Parameter::new("presliding_deg", "Presliding length (Dahl).", 0.001, 30.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Speed,
        candidate: true,
        contains: &["coulomb_friction"],
        mistaken_for: &[
            Confusion {
                with: "driver_drop",
                when: "the bridge always drives",
                experiment: "turn the shaft up to speed and let it coast with the bridge open (enable = 0), from several \
                             speeds: friction brakes on, the driver's drop does not",
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
        Self {
            torque_nm: values[0],
            breakaway_excess_nm: values[1],
            speed_rad_per_s: values[2],
            presliding_rad: values[3],
        }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let torque = sizes.torque_nm;
        let excess = [0.01 * torque, 0.02 * torque];
        vec![
            sliding_level(sizes),
            FitNumber::linear("breakaway_excess", "the breakaway torque", excess[0], excess[1], [0.0, torque]),
            FitNumber::log("stribeck_speed", "the Stribeck speed", [4.0, 1.0], [0.1, 40.0], 2.0),
            presliding_length([4e-3; 2]),
        ]
    }

    #[inline]
    fn friction_level(&self, _angle: f64, speed: f64, _transmitted_nm: f64) -> f64 {
        let ratio = speed / self.speed_rad_per_s;
        self.torque_nm + self.breakaway_excess_nm * (-ratio * ratio).exp()
    }

    #[inline]
    fn presliding(&self) -> Option<f64> {
        Some(self.presliding_rad)
    }
}
