//! `command_latency`: the bridge follows its command late by a fixed time.
//!
//! `duty at the bridge(t) = duty commanded(t − latency)`: a computation that ends after the tick that it is for, a bus, a timer
//! that takes its register over with the next period (transport delay of a sampled loop: K. Åström, B. Wittenmark,
//! "Computer-Controlled Systems", 1997, section 3.2).

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A command of a fixed age.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandLatency {
    /// The command is this old when the bridge follows it, s.
    pub latency_s: f64,
}

impl Effect for CommandLatency {
    type State = ();

    const SPEC: Spec = Spec {
        name: "command_latency",
        summary: "The bridge follows its command late.",
        title: "command latency",
        clause: "a command that arrives late",
        law: "duty at the bridge(t) = duty commanded(t − latency), enable likewise",
        source: "K. Åström, B. Wittenmark, \"Computer-Controlled Systems\", 1997, 3.2 (transport delay)",
        parameters: &[Parameter::new("latency_s", "The command is this old.", 0.0, 0.1)],
        acts: Acts::Command,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "sensor_delay",
            when: "nothing but the command and the angle was recorded",
            experiment: "measure the voltage at the motor's terminals (column voltage_v): against it a late command is not late \
                         any more, a late reading is",
        }],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { latency_s: values[0] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        let latency = FitNumber::linear("latency_s", "the command's latency", 1e-3, 2e-3, [0.0, 60e-3]);
        // The bridge opens and closes on sample times: a smaller step would not see it.
        vec![FitNumber { starts: vec![2e-3, 10e-3], step: Some(0.25), ..latency }]
    }

    #[inline]
    fn command_age(&self) -> f64 {
        self.latency_s
    }
}
