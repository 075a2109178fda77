//! Open-loop excitations that a careful experimenter would choose.
//!
//! Each run mixes several: steps and reversals (teeth loaded both ways), coast-downs (friction without the motor), slow
//! creeping (what happens near rest), ramps through zero (drop, dead zones), sweeps and multisines (delay, flexibility),
//! bursts at high duty (supply, warmth). Held-out runs have other waveforms of the same kinds.

use super::world::Drive;
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Control ticks per second, usually.
pub const TICKS_PER_S: f64 = 1000.0;

/// A kind of waveform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Levels drawn from both directions, 60–400 ms each.
    Steps,
    /// Spin up, then open the bridge for 0.2–0.6 s.
    CoastDown,
    /// One direction to the other at once.
    Reversals,
    /// Triangles through zero.
    Ramps,
    /// Low duty, slow, with reversals.
    Creep,
    /// Sweep of frequency.
    Chirp,
    /// Sum of sines.
    Multisine,
    /// Full duty against low duty.
    Bursts,
}

/// The six runs: which waveform for how long (s). The first four are for fitting.
pub const PLAN: [&[(Kind, f64)]; 6] = [
    &[(Kind::Steps, 3.0), (Kind::CoastDown, 2.5), (Kind::Ramps, 2.5)],
    &[(Kind::Multisine, 3.0), (Kind::Creep, 3.0), (Kind::Chirp, 2.0)],
    &[(Kind::Reversals, 2.5), (Kind::Bursts, 3.5), (Kind::CoastDown, 2.0)],
    &[(Kind::Creep, 1.5), (Kind::Ramps, 1.5), (Kind::Steps, 2.5), (Kind::Multisine, 2.5)],
    &[(Kind::Chirp, 2.0), (Kind::Creep, 1.5), (Kind::Bursts, 2.0), (Kind::CoastDown, 1.5), (Kind::Reversals, 1.0)],
    &[(Kind::Steps, 2.0), (Kind::Ramps, 1.5), (Kind::Multisine, 1.5), (Kind::Creep, 1.5), (Kind::CoastDown, 1.5)],
];

/// How many of the runs are for fitting.
pub const FIT_RUNS: usize = 4;

/// One run's commands, one per control tick of so many a second.
#[must_use]
pub fn run(plan: &[(Kind, f64)], per_s: f64, rng: &mut Pcg64) -> Vec<Drive> {
    let mut drives = Vec::new();
    for &(kind, seconds) in plan {
        let until = drives.len() + (seconds * per_s).round() as usize;
        while drives.len() < until {
            phase(kind, until - drives.len(), per_s, rng, &mut drives);
        }
        drives.truncate(until);
    }
    for drive in &mut drives {
        // What the file holds is what was driven.
        drive.duty = (drive.duty.clamp(-1.0, 1.0) * 1e5).round() / 1e5;
    }
    drives
}

/// Either sign.
fn sign(rng: &mut Pcg64) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

/// Appends one piece of a waveform: a step, a sweep, a coast-down. May be longer than what is left.
fn phase(kind: Kind, left: usize, per_s: f64, rng: &mut Pcg64, drives: &mut Vec<Drive>) {
    let ticks = |seconds: f64| (seconds * per_s).round() as usize;
    let mut push = |count: usize, duty: &dyn Fn(f64) -> f64, enable: bool| {
        for tick in 0..count {
            drives.push(Drive { duty: if enable { duty(tick as f64 / per_s) } else { 0.0 }, enable });
        }
    };
    match kind {
        Kind::Steps => {
            let duty = sign(rng) * rng.random_range(0.05..1.0);
            push(ticks(rng.random_range(0.06..0.4)), &|_| duty, true);
        }
        Kind::CoastDown => {
            let duty = sign(rng) * rng.random_range(0.15..1.0);
            push(ticks(rng.random_range(0.12..0.3)), &|_| duty, true);
            push(ticks(rng.random_range(0.2..0.6)), &|_| 0.0, false);
        }
        Kind::Reversals => {
            let first = sign(rng) * rng.random_range(0.3..1.0);
            let second = -first.signum() * rng.random_range(0.2..1.0);
            push(ticks(rng.random_range(0.08..0.25)), &|_| first, true);
            push(ticks(rng.random_range(0.08..0.25)), &|_| second, true);
        }
        Kind::Ramps => {
            let (top, bottom) = (sign(rng) * rng.random_range(0.2..0.9), rng.random_range(0.2..0.9));
            let bottom = -top.signum() * bottom;
            let length = rng.random_range(0.4..0.9);
            push(ticks(length), &|t| top + (bottom - top) * t / length, true);
            push(ticks(length), &|t| bottom + (top - bottom) * t / length, true);
        }
        Kind::Creep => {
            let (a, b) = (rng.random_range(0.02..0.12), rng.random_range(0.01..0.06));
            let (f, g) = (rng.random_range(0.4..1.5), rng.random_range(1.5..4.0));
            let (p, q) = (rng.random_range(0.0..TAU), rng.random_range(0.0..TAU));
            push(
                ticks(rng.random_range(0.6..1.5)),
                &|t| a * (TAU * f * t + p).sin() + b * (TAU * g * t + q).sin(),
                true,
            );
        }
        Kind::Chirp => {
            let (amplitude, offset) = (rng.random_range(0.3..0.8), rng.random_range(-0.2..0.2));
            let (from, to) = (rng.random_range(0.4..1.0), rng.random_range(8.0..20.0));
            let length = left as f64 / per_s;
            let growth: f64 = to / from;
            let phase = move |t: f64| TAU * from * length / growth.ln() * (growth.powf(t / length) - 1.0);
            push(left, &|t| offset + amplitude * phase(t).sin(), true);
        }
        Kind::Multisine => {
            let offset = rng.random_range(-0.15..0.15);
            let tones: Vec<(f64, f64)> = [0.3, 0.8, 1.7, 3.1, 5.3, 9.1, 15.0]
                .iter()
                .map(|f| (f * rng.random_range(0.85..1.15), rng.random_range(0.0..TAU)))
                .collect();
            let amplitude = rng.random_range(0.18..0.3);
            let wave = |t: f64| tones.iter().map(|(f, p)| (TAU * f * t + p).sin()).sum::<f64>();
            push(left, &|t| offset + amplitude * wave(t), true);
        }
        Kind::Bursts => {
            let high = sign(rng) * rng.random_range(0.8..1.0);
            let low = sign(rng) * rng.random_range(0.05..0.35);
            push(ticks(rng.random_range(0.25..0.7)), &|_| high, true);
            push(ticks(rng.random_range(0.15..0.4)), &|_| low, true);
        }
    }
}
