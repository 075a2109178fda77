//! Readings that repeat the one before them. While the shaft moves, two that follow each other are equal to the last digit only where the
//! second was held: a bus lost a message, or the sensor was asked before it had measured again. A reading that is late repeats none.

use super::floor;
use super::track::Track;

/// A shaft moves beyond doubt where it turns in a sample by this many deviations of the reading's noise, and by this many of its steps:
/// two readings are not equal by chance then.
const MOVES: (f64, f64) = (8.0, 3.0);
/// Where readings are held, those that repeat the one before are dropped from this share of a deviation or step a sample on. Of a shaft
/// that is slower equal readings are right ones, and a held one is hardly off.
const SLOWLY: f64 = 0.5;
/// Samples on either side over which it does: over many, since a sensor that is read more often than it measures stands still for some;
/// and over few, since a shaft may stand still too.
const AROUND: (usize, usize) = (20, 3);
/// Readings closer than this are equal, rad.
const EQUAL: f64 = 1e-12;
/// So many certain holds of a run are no accident, and this share of all at least: two holds that follow each other hide both.
const FEWEST: usize = 5;
const CERTAIN: f64 = 0.3;
/// Of more than this share of held readings what is left does not follow a shaft.
const MOST: f64 = 0.6;

/// The repeats of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Repeats {
    /// Readings that were taken while the shaft moved beyond doubt.
    pub moving: usize,
    /// Those of them that repeat the one before.
    pub held: usize,
    /// Times that a reading of those was held, however long.
    holds: usize,
    /// Times of those that the shaft cannot have stood still for as long.
    certain: usize,
    /// Where readings are held, the places of all that repeat the one before while the shaft moves, by no more than a reading can tell.
    pub stale: Vec<usize>,
}

impl Repeats {
    /// Of a run's readings on one scale, rad; NaN where there is none.
    pub fn of(angle: &[f64]) -> Self {
        let (noise, step) = (floor::fast_noise(angle), least_step(angle));
        let surely = (MOVES.0 * noise).max(MOVES.1 * step);
        let mut found = Self::default();
        for i in 1..angle.len() {
            let is_held = are_equal(&angle[i - 1..=i]);
            let turns = |half: usize, least: f64| turns(angle, i, half, least);
            if is_held && [AROUND.0, AROUND.1].into_iter().any(|half| turns(half, SLOWLY * noise.max(step))) {
                found.stale.push(i);
            }
            let stands_in_between = is_held && all_equal(angle, i);
            if turns(AROUND.0, surely) && (stands_in_between || turns(AROUND.1, surely)) {
                found.moving += 1;
                found.held += usize::from(is_held);
                if is_held && (i < 2 || !are_equal(&angle[i - 2..i])) {
                    found.holds += 1;
                    found.certain += usize::from(goes_on(angle, i, surely));
                }
            }
        }
        if !found.are_held() {
            found.stale.clear();
        }
        found
    }

    /// Whether readings were held, and so many left that they follow the shaft.
    pub fn are_held(&self) -> bool {
        let is_no_accident = self.certain >= FEWEST && self.certain as f64 > CERTAIN * self.holds as f64;
        is_no_accident && (self.held as f64) < MOST * self.moving as f64
    }

    fn and(self, other: &Self) -> Self {
        Self {
            moving: self.moving + other.moving,
            held: self.held + other.held,
            holds: self.holds + other.holds,
            certain: self.certain + other.certain,
            stale: Vec::new(),
        }
    }

    /// Share of the readings that repeat the one before: value and 95 % interval (E. B. Wilson, J. American Statistical Association 22,
    /// 1927), for holds as long as these are.
    pub fn share(&self) -> [f64; 3] {
        const Z: f64 = 1.96;
        let share = self.held as f64 / self.moving as f64;
        // Readings of one hold are not independent: of holds whose lengths are geometric the variance is so many times as large.
        let times = 2.0 * self.held as f64 / self.holds.max(1) as f64 - 1.0;
        let n = self.moving as f64 / times.max(1.0);
        let middle = share + 0.5 * Z * Z / n;
        let half = Z * (share * (1.0 - share) / n + 0.25 * (Z / n).powi(2)).sqrt();
        [share, (middle - half) / (1.0 + Z * Z / n), (middle + half) / (1.0 + Z * Z / n)]
    }
}

