//! `driver_drop_by_command`: voltage that the bridge's transistors take from every pulse.
//!
//! `v = duty·(V − drop)`: the loss follows the command, whichever way the current flows, as in a bridge whose current freewheels
//! through a path that loses next to nothing (mean of a pulse that is short by the transistors' drop: N. Mohan, T. Undeland, W.
//! Robbins, "Power Electronics", 2003, section 7.7; L293DD data sheet: saturation voltage).

use crate::effect::{BridgeDrop, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A drop within the pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverDropByCommand {
    /// Of a pulse, V.
    pub drop_v: f64,
}

impl Effect for DriverDropByCommand {
    type State = ();

    const SPEC: Spec = Spec {
        name: "driver_drop_by_command",
        summary: "Voltage lost in the bridge while it drives, whichever way the current flows.",
        title: "a bridge's drop that follows the command",
        clause: "pulses that are lower than the supply",
        law: "v = duty·(V − drop)",
        source: "N. Mohan, T. Undeland, W. Robbins, \"Power Electronics\", 2003, 7.7; L293DD data sheet: saturation voltage",
        parameters: &[Parameter::new("drop_v", "Of a pulse.", 0.0, 20.0)],
        acts: Acts::Bridge,
        shows_in: Coordinate::Voltage,
        candidate: false,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "driver_drop",
            when: "the bridge always drives",
            experiment: "lower the duty in steps while the shaft turns fast: a drop that follows the command is less there, one \
                         against the current turns its sign with the current",
        }],
        resembles: &[],
        experiment: Some(
            "measure the voltage at the motor's terminals (column voltage_v) at several duties: a lower supply and a wrong \
             torque constant look alike without it",
        ),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { drop_v: values[0] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let rail = sizes.rail_v;
        vec![FitNumber::linear("pulse_drop_v", "the drop within the pulses", 0.02 * rail, 0.04 * rail, [0.0, 0.8 * rail])]
    }

    #[inline]
    fn bridge(&self) -> BridgeDrop {
        BridgeDrop { of_pulses_v: self.drop_v, ..BridgeDrop::default() }
    }
}
