//! A shaft that turns as it is told, whatever torque that takes.

use std::f64::consts::TAU;

use hal_sim::random::{Source, Stream};

use super::Trial;
use common::conventions::omega_from_frequency;

/// Angle of a shaft over time: `start + ω t + error`, the error two sines, of one and two periods a turn; where it swings,
/// `swing (1 − cos ω t)/2 + error`.
pub(super) struct Phase {
    omega: f64,
    start: f64,
    /// How far it swings, rad; 0 where it turns.
    swing: f64,
    /// Amplitude (rad) and phase (rad) of each.
    errors: [(f64, f64); 2],
}

impl Phase {
    pub(super) fn new(trial: &Trial<'_>, noise: Option<f64>) -> Self {
        let omega = omega_from_frequency(trial.f_hz);
        let swing = trial.swing_deg.to_radians();
        let Some(noise) = noise else { return Self { omega, start: 0.0, swing, errors: [(0.0, 0.0); 2] } };
        let start = Stream::new(trial.seeds.run, Source::StartAngle).uniform(-0.5 * TAU, 0.5 * TAU);
        let mut draws = Stream::new(trial.seeds.specimen, Source::Noise);
        // Two sines of an amplitude have it as their root mean square together.
        let errors = [(noise, draws.uniform(0.0, TAU)), (noise, draws.uniform(0.0, TAU))];
        Self { omega, start, swing, errors }
    }

    /// Angle, speed and acceleration.
    pub(super) fn at(&self, time_s: f64) -> (f64, f64, f64) {
        let mut motion = if self.swing == 0.0 {
            (self.start + self.omega * time_s, self.omega, 0.0)
        } else {
            let ((sin, cos), half) = ((self.omega * time_s).sin_cos(), 0.5 * self.swing);
            (half * (1.0 - cos), half * self.omega * sin, half * self.omega * self.omega * cos)
        };
        for (order, (amplitude, phase)) in self.errors.iter().enumerate() {
            let rate = (order + 1) as f64 * self.omega;
            let (sin, cos) = (rate * time_s + phase).sin_cos();
            motion.0 += amplitude * sin;
            motion.1 += amplitude * rate * cos;
            motion.2 -= amplitude * rate * rate * sin;
        }
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phase_error_has_the_stated_size_and_its_own_derivatives() {
        let mut draws = Stream::new(3, Source::Noise);
        let amplitude = 0.05;
        let phase = Phase {
            omega: -44.0,
            start: 0.3,
            swing: 0.0,
            errors: [(amplitude, draws.uniform(0.0, TAU)), (amplitude, draws.uniform(0.0, TAU))],
        };
        let h = 1e-6;
        for k in 0..50 {
            let t = 0.013 * f64::from(k);
            let (angle, speed, acceleration) = phase.at(t);
            let (before, after) = (phase.at(t - h), phase.at(t + h));
            assert!((speed - (after.0 - before.0) / (2.0 * h)).abs() < 1e-5);
            assert!((acceleration - (after.1 - before.1) / (2.0 * h)).abs() < 1e-2);
            assert!((angle - 0.3 + 44.0 * t).abs() <= 2.0 * amplitude);
        }
        let swinging = Phase { swing: 1.7, errors: [(0.0, 0.0); 2], ..phase };
        for k in 0..50 {
            let t = 0.013 * f64::from(k);
            let (angle, speed, acceleration) = swinging.at(t);
            let (before, after) = (swinging.at(t - h), swinging.at(t + h));
            assert!((speed - (after.0 - before.0) / (2.0 * h)).abs() < 1e-5);
            assert!((acceleration - (after.1 - before.1) / (2.0 * h)).abs() < 1e-2);
            assert!((0.0..=1.7).contains(&angle));
        }
        let phase = Phase { swing: 0.0, errors: [(amplitude, 0.3), (amplitude, 1.9)], ..swinging };
        let turns = 7.0 * TAU / 44.0;
        let error = |k: i32| phase.at(turns * f64::from(k) / 10_000.0).0 - 0.3 + 44.0 * turns * f64::from(k) / 10_000.0;
        let mean_square = (0..10_000).map(|k| error(k).powi(2)).sum::<f64>() / 1e4;
        assert!((mean_square.sqrt() - amplitude).abs() < 1e-3 * amplitude, "two sines of an amplitude have it as RMS");
    }
}
