//! `grease_warming`: the grease warms up with what friction turns into heat, and damps less.
//!
//! `b = b₀·exp(−u)`, `du/dt = (thinning·P − u)/τ`, `P` the power that damping, friction and drag take: an oil's viscosity falls by
//! the same factor for every kelvin (O. Reynolds, Phil. Trans. R. Soc. 177, 1886), and its warmth is that of one body. Every
//! run begins with the file's damping.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::relaxation::relaxed;
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Grease that thins as it works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GreaseWarming {
    /// Logarithm of the damping's fall in the end, for each watt, 1/W.
    pub thinning_per_w: f64,
    /// Thermal time constant, s; positive.
    pub time_s: f64,
}

impl Effect for GreaseWarming {
    /// Logarithm of how far the damping has fallen, 1.
    type State = f64;

    const SPEC: Spec = Spec {
        name: "grease_warming",
        summary: "The viscous damping falls as the grease warms up.",
        title: "grease that warms up",
        clause: "damping that falls with what friction turns into heat",
        law: "b = b₀·exp(−u), du/dt = (thinning·P − u)/time, P = (b ω + friction + drag)·ω",
        source: "O. Reynolds, Phil. Trans. R. Soc. 177, 1886 (viscosity over the temperature)",
        parameters: &[
            Parameter::new("thinning_per_w", "Logarithm of the fall in the end, for each watt.", 0.0, 10000.0),
            Parameter::new("time_s", "Thermal time constant.", 0.01, 100000.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "battery_discharge",
            when: "the bridge drives hard from beginning to end",
            experiment: "compare coasts (enable = 0) from the same speed at the beginning and at the end: grease shows there, a \
                         battery does not",
        }],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { thinning_per_w: values[0], time_s: values[1] }
    }

    /// In units of ten over the largest mechanical power: what rubs is a small part of it.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let watt = 0.25 * sizes.torque_nm * sizes.free_speed;
        let unit = 10.0 / watt;
        vec![
            FitNumber::linear("thinning", "the grease's thinning", unit, 2.0 * unit, [0.0, 1000.0 * unit]),
            FitNumber::log("thinning_s", "the grease's thermal time constant", [5.0, 1.0], [0.2, 300.0], 2.0),
        ]
    }

    fn warms(&self) -> bool {
        true
    }

    /// The closed form at a constant loss.
    #[inline]
    fn warm(&self, fallen: &mut f64, _winding_w: f64, friction_w: f64, time: f64) {
        *fallen = relaxed(*fallen, self.thinning_per_w * friction_w, time, self.time_s);
    }

    #[inline]
    fn viscous_factor(&self, fallen: &f64) -> f64 {
        (-fallen).exp()
    }

    fn lasts(&self) -> bool {
        true
    }
}
