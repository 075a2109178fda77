//! The noise of the truth's angle reading: white and normal, or one of the kinds that break an assumption of whoever reads it.

use rand_distr::{Distribution, StandardNormal, StudentT};
use rand_pcg::Pcg64;

/// What the noise of a reading is like. All have the sensor's standard deviation at rest.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Noise {
    /// Independent and normal.
    #[default]
    White,
    /// A first-order Markov process that remembers for this long, s.
    Coloured(f64),
    /// Independent, of Student's t with three degrees of freedom.
    HeavyTailed,
    /// Independent and normal, and larger by its own size at this speed, rad/s.
    GrowsWithSpeed(f64),
}

impl Noise {
    /// From `white`, `coloured:MS`, `heavy` or `speed:RAD_PER_S`.
    ///
    /// # Errors
    /// What was expected.
    pub fn from_words(words: &str) -> Result<Self, String> {
        let (kind, number) = words.split_once(':').map_or((words, None), |(kind, number)| (kind, number.parse().ok()));
        match (kind, number.filter(|number: &f64| *number > 0.0)) {
            ("white", None) => Ok(Self::White),
            ("coloured", Some(ms)) => Ok(Self::Coloured(1e-3 * ms)),
            ("heavy", None) => Ok(Self::HeavyTailed),
            ("speed", Some(speed)) => Ok(Self::GrowsWithSpeed(speed)),
            _ => Err("expected white, coloured:MS, heavy or speed:RAD_PER_S".to_owned()),
        }
    }
}

impl Noise {
    /// The words of [`Self::from_words`].
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::White => "white".to_owned(),
            Self::Coloured(remembers) => format!("coloured:{:.0}", 1e3 * remembers),
            Self::HeavyTailed => "heavy".to_owned(),
            Self::GrowsWithSpeed(speed) => format!("speed:{speed:.0}"),
        }
    }
}

/// Draws the noise of one reading after the other, in standard deviations.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    noise: Noise,
    last: Option<f64>,
}

impl Source {
    /// At the beginning of a run.
    #[must_use]
    pub fn new(noise: Noise) -> Self {
        Self { noise, last: None }
    }

    /// The next reading's, `dt` (s) after the one before, at a speed (rad/s).
    pub fn next(&mut self, dt: f64, speed: f64, rng: &mut Pcg64) -> f64 {
        let normal: f64 = StandardNormal.sample(rng);
        match self.noise {
            Noise::White => normal,
            Noise::Coloured(remembers) => {
                let kept = (-dt / remembers).exp();
                let now = self.last.map_or(normal, |last| kept * last + (1.0 - kept * kept).sqrt() * normal);
                self.last = Some(now);
                now
            }
            // Three degrees of freedom have the variance 3.
            Noise::HeavyTailed => StudentT::new(3.0).map_or(normal, |t| t.sample(rng) / 3f64.sqrt()),
            Noise::GrowsWithSpeed(doubled) => normal * (1.0 + speed.abs() / doubled),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn drawn(noise: Noise, speed: f64) -> Vec<f64> {
        let (mut source, mut rng) = (Source::new(noise), Pcg64::seed_from_u64(3));
        (0..200_000).map(|_| source.next(1e-3, speed, &mut rng)).collect()
    }

    fn mean_square(values: &[f64]) -> f64 {
        values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
    }

    #[test]
    fn every_kind_has_the_sensors_size_at_rest_and_what_makes_it_its_kind() {
        let white = drawn(Noise::White, 30.0);
        assert!((mean_square(&white) - 1.0).abs() < 0.02);
        let coloured = drawn(Noise::Coloured(20e-3), 30.0);
        assert!((mean_square(&coloured) - 1.0).abs() < 0.1);
        let at =
            |lag: usize| coloured.iter().zip(&coloured[lag..]).map(|(a, b)| a * b).sum::<f64>() / coloured.len() as f64;
        assert!((at(20) - (-1f64).exp()).abs() < 0.05, "{}", at(20));
        let heavy = drawn(Noise::HeavyTailed, 0.0);
        let beyond = |values: &[f64]| values.iter().filter(|value| value.abs() > 4.0).count();
        assert!((mean_square(&heavy) - 1.0).abs() < 0.3 && beyond(&heavy) > 20 * beyond(&white).max(10));
        assert!((mean_square(&drawn(Noise::GrowsWithSpeed(30.0), 30.0)) - 4.0).abs() < 0.1);
    }

    #[test]
    fn words_name_a_kind() {
        assert_eq!(Noise::from_words("coloured:20"), Ok(Noise::Coloured(0.02)));
        assert_eq!(Noise::from_words("heavy"), Ok(Noise::HeavyTailed));
        for wrong in ["pink", "coloured", "coloured:0", "speed:fast", "white:3"] {
            assert!(Noise::from_words(wrong).is_err(), "{wrong}");
        }
    }
}
