//! The truth's sensor: nonlinearity, age, hysteresis, noise, quantisation, and when it was read.

use super::noise::Noise;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use std::f64::consts::{PI, TAU};

/// The sensor of a specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Resolution over a turn.
    pub bits: u32,
    /// Noise before quantisation, standard deviation, rad.
    pub noise: f64,
    /// What that noise is like.
    pub kind: Noise,
    /// Standard deviation of the sampling instant about the tick, s; the instant itself is in the recording.
    pub timing: f64,
    /// Whether the recording is wrapped into one turn.
    pub wrapped: bool,
    /// Half width of an arc about angle 0 in which nothing is read, rad; 0 for none.
    pub blind_half_width: f64,
    /// Error over the turn: amplitude and phase of harmonics 1, 2, …, rad.
    pub harmonics: Vec<(f64, f64)>,
    /// The reading is this old, s.
    pub delay: f64,
    /// Standard deviation of that age, s.
    pub delay_jitter: f64,
    /// By how much later a reading is for every second of the run, 1: its clock runs faster than the drive's.
    pub drift: f64,
    /// By what share of itself that drift grows in a second.
    pub drift_grows_per_s: f64,
    /// Widths of the plays between shaft and wiper, rad: the wiper is in the middle of all.
    pub plays: Vec<f64>,
    /// Readings that repeat the one before.
    pub held: Option<Held>,
    /// Counts that get lost.
    pub skip: Option<Skip>,
    /// Standard deviation of a current reading, A; `None` where no current is measured.
    pub current_noise: Option<f64>,
}

/// Readings that repeat the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Share of the readings.
    pub share: f64,
    /// How many in a row on average, where one is.
    pub burst: f64,
}

/// An encoder that loses counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skip {
    /// So much at once, against the motion, rad.
    pub rad: f64,
    /// Beyond this speed, rad/s.
    pub above: f64,
    /// So often a second.
    pub per_s: f64,
}

impl Sensor {
    /// A good sensor: 12–14 bit, 1–2.5 mrad of noise, sampling instants within some 20 µs.
    #[must_use]
    pub fn draw(rng: &mut Pcg64) -> Self {
        Self {
            bits: rng.random_range(12..=14),
            noise: rng.random_range(1.0e-3..2.5e-3),
            kind: Noise::White,
            timing: rng.random_range(5e-6..30e-6),
            wrapped: rng.random_bool(0.5),
            blind_half_width: 0.0,
            harmonics: Vec::new(),
            delay: 0.0,
            delay_jitter: 0.0,
            drift: 0.0,
            drift_grows_per_s: 0.0,
            plays: Vec::new(),
            held: None,
            skip: None,
            current_noise: if rng.random_bool(0.25) { Some(rng.random_range(2e-3..5e-3)) } else { None },
        }
    }

    /// Sampling instants for a number of ticks, s: increasing, rounded to what the file holds (0.1 µs).
    #[must_use]
    pub fn instants(&self, ticks: usize, per_s: f64, rng: &mut Pcg64) -> Vec<f64> {
        let period = 1.0 / per_s;
        (0..ticks)
            .map(|tick| {
                let noise: f64 = StandardNormal.sample(rng);
                let late = (self.timing * noise).clamp(-0.3 * period, 0.3 * period);
                let start = if tick == 0 { 0.0 } else { late };
                ((tick as f64 * period + start) * 1e7).round() / 1e7
            })
            .collect()
    }

    /// Error over the turn at a shaft angle, rad.
    #[must_use]
    pub fn nonlinearity(&self, angle: f64) -> f64 {
        self.harmonics
            .iter()
            .enumerate()
            .map(|(n, (amplitude, phase))| amplitude * ((n + 1) as f64 * angle + phase).sin())
            .sum()
    }

    /// What is read of an angle, not wrapped, with a noise in standard deviations: noise and quantisation.
    #[must_use]
    pub fn read(&self, shown: f64, noise: f64) -> f64 {
        let step = TAU / f64::from(1u32 << self.bits);
        ((shown + self.noise * noise) / step).round() * step
    }

    /// How old a reading at a time of the run is, s, without its jitter.
    #[must_use]
    pub fn age(&self, time: f64) -> f64 {
        self.delay + self.drift * time * (1.0 + self.drift_grows_per_s * time)
    }

    /// Whether a reading shows anything but the shaft of its own instant.
    #[must_use]
    pub fn looks_back(&self) -> bool {
        self.delay > 0.0 || self.drift != 0.0 || !self.plays.is_empty()
    }

    /// Whether a reading lies in the blind arc.
    #[must_use]
    pub fn blind(&self, angle: f64) -> bool {
        ((angle + PI).rem_euclid(TAU) - PI).abs() < self.blind_half_width
    }
}

/// Play of a given width: the follower moves only when pushed.
#[must_use]
pub fn follow(follower: f64, leader: f64, width: f64) -> f64 {
    follower.clamp(leader - 0.5 * width, leader + 0.5 * width)
}
