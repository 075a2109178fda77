//! What can be hidden between the shaft and the recording.

use std::f64::consts::TAU;

use super::{Effect, Law, Shape};
use crate::blind::sensing::{Held, Sensor, Skip};
use crate::blind::world::{Lag, World};

/// Puts an error of a size into a sensor.
pub fn apply(shape: &Shape, effect: Effect, size: f64, world: &mut World, sensor: &mut Sensor) {
    match effect {
        Effect::SensorNonlinearity => {
            sensor.harmonics = match shape.law {
                Law::First => harmonics(shape, size),
                Law::Second => saw(shape, size),
            };
        }
        Effect::SensorDelay => {
            sensor.delay = 1e-3 * size;
            sensor.delay_jitter =
                shape.either(shape.between(3, 1e-6, 4e-6), shape.between(3, 0.03, 0.08) * sensor.delay);
        }
        Effect::SensorLag => {
            world.lag = Some(Lag { time_s: 8e-3 * size, second_order: shape.law == Law::Second });
        }
        Effect::SensorHysteresis => {
            let gap = 0.01 * size;
            // Of one play, or of two that share the reading (L. Prandtl, I. Ishlinskii).
            sensor.plays = shape.either(vec![gap], vec![0.7 * gap, 1.3 * gap]);
        }
        Effect::HeldSamples => {
            sensor.held =
                Some(Held { share: (0.1 * size).min(0.95), burst: shape.either(1.0, shape.between(3, 1.5, 2.5)) });
        }
        Effect::ClockDrift => {
            let sign = if shape.between(3, -1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
            sensor.drift = sign * 1e-3 * size;
            sensor.drift_grows_per_s = shape.either(0.0, shape.between(4, -0.03, 0.03));
        }
        Effect::EncoderSkip => {
            sensor.skip =
                Some(Skip { rad: 0.02 * size, above: 0.4 * world.rig.free_speed(), per_s: shape.between(3, 1.5, 4.0) });
        }
        _ => world.belt_creep = 0.02 * size,
    }
}

/// Most in the first two harmonics, a tail that falls off as a bent element's does.
fn harmonics(shape: &Shape, size: f64) -> Vec<(f64, f64)> {
    let first = shape.between(3, 0.5, 1.0);
    let amplitudes = [first, 1.3 - first, shape.between(4, 0.03, 0.06), shape.between(5, 0.015, 0.03), 0.01];
    let phase = |n: usize| {
        TAU * (shape.between(6, 0.0, 1.0) * (3 * n + 1) as f64 + shape.between(7, 0.0, 1.0) * (n * n) as f64)
    };
    amplitudes.iter().enumerate().map(|(n, a)| (0.010 * size * a, phase(n).rem_euclid(TAU))).collect()
}

/// Straight up over a part of the turn and straight down over the rest: its Fourier series, twelve terms of it.
fn saw(shape: &Shape, size: f64) -> Vec<(f64, f64)> {
    let (up, from) = (shape.between(3, 0.35, 0.65), TAU * shape.between(4, 0.0, 1.0));
    let scale = 1.0 / (std::f64::consts::PI.powi(2) * up * (1.0 - up));
    (1..=12)
        .map(|n| {
            let order = f64::from(n);
            let amplitude = scale * (std::f64::consts::PI * order * up).sin() / (order * order);
            (0.010 * size * amplitude, (order * from).rem_euclid(TAU))
        })
        .collect()
}
