//! `battery_sag`: the bridge's supply gives way under the bridge's own current, at once and more after a while.
//!
//! `v = e − R_s·i_b − u`, `du/dt = (R_r·i_b − u)/τ`, `i_b = duty·i` being what the averaged bridge draws (first-order Thevenin
//! model of a cell or regulator: M. Chen, G. Rincón-Mora, IEEE Trans. Energy Conversion 21, 2006).

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::relaxation::relaxed;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// The supply's resistance, a part of it with a relaxation time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatterySag {
    /// At once, Ω.
    pub resistance_ohm: f64,
    /// More with the relaxation time, Ω.
    pub relaxation_ohm: f64,
    /// Relaxation time, s.
    pub relaxation_s: f64,
}

impl Effect for BatterySag {
    /// The slow part at present, V.
    type State = f64;

    const SPEC: Spec = Spec {
        name: "battery_sag",
        summary: "The bridge's supply falls under load.",
        title: "battery sag",
        clause: "a supply that gives way under load",
        law: "v = e − resistance·i_b − u, du/dt = (relaxation·i_b − u)/τ, i_b = duty·i",
        source: "M. Chen, G. Rincón-Mora, IEEE Trans. Energy Conversion 21, 2006 (first-order Thevenin model)",
        parameters: &[
            Parameter::new("resistance_ohm", "At once.", 0.0, 100.0),
            Parameter::new("relaxation_ohm", "More, with the relaxation time.", 0.0, 100.0),
            Parameter::new("relaxation_s", "Relaxation time.", 1e-4, 1000.0),
        ],
        acts: Acts::Supply,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: Some("measure the bridge's supply (column supply_v) in the same runs"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { resistance_ohm: values[0], relaxation_ohm: values[1], relaxation_s: values[2] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let (unit, bounds) = (0.05 * sizes.resistance_ohm, [0.0, 2.0 * sizes.resistance_ohm]);
        vec![
            FitNumber::linear("sag_ohm", "the supply's resistance", unit, unit, bounds),
            FitNumber::linear("relaxation_ohm", "the supply's slow resistance", unit, unit, bounds),
            FitNumber::log("relaxation_s", "the supply's relaxation time", [0.8, 0.1], [0.02, 20.0], 1.5),
        ]
    }

    #[inline]
    fn supply_resistance(&self) -> f64 {
        self.resistance_ohm
    }

    #[inline]
    fn supply_fallen(&self, fallen: &f64) -> f64 {
        *fallen
    }

    /// The slow part's closed form at a constant current.
    #[inline]
    fn draw(&self, fallen: &mut f64, bridge_a: f64, time: f64) {
        *fallen = relaxed(*fallen, self.relaxation_ohm * bridge_a, time, self.relaxation_s);
    }
}
