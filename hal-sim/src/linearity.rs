//! The sensor's angle error over a turn: `θ + Σ_k (cos_k cos kθ + sin_k sin kθ)`, k = 1, 2.

use std::f64::consts::TAU;

use description::robot::SensorNonlinearity;

use crate::random::Stream;

/// Amplitudes of the first two harmonics, rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Linearity {
    /// Of cos θ and cos 2θ, rad.
    pub cos: [f64; 2],
    /// Of sin θ and sin 2θ, rad.
    pub sin: [f64; 2],
}

impl Linearity {
    /// The error of one specimen. Where the file states values (an identified sensor) these are it. Where all its values
    /// are zero the file knows only bounds: the shape is drawn from the four ranges, and its peak uniformly up to the
    /// largest of their ends (an amplitude of ±3° bounds the whole error to ±3°).
    #[must_use]
    pub fn draw(effect: &SensorNonlinearity, stream: &mut Stream) -> Self {
        let quantities = [&effect.cos1_deg, &effect.sin1_deg, &effect.cos2_deg, &effect.sin2_deg];
        let with = |degrees: [f64; 4]| {
            let [cos1, sin1, cos2, sin2] = degrees.map(f64::to_radians);
            Self { cos: [cos1, cos2], sin: [sin1, sin2] }
        };
        if quantities.iter().any(|quantity| quantity.value != 0.0) {
            return with(quantities.map(|quantity| quantity.value));
        }
        let bound = quantities.iter().map(|quantity| quantity.low.abs().max(quantity.high.abs())).fold(0.0, f64::max);
        let shape = with(quantities.map(|quantity| stream.uniform(quantity.low, quantity.high)));
        shape.with_peak(stream.uniform(0.0, bound).to_radians())
    }

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
