//! Seeded randomness, one stream for every source, so that turning one nuisance off leaves the others' bits alone.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// What a stream of random numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The shaft's start angle.
    StartAngle,
    /// The cell's charge at the start.
    Charge,
    /// Which of the behaviours the wiper shows in its gap.
    GapBehaviour,
    /// Drift and noise while the wiper is on insulation.
    Gap,
    /// The shape of the linearity error.
    Linearity,
    /// The shape of the converter's integral nonlinearity.
    Inl,
    /// The converter's noise level.
    NoiseLevel,
    /// The converter's noise.
    Noise,
    /// Which conversions are spikes, and their size.
    Spikes,
    /// Sampling instants.
    Jitter,
    /// Noise of the battery reading.
    BatteryNoise,
    /// Noise of a digital encoder.
    Encoder,
    /// A specimen's spread around the file's values.
    Variation,
    // The number of a source is part of its seed: new ones stand at the end.
    /// How long the radio's software takes, and its backoff.
    RadioHandling,
    /// Which frames are in the radio's tail, and how long.
    RadioTail,
    /// Which of the radio's callbacks are late, and how late.
    RadioCallback,
    /// Which tries of the radio are lost.
    RadioLoss,
    /// Fading of the radio's signal.
    RadioFading,
    /// Which of the radio's frames arrive twice.
    RadioDuplicate,
    /// Which of the radio's frames are held back.
    RadioReorder,
    /// Which of the radio's frames arrive with wrong bits, and which bits.
    RadioCorruption,
    /// What an attacker sends.
    Adversary,
    /// A bad contact of the wiper.
    BadContact,
    /// Which of the behaviours the second sensor's wiper shows in its gap.
    SecondGapBehaviour,
    /// What the second sensor's wiper shows in its gap.
    SecondGap,
    /// The shape of the second sensor's linearity error.
    SecondLinearity,
    /// How the second sensor is mounted.
    SecondMounting,
    /// The converter's nuisances at the second sensor.
    SecondConverter,
    /// A bad contact of the second sensor's wiper.
    SecondBadContact,
    /// Which readings repeat the one before.
    HeldReadings,
    /// The same of the second sensor.
    SecondHeldReadings,
    /// The seeds of a learner's episodes, one after the other.
    Episodes,
    /// Where an episode's robot starts.
    StartPose,
    /// The passages of a maze.
    Maze,
}

/// The seed of what belongs to a robot, and that of what belongs to a run of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// Of the robot.
    pub specimen: u64,
    /// Of the run.
    pub run: u64,
}

/// One stream of random numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stream(Pcg64);

impl Stream {
    /// The stream of a source under a seed.
    #[must_use]
    pub fn new(seed: u64, source: Source) -> Self {
        // PCG streams that share a state are related: spread seed and source over the state as well.
        let low = mix(seed ^ mix(source as u64));
        let high = mix(low);
        Self(Pcg64::new(u128::from(high) << 64 | u128::from(low), source as u128))
    }

    /// Standard normal.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// Uniform in `low..high`; `low` where the two are equal.
    #[inline]
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// A seed for streams of their own.
    pub fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform below `count`.
    pub fn below(&mut self, count: u32) -> u32 {
        // 64 random bits against a small count: the bias is below 2⁻³².
        ((u128::from(self.0.next_u64()) * u128::from(count)) >> 64) as u32
    }
}

/// SplitMix64's finaliser (Steele, Lea, Flood 2014).
fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
