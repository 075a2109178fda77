//! `foot_stribeck`: the feet's friction falls with their sliding speed.
//!
//! `µ(v) = µ (1 + excess·exp(−(v/v_s)²))` (B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994).

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Friction of a foot that is highest at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootStribeck {
    /// How much higher at rest, as a share of the friction at speed.
    pub excess_share: f64,
    /// Stribeck speed v_s, m/s; positive.
    pub speed_m_per_s: f64,
}

impl Effect for FootStribeck {
    type State = ();

    const SPEC: Spec = Spec {
        name: "foot_stribeck",
        summary: "The feet's friction falls with their sliding speed.",
        title: "Stribeck friction of the feet",
        clause: "feet that grip more at rest than while they slide",
        law: "µ(v) = µ (1 + excess·exp(−(v/v_s)²)), µ being `ground.friction`",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994",
        parameters: &[
            Parameter::new("excess_share", "How much higher at rest, share of the friction at speed.", 0.0, 10.0)
                .believed(0.0, 0.0, 0.5),
            Parameter::new("speed_m_per_s", "Stribeck speed.", 1e-5, 10.0).believed(0.02, 0.005, 0.08),
        ],
        acts: Acts::Foot,
        shows_in: Coordinate::Ground,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: Some("falls with speed"),
    };

    fn from_values(values: &[f64]) -> Self {
        Self { excess_share: values[0], speed_m_per_s: values[1] }
    }

    #[inline]
    fn friction_factor(&self, speed: f64, _load: f64) -> f64 {
        let ratio = speed / self.speed_m_per_s;
        1.0 + self.excess_share * (-ratio * ratio).exp()
    }

    fn varies_foot_friction(&self) -> bool {
        true
    }
}
