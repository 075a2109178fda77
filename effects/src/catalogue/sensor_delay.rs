//! `sensor_delay`: the reading is late by a fixed time.
//!
//! Reading `θ(t − delay)`: filters of a converter, a bus, a driver with a buffer. A first-order lag looks the same below
//! some 5 ms.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// A reading of a fixed age.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorDelay {
    /// The reading is this old, s.
    pub delay_s: f64,
}

impl Effect for SensorDelay {
    type State = ();

    const SPEC: Spec = Spec {
        name: "sensor_delay",
        summary: "The reading is late.",
        title: "sensor delay",
        clause: "an angle reading that comes late",
        law: "reading(t) = θ(t − delay)",
        source: "pure dead time of a sampled sensor",
        parameters: &[Parameter::new("delay_s", "The reading is this old.", 0.0, 0.1)],
        acts: Acts::Sensor,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        // A reading that lags looks late, and a delay that does not reach the floor may be the better part of a lag.
        experiment: Some(
            "reverse the drive abruptly at several speeds: a late reading is late by the same time everywhere",
        ),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { delay_s: values[0] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        let delay = FitNumber::linear("delay_s", "the delay", 1e-3, 2e-3, [0.0, 60e-3]);
        // The bridge opens and closes on sample times: a smaller step would not see it.
        vec![FitNumber { starts: vec![2e-3, 10e-3], step: Some(0.25), ..delay }]
    }

    #[inline]
    fn reading_age(&self) -> f64 {
        self.delay_s
    }
}
