//! The integral nonlinearity of an analogue-to-digital converter behind a potentiometer: the file knows its peak, and every
//! specimen has a shape of its own (`hal_sim::adc`).
//!
//! In the angle that a code stands for it is a smooth error over the scale, of two to five waves. It is expanded in sines and
//! cosines of 2, 3, 4 and 5 waves whose amplitudes a fit moves, each held by the file's peak.

use std::f64::consts::TAU;

use effects::Scale;
use robot_file::angle_code::{AdcCurve, Track as Element};
use robot_file::robot::{Robot, Sensor};

use super::numbers::{Free, Number};

/// Waves over the converter's scale.
const WAVES: [f64; 4] = [2.0, 3.0, 4.0, 5.0];
/// Amplitudes: a sine and a cosine a wave.
const AMPLITUDES: usize = 2 * WAVES.len();
/// An amplitude beyond this many times the file's peak is not tried.
const MOST_PEAKS: f64 = 1.5;
/// Standard deviation of an amplitude as a share of the file's peak: together they then have the mean square of one wave of
/// that peak.
const PRIOR: f64 = 0.35;

/// The error of one converter, in the angle that its codes stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConverterError {
    element: Element,
    /// The file's peak, rad.
    peak: f64,
    /// Sine and cosine of each wave, rad.
    amplitudes: [f64; AMPLITUDES],
}

impl ConverterError {
    /// Of a robot whose potentiometer nobody has calibrated, no error to begin with; `None` where the file has no such
    /// converter. A correction has the converter's error in it.
    #[must_use]
    pub fn new(robot: &Robot) -> Option<Self> {
        let Sensor::Potentiometer(sensor) = &robot.sensor else { return None };
        if sensor.correction.is_some() || sensor.adc.inl_lsb.value <= 0.0 {
            return None;
        }
        let element = Element::new(sensor);
        let rad_per_code = element.angle_per_v() / AdcCurve::new(&sensor.adc).codes_per_v;
        Some(Self { element, peak: sensor.adc.inl_lsb.value * rad_per_code, amplitudes: [0.0; AMPLITUDES] })
    }

    /// The numbers that a fit moves.
    #[must_use]
    pub fn numbers(&self) -> Vec<Free> {
        let most = MOST_PEAKS * self.peak;
        (0..AMPLITUDES)
            .map(|i| Free {
                number: Number::OfConverter(i),
                words: "the converter's nonlinearity",
                scale: Scale::Linear(self.peak),
                start: 0.0,
                low: -most,
                high: most,
                prior: PRIOR,
                step: 0.1,
                follows_scale: 0.0,
            })
            .collect()
    }

    /// With the amplitudes (rad) that a fit has found.
    #[must_use]
    pub fn with(mut self, value: impl Fn(Number) -> Option<f64>) -> Self {
        for (i, amplitude) in self.amplitudes.iter_mut().enumerate() {
            *amplitude = value(Number::OfConverter(i)).unwrap_or(*amplitude);
        }
        self
    }

    /// Error of the reading where the wiper stands at an angle (rad), rad.
    #[inline]
    #[must_use]
    pub fn error(&self, wiper: f64) -> f64 {
        // The scale as a share of the track; the waves are so long that the converter's bend and offset do not matter.
        let share = (wiper.rem_euclid(TAU) - self.element.half_gap) / self.element.electrical;
        let waves = WAVES.iter().zip(self.amplitudes.chunks_exact(2));
        waves
            .map(|(wave, pair)| {
                let (sin, cos) = (TAU * wave * share).sin_cos();
                pair[0] * sin + pair[1] * cos
            })
            .sum()
    }
}
