//! `held_samples`: a reading now and then repeats the one before it.
//!
//! `y_k = y_{k−1}` with the chance `share`, else `θ_k`, each sample by itself: a bus that loses a message, a converter that is
//! asked before it is done, a driver that hands out its last value (hold strategy behind a Bernoulli channel: L. Schenato, "To
//! zero or to hold control inputs with lossy links?", IEEE Trans. Automatic Control 54, 2009). A simulation draws them; a fit
//! takes what is read on average, `y_k = (1 − share)·θ_k + share·y_{k−1}`: behind an even speed by `share/(1 − share)` samples.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Readings that repeat the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldSamples {
    /// Share of the readings that do, 0 … 1.
    pub held_share: f64,
}

impl Effect for HeldSamples {
    type State = ();

    const SPEC: Spec = Spec {
        name: "held_samples",
        summary: "Now and then a reading repeats the one before it.",
        title: "a sensor that holds readings",
        clause: "readings of which some repeat the one before",
        law: "y_k = y_{k−1} with the chance share, else θ_k; on average y_k = (1 − share)·θ_k + share·y_{k−1}",
        source: "L. Schenato, IEEE Trans. Automatic Control 54, 2009 (hold strategy behind a lossy link)",
        parameters: &[Parameter::new("held_share", "Share of the readings that repeat the one before.", 0.0, 0.98)],
        acts: Acts::Sensor,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "sensor_delay",
                when: "the readings' scatter hides which of them repeat",
                experiment: "turn at a high constant speed and compare successive readings: held ones are equal to the last \
                             digit, late ones never",
            },
            Confusion {
                with: "sensor_lag",
                when: "the readings' scatter hides which of them repeat",
                experiment: "turn at a high constant speed and compare successive readings: held ones are equal to the last \
                             digit, lagging ones never",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { held_share: values[0] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let most = sizes.repeats.min(0.95);
        let share = FitNumber::linear("held_share", "the share of held readings", 0.05, 0.2, [0.0, most]);
        vec![FitNumber { starts: vec![0.2f64.min(0.5 * most), 0.7f64.min(0.9 * most)], ..share }]
    }

    #[inline]
    fn held(&self) -> f64 {
        self.held_share
    }
}
