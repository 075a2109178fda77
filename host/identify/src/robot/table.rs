//! What was measured: means over the repeats of each condition, and how far repeats scatter.

use nalgebra::DVector;
use sweep::{Component, Measured};

use super::RobotError;

/// Fewer conditions cannot be split.
const FEWEST: usize = 4;
/// Without repeats, a mean is taken to scatter by this share of the largest.
const UNREPEATED: f64 = 0.05;
/// A speed is never better known than this share of the largest: phases, steps and windows differ.
const BEST: f64 = 0.01;
/// Of the held-out conditions, one in so many.
const ONE_IN: usize = 4;

/// Which conditions are held out.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Held {
    /// One in four, spread over frequencies and α.
    #[default]
    OneInFour,
    /// These (f in Hz, α in degrees).
    These(Vec<(f64, f64)>),
    /// None.
    None,
}

impl Held {
    /// Conditions that were named (f in Hz, α in degrees), if they were measured and leave enough to fit; one in four where none is.
    ///
    /// # Errors
    /// One was not measured, or too few are left.
    pub fn named(named: &[(f64, f64)], measured: &Measured) -> Result<Self, RobotError> {
        let there = measured.conditions();
        if let Some(&(f_hz, alpha_deg)) = named.iter().find(|one| !there.contains(one)) {
            return Err(RobotError::NotMeasured { f_hz, alpha_deg });
        }
        match named {
            [] => Ok(Self::OneInFour),
            some if some.len() + 3 >= there.len() => Err(RobotError::TooFewLeft),
            some => Ok(Self::These(some.to_vec())),
        }
    }
}

/// Means and scatter of each condition.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// (f in Hz, positive clockwise; α in degrees).
    pub conditions: Vec<(f64, f64)>,
    /// Longitudinal and lateral, mm/s, and yaw, °/s; none where it was not measured.
    pub means: Vec<[Option<f64>; 3]>,
    /// Deviation of each mean.
    pub deviations: Vec<[f64; 3]>,
    /// Deviation of one repeat, pooled over the conditions; none without repeats.
    pub scatter: [Option<f64>; 3],
    /// Degrees of freedom from which that is known, of all three together.
    freedom: usize,
    /// Largest size of each speed.
    pub largest: [f64; 3],
    /// Repeats of a condition, on average.
    repeats: f64,
    /// Whether a condition is held out.
    pub held_out: Vec<bool>,
}

impl Table {
    /// Deviation of a mean over as many repeats as the conditions have on average; none without repeats.
    pub fn scatter_of_mean(&self, part: usize) -> Option<f64> {
        self.scatter[part].map(|scatter| scatter / self.repeats.sqrt())
    }

    /// Degrees of freedom from which the repeats' scatter is known; none without repeats.
    #[must_use]
    pub fn repeated(&self) -> Option<usize> {
        Some(self.freedom).filter(|freedom| *freedom > 0)
    }

