//! `driver_drop_by_command`: voltage that the bridge takes from what the command asks for.
//!
//! `v = sign(duty)·max(|duty|·V − drop, 0)`: the loss follows the command, whichever way the current flows, as two junctions do that
//! every phase of the period passes in the commanded direction, or a linear amplifier's output stage (crossover distortion: P.
//! Horowitz, W. Hill, "The Art of Electronics", 2015, section 2.4; L293DD data sheet: saturation voltage). At one supply it is
//! `driver_deadband` by another name.

use crate::effect::{BridgeDrop, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A drop of the commanded voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverDropByCommand {
    /// Of the commanded voltage, V.
    pub drop_v: f64,
}

impl Effect for DriverDropByCommand {
    type State = ();

    const SPEC: Spec = Spec {
        name: "driver_drop_by_command",
        summary: "Voltage lost in the bridge while it drives, whichever way the current flows.",
        title: "a bridge's drop that follows the command",
        clause: "a voltage that is short of what the command asks for",
        law: "v = sign(duty)·max(|duty|·V − drop, 0)",
        source: "P. Horowitz, W. Hill, \"The Art of Electronics\", 2015, 2.4; L293DD data sheet: saturation voltage",
        parameters: &[Parameter::new("drop_v", "Of the commanded voltage.", 0.0, 20.0)],
        acts: Acts::Bridge,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "driver_drop",
                when: "the bridge always drives the way the current flows",
                experiment: "brake hard from full speed at a small opposite duty: a drop against the current turns its sign with \
                             the current, one that follows the command does not",
            },
            Confusion {
                with: "driver_deadband",
                when: "the supply is the same all the time",
                experiment: "run the same duties at two supplies: a drop in volts is a larger share of the lower one",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { drop_v: values[0] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let rail = sizes.rail_v;
        vec![FitNumber::linear("pulse_drop_v", "the drop of the commanded voltage", 0.02 * rail, 0.04 * rail, [0.0, 0.8 * rail])]
    }

    #[inline]
    fn bridge(&self) -> BridgeDrop {
        BridgeDrop { of_command_v: self.drop_v, ..BridgeDrop::default() }
    }
}
