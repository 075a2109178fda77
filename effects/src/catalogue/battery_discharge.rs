//! `battery_discharge`: the bridge's supply falls with the charge that was drawn from it.
//!
//! `v = e − fall·q`, `dq/dt = duty·i`: the open-circuit voltage of a cell over the straight middle of its discharge (M. Chen, G.
//! Rincón-Mora, IEEE Trans. Energy Conversion 21, 2006), or a large capacitor, whose `fall` is one over its capacitance. Every
//! run begins with the file's supply.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A supply that empties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryDischarge {
    /// Fall per charge drawn, V/(A·s).
    pub fall_v_per_as: f64,
}

impl Effect for BatteryDischarge {
    /// Charge drawn since the start, A·s.
    type State = f64;

    const SPEC: Spec = Spec {
        name: "battery_discharge",
        summary: "The bridge's supply falls with the charge drawn.",
        title: "a battery that empties",
        clause: "a supply that falls with the charge drawn from it",
        law: "v = e − fall·q, dq/dt = duty·i",
        source: "M. Chen, G. Rincón-Mora, IEEE Trans. Energy Conversion 21, 2006 (open-circuit voltage over the charge)",
        parameters: &[Parameter::new("fall_v_per_as", "Fall per charge drawn.", 0.0, 1000.0)],
        acts: Acts::Supply,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "battery_sag",
                when: "the load stays the same",
                experiment: "rest for a minute after hard work: a supply that gave way comes back, an empty one does not",
            },
            Confusion {
                with: "winding_heating",
                when: "the bridge drives hard from beginning to end",
                experiment: "measure the bridge's supply (column supply_v) in the same runs",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { fall_v_per_as: values[0] }
    }

    /// In units of a hundredth of the supply for a second at stall.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let unit = 0.01 * sizes.resistance_ohm;
        vec![FitNumber::linear("battery_fall", "the battery's fall with its charge", unit, unit, [0.0, 100.0 * unit])]
    }

    #[inline]
    fn supply_fallen(&self, drawn_as: &f64) -> f64 {
        self.fall_v_per_as * drawn_as
    }

    #[inline]
    fn draw(&self, drawn_as: &mut f64, bridge_a: f64, time: f64) {
        *drawn_as += bridge_a * time;
    }

    fn lasts(&self) -> bool {
        true
    }
}