    /// Deviations of simulated speeds (condition after condition) from the means, in units of what those are known to, with condition and
    /// speed.
    pub fn deviations<'a>(&'a self, speeds: &'a [f64]) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
        let places = (0..self.means.len()).flat_map(|k| (0..3).map(move |part| (k, part)));
        places.filter_map(move |(k, part)| {
            Some((k, part, (speeds[3 * k + part] - self.means[k][part]?) / self.deviations[k][part]))
        })
    }

    /// Those of the means that are held out, or of those that are fitted.
    #[must_use]
    pub fn deviations_where(&self, speeds: &[f64], held_out: bool) -> DVector<f64> {
        let some = self.deviations(speeds).filter(|(k, ..)| self.held_out[*k] == held_out);
        DVector::from_vec(some.map(|(.., deviation)| deviation).collect())
    }

    /// How many means are fitted.
    pub fn fitted(&self) -> usize {
        let fitted = self.means.iter().zip(&self.held_out).filter(|(_, held_out)| !**held_out);
        fitted.flat_map(|(means, _)| means).flatten().count()
    }

    /// Of measured runs.
    ///
    /// # Errors
    /// There are too few conditions.
    pub fn new(measured: &Measured, held: &Held) -> Result<Self, RobotError> {
        let mut conditions = measured.conditions();
        conditions.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
        if conditions.len() < FEWEST {
            return Err(RobotError::TooFew { conditions: conditions.len(), least: FEWEST });
        }
        let stats: Vec<_> =
            conditions.iter().map(|(f, alpha)| Component::ALL.map(|one| measured.repeats(*f, *alpha, one))).collect();
        let largest = Component::ALL.map(|one| measured.largest(one).max(f64::MIN_POSITIVE));
        let scatter = [0, 1, 2].map(|k| {
            let repeated = stats.iter().filter(|stats| stats[k].1 > 1);
            let (sum, freedom) = repeated.fold((0.0, 0.0), |(sum, freedom), stats| {
                let (stat, count) = &stats[k];
                let own = (*count - 1) as f64;
                (sum + own * stat.spread.unwrap_or(0.0).powi(2), freedom + own)
            });
            (freedom > 0.0).then(|| (sum / freedom).sqrt())
        });
        let deviation = |k: usize, count: usize| {
            let own = scatter[k].map_or(UNREPEATED * largest[k], |scatter| scatter / (count.max(1) as f64).sqrt());
            own.hypot(BEST * largest[k])
        };
        Ok(Self {
            means: stats.iter().map(|stats| [0, 1, 2].map(|k| stats[k].0.mean)).collect(),
            deviations: stats.iter().map(|stats| [0, 1, 2].map(|k| deviation(k, stats[k].1))).collect(),
            held_out: held_out(&conditions, held),
            repeats: stats.iter().flatten().map(|(_, count)| *count as f64).sum::<f64>() / (3 * stats.len()) as f64,
            freedom: stats.iter().flatten().map(|(_, count)| count.saturating_sub(1)).sum(),
            conditions,
            scatter,
            largest,
        })
    }
}

/// Conditions stand by α, then f: from row to row another frequency.
fn held_out(conditions: &[(f64, f64)], held: &Held) -> Vec<bool> {
    match held {
        Held::None => vec![false; conditions.len()],
        Held::OneInFour => {
            let rows = conditions.chunk_by(|a, b| a.1 == b.1).enumerate();
            rows.flat_map(|(row, some)| (0..some.len()).map(move |place| (place + row) % ONE_IN == 1)).collect()
        }
        Held::These(these) => conditions.iter().map(|one| these.contains(one)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_in_four_is_held_out_of_every_frequency_and_angle_in_turn() {
        for frequencies in [3, 6] {
            let conditions: Vec<(f64, f64)> =
                (0..4 * frequencies).map(|k| (f64::from(k % frequencies), f64::from(k / frequencies))).collect();
            let held = held_out(&conditions, &Held::OneInFour);
            assert_eq!(held.iter().filter(|held| **held).count(), frequencies as usize);
            let mut of: Vec<f64> =
                conditions.iter().zip(&held).filter(|(_, held)| **held).map(|(one, _)| one.0).collect();
            of.sort_by(f64::total_cmp);
            of.dedup();
            assert_eq!(of.len(), frequencies as usize, "each frequency once");
        }
    }

    #[test]
    fn scatter_is_pooled_over_the_conditions() {
        let run = |f: f64, vx: f64| ((f, 0.0), [Some(vx), None, Some(1.0)]);
        let runs = [run(6.0, 9.0), run(6.0, 11.0), run(7.0, 20.0), run(7.0, 20.0), run(8.0, 1.0), run(9.0, 2.0)];
        let table = Table::new(&Measured::of_runs(runs), &Held::None).unwrap();
        // Of two pairs that are 2 and 0 apart: variances 2 and 0.
        assert!((table.scatter[0].unwrap() - 1.0).abs() < 1e-12, "{:?}", table.scatter);
        assert_eq!((table.scatter[1], table.fitted()), (None, 8));
        let of_mean = 0.5f64.sqrt().hypot(0.2);
        assert!((table.deviations[0][0] - of_mean).abs() < 1e-12, "{:?}", table.deviations[0]);
        assert!(matches!(Table::new(&Measured::of_runs([run(6.0, 1.0)]), &Held::None), Err(RobotError::TooFew { .. })));
    }
}
