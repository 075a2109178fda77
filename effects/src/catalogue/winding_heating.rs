//! `winding_heating`: the winding warms up, and its resistance with it.
//!
//! `R = R₀(1 + α·T)`, `dT/dt = (R_th·P − T)/τ`, `P = R i²`, `α = 0.393 %/K` of copper at 20 °C (thermal circuit of one body: A.
//! Hughes, B. Drury, "Electric Motors and Drives", 2019, section 11.2; copper: IEC 60028). The magnet, which warms more slowly,
//! keeps its torque constant here. `T` is the warmth above that for which the file's resistance holds, and every run begins
//! with none.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::relaxation::relaxed;
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Temperature coefficient of copper's resistance at 20 °C, 1/K (IEC 60028).
pub const COPPER_PER_KELVIN: f64 = 3.93e-3;

/// One body that the winding's loss warms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindingHeating {
    /// In the end, for each watt, K/W.
    pub rise_k_per_w: f64,
    /// Thermal time constant, s; positive.
    pub time_s: f64,
}

impl Effect for WindingHeating {
    /// Warmth, K.
    type State = f64;

    const SPEC: Spec = Spec {
        name: "winding_heating",
        summary: "The winding's resistance grows as it warms up.",
        title: "a winding that warms up",
        clause: "a resistance that grows with the winding's own heat",
        law: "R = R₀(1 + 0.00393/K·T), dT/dt = (rise·R·i² − T)/time",
        source: "A. Hughes, B. Drury, \"Electric Motors and Drives\", 2019, 11.2; IEC 60028 (copper)",
        parameters: &[
            Parameter::new("rise_k_per_w", "Warmth in the end, for each watt.", 0.0, 10000.0),
            Parameter::new("time_s", "Thermal time constant.", 0.01, 100000.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "battery_sag",
                when: "the supply was not measured",
                experiment: "measure the bridge's supply (column supply_v) in the same runs",
            },
            Confusion {
                with: "grease_warming",
                when: "torque and speed rise and fall together",
                experiment: "hold the shaft at a high duty for half a minute, and compare coasts (enable = 0) before and after: \
                             a warm winding leaves them alike, warm grease does not",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { rise_k_per_w: values[0], time_s: values[1] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        vec![
            FitNumber::linear("warmth_k_per_w", "the winding's warmth", 10.0, 30.0, [0.0, 1000.0]),
            FitNumber::log("warmth_s", "the winding's thermal time constant", [5.0, 1.0], [0.2, 300.0], 2.0),
        ]
    }

    fn warms(&self) -> bool {
        true
    }

    /// The closed form at a constant loss.
    #[inline]
    fn warm(&self, kelvin: &mut f64, winding_w: f64, _friction_w: f64, time: f64) {
        *kelvin = relaxed(*kelvin, self.rise_k_per_w * winding_w, time, self.time_s);
    }

    #[inline]
    fn resistance_factor(&self, kelvin: &f64) -> f64 {
        1.0 + COPPER_PER_KELVIN * kelvin
    }

    fn lasts(&self) -> bool {
        true
    }
}
