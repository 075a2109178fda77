//! `friction_patch`: friction that is higher over a part of the turn.
//!
//! `g = torque·w(θ)`, `w = ½(tanh((Δ + h)/e) − tanh((Δ − h)/e))` with the angle `Δ` from the patch's middle, half its width
//! `h` and its edges' length `e`, on the bristle of the other friction: a dry or a dented tooth, a bent axle that binds once a
//! turn (friction over the position: B. Armstrong-Hélouvry, "Control of Machines with Friction", 1991, section 4.3).

use std::f64::consts::{PI, TAU};

use super::coulomb_friction::presliding_length;
use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Friction over a range of the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionPatch {
    /// Level inside, beside all other friction, N·m.
    pub torque_nm: f64,
    /// Middle of the range, rad.
    pub middle_rad: f64,
    /// Half of its width, rad; positive.
    pub half_width_rad: f64,
    /// Length over which it begins and ends, rad; positive.
    pub edge_rad: f64,
    /// Presliding length δ, rad; positive. Counts where no other friction has one.
    pub presliding_rad: f64,
}

impl Effect for FrictionPatch {
    type State = ();

    const SPEC: Spec = Spec {
        name: "friction_patch",
        summary: "More friction over a part of the turn.",
        title: "a patch of friction",
        clause: "friction that is higher over a part of the turn",
        law: "g = torque·½(tanh((Δ + h)/edge) − tanh((Δ − h)/edge)), Δ = θ − middle, on the bristle of the other friction",
        source: "B. Armstrong-Hélouvry, \"Control of Machines with Friction\", 1991, 4.3 (friction over the position)",
        parameters: &[
            Parameter::drag("torque_nm", "Sliding level inside, beside all other friction.", 0.0, 10.0),
            Parameter::new("middle_deg", "Middle of the range of shaft angles.", -360.0, 360.0),
            Parameter::new("half_width_deg", "Half of its width.", 0.1, 170.0),
            Parameter::new("edge_deg", "Length over which it begins and ends.", 0.1, 45.0),
            Parameter::new("presliding_deg", "Presliding length (Dahl).", 0.001, 30.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Angle,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "gravity_tilt",
                when: "the shaft turns one way only",
                experiment: "turn slowly through the whole turn, both ways: a patch brakes both ways, gravity pushes one way \
                             where it brakes the other",
            },
            Confusion {
                with: "coulomb_friction",
                when: "the shaft stays within a part of the turn",
                experiment: "turn slowly through the whole turn, both ways: friction of one level brakes everywhere",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self {
            torque_nm: values[0],
            middle_rad: values[1],
            half_width_rad: values[2],
            edge_rad: values[3],
            presliding_rad: values[4],
        }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let torque = sizes.torque_nm;
        let middle = FitNumber::linear("patch_middle", "the patch's middle", 0.1, TAU, [0.5 * PI, 3.5 * PI]);
        vec![
            FitNumber::linear("patch_torque", "the patch's friction", 0.01 * torque, 0.03 * torque, [0.0, torque]),
            FitNumber { starts: (0..6).map(|sixth| TAU + f64::from(sixth - 3) * PI / 3.0).collect(), ..middle },
            FitNumber::log("patch_half_width", "half the patch's width", [0.5; 2], [0.05, 2.9], 0.7),
            FitNumber::log("patch_edge", "the patch's edge", [0.1; 2], [0.01, 0.7], 0.5),
            presliding_length([4e-3; 2]),
        ]
    }

    /// A fit has the middle a turn on: where it lies says nothing of how large the patch is, and is never none.
    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        values.copy_from_slice(numbers);
        values[1] = wrap(numbers[1]);
    }

    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        numbers.copy_from_slice(values);
        numbers[1] = TAU + wrap(values[1]);
    }

    #[inline]
    fn friction_level(&self, angle: f64, _speed: f64, _transmitted_nm: f64) -> f64 {
        self.level(angle)
    }

    #[inline]
    fn presliding(&self) -> Option<f64> {
        Some(self.presliding_rad)
    }
}

/// An angle to −π … π, rad.
#[inline]
fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

impl FrictionPatch {
    /// Not inlined: it would make the friction of every other shaft too large to be.
    #[inline(never)]
    fn level(&self, angle: f64) -> f64 {
        let away = wrap(angle - self.middle_rad);
        let edge = |end: f64| ((away + end) / self.edge_rad).tanh();
        0.5 * self.torque_nm * (edge(self.half_width_rad) - edge(-self.half_width_rad))
    }
}
