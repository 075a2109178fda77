//! What a data set is recorded with, beside what is hidden in it.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::excite::TICKS_PER_S;
use super::hidden::Law;
use super::noise::Noise;

/// What a data set is recorded with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Every run's length is this share of the usual 8 s: another data set than the whole one's beginning, because each
    /// waveform is shortened or lengthened.
    pub share: f64,
    /// Readings and commands a second.
    pub per_s: f64,
    /// Resolution of the sensor over a turn; `None` for 12 to 14 bit.
    pub bits: Option<u32>,
    /// What the noise of the reading is like.
    pub noise: Noise,
    /// How far the robot file's numbers are off, as a share of them.
    pub file_off: (f64, f64),
    /// Which law the hidden effect has.
    pub law: Law,
    /// Bounds of the hidden effect's misfit over the noise floor instead of the category's own.
    pub ratio: Option<(f64, f64)>,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            share: 1.0,
            per_s: TICKS_PER_S,
            bits: None,
            noise: Noise::White,
            file_off: (0.10, 0.30),
            law: Law::First,
            ratio: None,
        }
    }
}

impl Setting {
    /// As people's recordings are: 2–20 s at 100 Hz–5 kHz with 10–14 bit, noise of all kinds, a file that is 10–50 % off, either
    /// law.
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x5e77_1265);
        let log = |low: f64, high: f64, rng: &mut Pcg64| low * (high / low).powf(rng.random_range(0.0..1.0));
        // A number of samples, too: nobody records twenty seconds at 5 kHz, and two at 100 Hz show nothing.
        let per_s = [100.0, 200.0, 500.0, 1000.0, 1000.0, 2000.0, 5000.0][rng.random_range(0..7)];
        let (shortest, longest) = if per_s > 1500.0 {
            (2.0, 6.0)
        } else if per_s < 300.0 {
            (8.0, 20.0)
        } else {
            (2.0, 20.0)
        };
        Self {
            share: log(shortest, longest, &mut rng) / 8.0,
            per_s,
            bits: Some(rng.random_range(10..=14)),
            noise: match rng.random_range(0..4) {
                0 => Noise::White,
                1 => Noise::Coloured(log(5e-3, 0.1, &mut rng)),
                2 => Noise::HeavyTailed,
                _ => Noise::GrowsWithSpeed(rng.random_range(20.0..80.0)),
            },
            file_off: (0.10, 0.50),
            law: if rng.random_bool(0.5) { Law::First } else { Law::Second },
            ratio: None,
        }
    }

    /// In a few words.
    #[must_use]
    pub fn words(&self) -> String {
        let law = if self.law == Law::First { "law 1" } else { "law 2" };
        let bits = self.bits.map_or("12-14".to_owned(), |bits| bits.to_string());
        format!("{law}, {:.0} Hz, {:.1} s, {bits} bit, {}", self.per_s, 8.0 * self.share, self.noise.words())
    }
}
