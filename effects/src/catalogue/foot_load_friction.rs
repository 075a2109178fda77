//! `foot_load_friction`: the feet's friction coefficient falls with their load.
//!
//! `µ(F) = µ (F/F₀)^−exponent`, at most 3 µ: a smooth elastic sphere's contact grows with F^(2/3), so its exponent is 1/3
//! (H. Hertz, 1881; J. F. Archard, Proc. Roy. Soc. A 243, 1957).

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Friction of a foot that falls with its load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootLoadFriction {
    /// Exponent, 1.
    pub exponent: f64,
    /// The load F₀ at which the coefficient is `ground.friction`, N; positive.
    pub load_n: f64,
}

impl Effect for FootLoadFriction {
    type State = ();

    const SPEC: Spec = Spec {
        name: "foot_load_friction",
        summary: "The feet's friction coefficient falls with their load.",
        title: "load-dependent friction of the feet",
        clause: "feet whose friction does not grow in proportion to their load",
        law: "µ(F) = µ (F/F₀)^−exponent, at most 3 µ",
        source: "H. Hertz, 1881; J. F. Archard, Proc. Roy. Soc. A 243, 1957",
        parameters: &[
            Parameter::new("exponent", "Exponent; 1/3 for a smooth elastic sphere.", 0.0, 1.0)
                .believed(0.0, 0.0, 0.33),
            Parameter::new("load_n", "The load F₀ at which the coefficient is `ground.friction`.", 1e-4, 100.0)
                .believed(0.06, 0.06, 0.06),
        ],
        acts: Acts::Foot,
        shows_in: Coordinate::Ground,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: Some("falls with load"),
    };

    fn from_values(values: &[f64]) -> Self {
        Self { exponent: values[0], load_n: values[1] }
    }

    #[inline]
    fn friction_factor(&self, _speed: f64, load: f64) -> f64 {
        // Without the bound a foot that just touches would stick for ever.
        (load.max(f64::MIN_POSITIVE) / self.load_n).powf(-self.exponent).min(3.0)
    }

    fn varies_foot_friction(&self) -> bool {
        true
    }
}
