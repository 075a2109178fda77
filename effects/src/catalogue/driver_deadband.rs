//! `driver_deadband`: small duties do nothing, and what the bridge gives beyond them is short by as much.
//!
//! `d_bridge = max(|d| − width, 0)·sign d`: dead time that no data sheet tells, a driver's input filter, a firmware's own
//! offset.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// A part of the duty that never arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverDeadband {
    /// Duty up to which nothing comes out, and that is missing beyond, 1.
    pub width_duty: f64,
}

impl Effect for DriverDeadband {
    type State = ();

    const SPEC: Spec = Spec {
        name: "driver_deadband",
        summary: "Duty below which the bridge does nothing.",
        title: "the driver's deadband",
        clause: "small duties that do nothing",
        law: "d_bridge = max(|d| − width, 0)·sign d",
        source: "dead time of a bridge: transistors wait for each other",
        parameters: &[Parameter::new(
            "width_duty",
            "|duty| up to which nothing comes out; beyond it the output is `duty − sign·width`.",
            0.0,
            0.9,
        )],
        acts: Acts::Command,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: Some("measure the voltage at the motor's terminals (column voltage_v) at small duties, both ways"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { width_duty: values[0] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        let deadband = FitNumber::linear("deadband", "the deadband", 0.01, 0.03, [0.0, 0.6]);
        vec![FitNumber { starts: vec![0.03, 0.3], ..deadband }]
    }

    #[inline]
    fn duty(&self, duty: f64) -> f64 {
        (duty.abs() - self.width_duty).max(0.0).copysign(duty)
    }
}
