//! `sensor_nonlinearity`: an angle error of the sensor that repeats every turn.
//!
//! Reading `θ + Σ_k (cos_k cos kθ + sin_k sin kθ)`, k = 1, 2: an eccentric mounting makes the first harmonic, an elliptic
//! or tilted track the second.

use std::f64::consts::TAU;

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Amplitudes of the first two harmonics of the error, rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct SensorNonlinearity {
    /// Of cos θ and cos 2θ, rad.
    pub cos: [f64; 2],
    /// Of sin θ and sin 2θ, rad.
    pub sin: [f64; 2],
}

impl SensorNonlinearity {
    /// The same shape with another peak (rad). A shape of nothing stays nothing.
    #[must_use]
    pub fn with_peak(self, peak: f64) -> Self {
        let now = self.peak();
        let scale = if now > 0.0 { peak / now } else { 0.0 };
        Self { cos: self.cos.map(|amplitude| amplitude * scale), sin: self.sin.map(|amplitude| amplitude * scale) }
    }

    /// Error at a shaft angle (rad), rad.
    #[inline]
    #[must_use]
    pub fn error(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        self.cos[0] * cos + self.sin[0] * sin + self.cos[1] * (cos * cos - sin * sin) + self.sin[1] * 2.0 * sin * cos
    }

    /// Largest error over the turn, rad (on a grid of half a degree: 1e-4 of itself too low at most).
    #[must_use]
    pub fn peak(&self) -> f64 {
        (0..720).map(|i| self.error(TAU * f64::from(i) / 720.0).abs()).fold(0.0, f64::max)
    }
}

impl Effect for SensorNonlinearity {
    type State = ();

    const SPEC: Spec = Spec {
        name: "sensor_nonlinearity",
        summary: "The sensor's angle error over a turn.",
        title: "sensor nonlinearity",
        clause: "an angle error that repeats every turn",
        law: "reading = θ + Σ_k (cos_k cos kθ + sin_k sin kθ), k = 1, 2",
        source: "eccentricity and tilt of a rotary sensor; Bourns 3382 data sheet: linearity ±2 %",
        parameters: &[
            Parameter::new("cos1_deg", "First harmonic, cosine.", -30.0, 30.0),
            Parameter::new("sin1_deg", "First harmonic, sine.", -30.0, 30.0),
            Parameter::new("cos2_deg", "Second harmonic, cosine.", -30.0, 30.0),
            Parameter::new("sin2_deg", "Second harmonic, sine.", -30.0, 30.0),
        ],
        acts: Acts::Sensor,
        shows_in: Coordinate::Angle,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { cos: [values[0], values[2]], sin: [values[1], values[3]] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        [
            ("cos1", "the sensor's first harmonic"),
            ("sin1", "the sensor's first harmonic"),
            ("cos2", "the sensor's second harmonic"),
            ("sin2", "the sensor's second harmonic"),
        ]
        .into_iter()
        .map(|(name, words)| FitNumber::linear(name, words, 0.01, 0.0, [-0.15, 0.15]))
        .collect()
    }

    #[inline]
    fn reading_error(&self, angle: f64) -> f64 {
        self.error(angle)
    }
}
