//! `clock_drift`: the clock that stamps the readings runs faster, or slower, than that of the drive.
//!
//! `reading(t) = θ(t − drift·t)`: sensor and drive have an oscillator each, are set together at the start of a run and never
//! again, and their records are merged by their stamps. To first order in the drift (frequency offset of a clock: D. Mills, J.
//! Martin, J. Burbank, W. Kasch, RFC 5905, 2010, section 4). Crystals drift by tens of ppm, RC oscillators by thousands.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// The frequency offset of the sensor's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockDrift {
    /// How much faster than the drive's the sensor's clock runs, ppm.
    pub drift_ppm: f64,
}

impl Effect for ClockDrift {
    type State = ();

    const SPEC: Spec = Spec {
        name: "clock_drift",
        summary: "The sensor's clock and the drive's drift apart from the start of a run on.",
        title: "clock drift",
        clause: "readings that are stamped by a clock of another rate than the drive's",
        law: "reading(t) = θ(t − drift·t)",
        source: "D. Mills, J. Martin, J. Burbank, W. Kasch, RFC 5905, 2010, section 4 (frequency offset of a clock)",
        parameters: &[Parameter::new(
            "drift_ppm",
            "How much faster the sensor's clock runs. Of a slower one, readings seem to come before what they show: in a \
             merged recording; a simulated robot, which reads as it goes, shows the shaft of now.",
            -20000.0,
            20000.0,
        )],
        acts: Acts::Sensor,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "sensor_delay",
            when: "the run is short",
            experiment: "record one run of several minutes: a late reading is as late at its end as at its start, a drift is \
                         later and later",
        }],
        experiment: Some("repeat the same abrupt reversal at the start and at the end of a run of several minutes"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { drift_ppm: values[0] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        let drift = FitNumber::linear("clock_drift", "the clock's drift", 100.0, 0.0, [-1e4, 1e4]);
        // Towards the end of a run the bridge opens and closes elsewhere: a smaller step would not see it.
        vec![FitNumber { starts: vec![0.0, 1500.0, -1500.0], step: Some(0.5), ..drift }]
    }

    #[inline]
    fn ageing(&self) -> f64 {
        1e-6 * self.drift_ppm
    }
}
