//! How many readings repeat the one before them, which the readings say themselves: while the shaft moves, two that follow each other are
//! equal to the last digit only where one was held. A reading that is late by as much on average repeats none.

use super::floor;
use super::track::Track;

/// A shaft moves where it turns in a sample by this many deviations of the reading's noise: then two readings are not equal by chance.
const MOVES: f64 = 8.0;
/// Samples on either side over which it does: over many, since a sensor that is read more often than it measures stands still for some;
/// and over few, since a shaft may stand still too.
const AROUND: (usize, usize) = (20, 3);
/// Readings closer than this are equal, rad.
const EQUAL: f64 = 1e-12;

/// The largest share of readings that repeat the one before: 99.9 % bound of a Poisson count; 1 where too few were read on the move.
pub fn most(tracks: &[Track]) -> f64 {
    let counts = tracks.iter().map(|track| count(&track.angle));
    let (repeats, moving) = counts.fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    let bound = repeats + 3.1 * f64::sqrt(repeats) + 7.0;
    if bound < moving { bound / moving } else { 1.0 }
}

/// Readings that repeat the one before, and all, of those that were read on the move.
fn count(angle: &[f64]) -> (f64, f64) {
    let least = MOVES * floor::fast_noise(angle);
    let (wide, narrow) = AROUND;
    let moving = (wide..angle.len().saturating_sub(wide)).filter(|&i| {
        let turns = |half: usize| (angle[i + half] - angle[i - half]).abs() > least * 2.0 * half as f64;
        let held_all_along = || angle[i - narrow..=i + narrow].windows(2).all(are_equal);
        turns(wide) && (turns(narrow) || held_all_along())
    });
    moving
        .fold((0.0, 0.0), |(repeats, all), i| (repeats + f64::from(u8::from(are_equal(&angle[i - 1..=i]))), all + 1.0))
}

fn are_equal(pair: &[f64]) -> bool {
    (pair[1] - pair[0]).abs() < EQUAL
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Readings of a shaft that swings, rounded to 12 bit, of which each repeats the one before with a chance, or one in so many is new.
    fn swing(held: f64, every: usize) -> Vec<f64> {
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let step = std::f64::consts::TAU / 4096.0;
        let mut read = Vec::new();
        for i in 0..4000 {
            let noise: f64 = StandardNormal.sample(&mut random);
            let angle = 3.0 * (0.02 * i as f64).sin() + 1.5e-3 * noise;
            let holds = random.random_range(0.0..1.0) < held || i % every > 0;
            let before = read.last().copied().filter(|_| holds);
            read.push(before.unwrap_or_else(|| (angle / step).round() * step));
        }
        read
    }

    fn share((repeats, moving): (f64, f64)) -> f64 {
        assert!(moving > 1000.0, "{moving} readings on the move");
        repeats / moving
    }

    #[test]
    fn a_moving_shaft_repeats_no_reading_by_chance() {
        assert_eq!(count(&swing(0.0, 1)).0, 0.0);
    }

    #[test]
    fn held_readings_are_counted() {
        let found = share(count(&swing(0.1, 1)));
        assert!((found - 0.1).abs() < 0.02, "{found}");
    }

    #[test]
    fn a_sensor_that_is_read_more_often_than_it_measures_is_counted() {
        let found = share(count(&swing(0.0, 8)));
        assert!((found - 0.875).abs() < 0.02, "{found}");
    }

    #[test]
    fn readings_at_rest_say_nothing() {
        assert_eq!(count(&[0.5; 1000]), (0.0, 0.0));
    }
}
