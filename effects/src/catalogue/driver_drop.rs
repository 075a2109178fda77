//! `driver_drop`: voltage that the bridge's transistors and diodes keep for themselves.
//!
//! `drop·sat(|i|/knee) + slope·|i|` against the current of a bridge with slow decay, averaged over a PWM period (L293DD data sheet:
//! saturation voltage against current). Transistors and diodes reach their voltage at some milliamperes. Without a knee no current flows
//! while `|v − K ω| < drop`.

use crate::effect::{BridgeDrop, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// The averaged bridge's drop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverDrop {
    /// Drop beyond the knee, less what the slope adds, V.
    pub drop_v: f64,
    /// Current from which on the drop is there in full, A.
    pub knee_a: f64,
    /// Rise of the drop with current, Ω.
    pub slope_ohm: f64,
}

impl Effect for DriverDrop {
    type State = ();

    const SPEC: Spec = Spec {
        name: "driver_drop",
        summary: "Voltage lost in the bridge.",
        title: "the driver's voltage drop",
        clause: "voltage that the bridge keeps for itself",
        law: "v_motor = v − drop·sat(i/knee) − slope·i, sat(x) = max(−1, min(x, 1)); without a knee i = 0 while |v − K ω| < drop",
        source: "L293DD data sheet: saturation voltage against current",
        parameters: &[
            Parameter::new("drop_v", "Beyond the knee, less what the slope adds.", 0.0, 10.0),
            Parameter::new("knee_a", "Current from which on the drop is there in full: below it a part in proportion; 0: always all.", 0.0, 10.0),
            Parameter::new("slope_ohm", "Rise with current.", 0.0, 100.0),
        ],
        acts: Acts::Bridge,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "driver_deadband",
                when: "the motor never brakes itself through the bridge",
                experiment: "lower the duty in steps while the shaft turns fast, and hold small duties both ways at speed: a \
                             deadband takes a share of the command whichever way the current flows, a drop acts against \
                             the current",
            },
            Confusion {
                with: "battery_sag",
                when: "one load",
                experiment: "hold several duties on the same load and measure the bridge's supply (column supply_v)",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { drop_v: values[0], knee_a: values[1], slope_ohm: values[2] }
    }

    /// The slope is a resistance like the winding's: without a measured current no fit tells the two apart, so it stays. So does the knee,
    /// with which a drop could pass for dead time wherever the duty is not full.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let drop = FitNumber::linear("drop_v", "the bridge's drop", 0.1, 0.1, [0.0, 0.8 * sizes.rail_v]);
        // Bridges of bipolar transistors take a third of a small motor's supply.
        vec![FitNumber { starts: vec![0.1, 0.3 * sizes.rail_v], ..drop }]
    }

    #[inline]
    fn bridge(&self) -> BridgeDrop {
        BridgeDrop { drop_v: self.drop_v, knee_a: self.knee_a, slope_ohm: self.slope_ohm, ..BridgeDrop::default() }
    }
}