/// The repeats of all runs.
pub fn of_all<'a>(tracks: impl Iterator<Item = &'a Track>) -> Repeats {
    tracks.fold(Repeats::default(), |all, track| all.and(&track.repeats))
}

/// The largest share of readings that repeat the one before: 99.9 % bound of a Poisson count; 1 where too few were read on the move.
pub fn most(tracks: &[Track]) -> f64 {
    let moving = of_all(tracks.iter()).moving as f64;
    // What was held has been taken out.
    let left = of_all(tracks.iter().filter(|track| !track.repeats.are_held())).held as f64;
    let bound = left + 3.1 * left.sqrt() + 7.0;
    if bound < moving { bound / moving } else { 1.0 }
}

/// Whether the shaft turns by this much (rad) a sample, over so many samples on either side of a reading; of fewer where the run ends.
fn turns(angle: &[f64], i: usize, half: usize, least: f64) -> bool {
    let (first, last) = (i.saturating_sub(half), (i + half).min(angle.len() - 1));
    let turned = (angle[last] - angle[first]).abs();
    turned > least * (last - first) as f64
}

/// Whether a shaft whose reading is held from a place on turned on meanwhile: it moves before and after, and has got as far as that makes. One
/// that stands still for a sample or starts late has not.
fn goes_on(angle: &[f64], first: usize, surely: f64) -> bool {
    let Some(after) = (first + 1..angle.len()).find(|&i| !are_equal(&angle[i - 1..=i])) else { return false };
    if first < 2 || after + 1 >= angle.len() {
        return false;
    }
    let (before, jump, on) =
        (angle[first - 1] - angle[first - 2], angle[after] - angle[after - 1], angle[after + 1] - angle[after]);
    let side = before.signum();
    let moves = side * on > surely && before.abs() > surely;
    moves && side * jump > ((after - first) as f64 + 0.5) * before.abs().max(on.abs())
}

/// Whether all readings around one are equal to it.
fn all_equal(angle: &[f64], i: usize) -> bool {
    let (first, last) = (i.saturating_sub(AROUND.1), (i + AROUND.1).min(angle.len() - 1));
    angle[first..=last].windows(2).all(are_equal)
}

/// What two readings differ by at least, if they do, rad; 0 where there are no two.
fn least_step(angle: &[f64]) -> f64 {
    let steps = angle.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > EQUAL);
    Some(steps.fold(f64::INFINITY, f64::min)).filter(|step| step.is_finite()).unwrap_or(0.0)
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

    #[test]
    fn a_moving_shaft_repeats_no_reading_by_chance() {
        let found = Repeats::of(&swing(0.0, 1));
        assert!(found.held == 0 && found.moving > 1000, "{found:?}");
    }

    #[test]
    fn held_readings_are_counted() {
        let found = Repeats::of(&swing(0.1, 1));
        let [share, low, high] = found.share();
        assert!(found.are_held() && low < 0.1 && 0.1 < high && high - low < 0.05, "{share} ({low} … {high})");
        assert!(found.stale.len() >= found.held, "{found:?}");
    }

    /// A shaft that stops for some samples and goes on, read by a coarse sensor: readings are equal because it stood.
    #[test]
    fn a_shaft_that_stands_still_for_a_moment_holds_no_reading() {
        let step = std::f64::consts::TAU / 1024.0;
        let mut angle = 0.0;
        let stops = (0..4000).map(|i| {
            angle += if i % 60 < 2 { 0.0 } else { 0.1 * (0.004 * f64::from(i)).sin() };
            (angle / step).round() * step
        });
        let found = Repeats::of(&stops.collect::<Vec<f64>>());
        assert!(found.held > 50 && !found.are_held(), "{found:?}");
    }

    #[test]
    fn a_sensor_that_is_read_more_often_than_it_measures_is_counted() {
        let found = Repeats::of(&swing(0.0, 8));
        assert!((found.share()[0] - 0.875).abs() < 0.02 && !found.are_held(), "{found:?}");
    }

    #[test]
    fn readings_at_rest_say_nothing() {
        assert_eq!(Repeats::of(&[0.5; 1000]), Repeats::default());
    }
}
