//! `sensor_hysteresis`: play between the shaft and what is read.
//!
//! `y = θ + clamp(y − θ, ±gap/2)`: the reading stands until the shaft has crossed the play and is then dragged along (play
//! operator: M. Krasnosel'skii, A. Pokrovskii, "Systems with Hysteresis", 1989; a wiper's: Bourns 3382 data sheet, hysteresis).
//! It comes beside the play that a potentiometer's own table has.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Play of the reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorHysteresis {
    /// All of the play, rad.
    pub gap_rad: f64,
}

impl Effect for SensorHysteresis {
    /// How far the reading is behind, rad.
    type State = f64;

    const SPEC: Spec = Spec {
        name: "sensor_hysteresis",
        summary: "Play between the shaft and the reading, beside a potentiometer's own.",
        title: "sensor hysteresis",
        clause: "a reading that stands still while the shaft turns back through its play",
        law: "y = θ + clamp(y − θ, ±gap/2)",
        source: "M. Krasnosel'skii, A. Pokrovskii, \"Systems with Hysteresis\", 1989; Bourns 3382 data sheet",
        parameters: &[Parameter::new("gap_deg", "All of the play.", 0.0, 45.0)],
        acts: Acts::Sensor,
        shows_in: Coordinate::Speed,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: Some("turn the shaft slowly to and fro by a few degrees: the reading stands at either end"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { gap_rad: values[0] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        let gap = FitNumber::linear("sensor_play", "the sensor's play", 0.01, 0.02, [0.0, 0.6]);
        vec![FitNumber { starts: vec![0.02, 0.1], ..gap }]
    }

    fn follows(&self) -> bool {
        true
    }

    #[inline]
    fn follow(&self, behind: &mut f64, moved: f64, _step: f64) -> f64 {
        let before = *behind;
        let half = 0.5 * self.gap_rad;
        // Not `clamp`: a fit may try a NaN, and must see it come back instead of a panic.
        *behind = (before + moved).max(-half).min(half);
        moved + before - *behind
    }

    #[inline]
    fn behind(&self, behind: &f64) -> f64 {
        *behind
    }

    fn settle(&self, behind: &mut f64, _speed: f64, dragging: f64) {
        *behind = 0.5 * self.gap_rad * dragging;
    }
}
