//! `directional_friction`: Coulomb friction that is higher one way than the other.
//!
//! `ds/dt = (ω/δ)(1 − s·sign ω)`, torque `−(g + l·s)·s` with `g = (forward + backward)/2` and `l = (forward − backward)/2`:
//! `forward` where the bristle has slid counter-clockwise, `backward` clockwise, and no jump between them at rest. It takes
//! energy on every way around, for `g ≥ |l|` (levels that differ with the direction: B. Armstrong-Hélouvry, P. Dupont, C.
//! Canudas de Wit, Automatica 30, 1994; the bristle: P. R. Dahl, "A solid friction model", 1968).

use super::coulomb_friction::{presliding_length, sliding_level};
use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Constant friction of two levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalFriction {
    /// Sliding level counter-clockwise, N·m; not negative.
    pub forward_nm: f64,
    /// Sliding level clockwise, N·m; not negative.
    pub backward_nm: f64,
    /// Presliding length δ, rad; positive.
    pub presliding_rad: f64,
}

impl Effect for DirectionalFriction {
    type State = ();

    const SPEC: Spec = Spec {
        name: "directional_friction",
        summary: "Friction that is higher one way than the other; excludes `coulomb_friction`, which it contains.",
        title: "friction that differs by direction",
        clause: "friction that is higher one way than the other",
        law: "τ = −(g + l·s)·s, g = (forward + backward)/2, l = (forward − backward)/2, on Coulomb friction's bristle s",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30, 1994",
        parameters: &[
            Parameter::drag("forward_nm", "Sliding level counter-clockwise.", 0.0, 10.0),
            Parameter::drag("backward_nm", "Sliding level clockwise.", 0.0, 10.0),
            Parameter::new("presliding_deg", "Presliding length (Dahl).", 0.001, 30.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Speed,
        candidate: true,
        contains: &["coulomb_friction"],
        mistaken_for: &[Confusion {
            with: "bias_torque",
            when: "the shaft always slides",
            experiment: "let the shaft come to rest with the bridge open (enable = 0), from both sides, again and again: a \
                         constant torque pulls it on while it rests, friction does not",
        }],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { forward_nm: values[0], backward_nm: values[1], presliding_rad: values[2] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let torque = sizes.torque_nm;
        let lean = FitNumber::linear("friction_lean", "half of what friction is higher counter-clockwise", 0.01 * torque, 0.0, [-torque, torque]);
        vec![sliding_level(sizes), lean, presliding_length([4e-3, 2e-2])]
    }

    /// The mean level is Coulomb friction's; what differs by direction is beside it.
    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        let (level, lean) = (numbers[0], numbers[1]);
        values.copy_from_slice(&[(level + lean).max(0.0), (level - lean).max(0.0), numbers[2]]);
    }

    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        numbers.copy_from_slice(&[0.5 * (values[0] + values[1]), 0.5 * (values[0] - values[1]), values[2]]);
    }

    fn fit_ranges(_values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        let level = 0.5 * (half_ranges[0] + half_ranges[1]);
        numbers.copy_from_slice(&[level, level, half_ranges[2]]);
    }

    #[inline]
    fn friction_level(&self, _angle: f64, _speed: f64, _transmitted_nm: f64) -> f64 {
        0.5 * (self.forward_nm + self.backward_nm)
    }

    #[inline]
    fn friction_lean(&self) -> f64 {
        0.5 * (self.forward_nm - self.backward_nm)
    }

    #[inline]
    fn presliding(&self) -> Option<f64> {
        Some(self.presliding_rad)
    }
}
