//! How sure a comparison on the held-out rollouts is: a block bootstrap, the same resamples for every model.

use rand::{RngExt, SeedableRng};

/// Rollouts that follow each other are resampled together: what is wrong in one is mostly wrong in the next.
const BLOCK: usize = 4;
/// Resamples for the intervals that are reported: 15 of them lie beyond an end of 95 %.
const RESAMPLES: usize = 600;
/// Resamples that decide: of a tail of 0.001 there are 10 beyond its end, not the extreme alone, whose place is mostly chance.
pub(super) const DECIDING: usize = 10_000;

/// Resamples of the held-out rollouts.
pub struct Bootstrap {
    /// How often each rollout occurs in each resample.
    counts: Vec<Vec<f64>>,
    /// Blocks of all [`DECIDING`] resamples, one resample after the other.
    deciding: Vec<u32>,
    /// Blocks in a resample.
    blocks: usize,
}

impl Bootstrap {
    /// For a number of rollouts.
    #[must_use]
    pub fn new(rollouts: usize, seed: u64) -> Self {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed ^ 0x5eed_d1a9_0515);
        let blocks = rollouts.div_ceil(BLOCK);
        let counts = (0..RESAMPLES)
            .map(|_| {
                let mut count = vec![0.0; rollouts];
                for _ in 0..blocks {
                    let first = random.random_range(0..blocks) * BLOCK;
                    count[first..(first + BLOCK).min(rollouts)].iter_mut().for_each(|times| *times += 1.0);
                }
                count
            })
            .collect();
        // After those above, which stay what they are.
        let end = u32::try_from(blocks).unwrap_or(u32::MAX);
        let deciding = (0..DECIDING * blocks).map(|_| random.random_range(0..end)).collect();
        Self { counts, deciding, blocks }
    }

    /// [`Self::mean_squares`] in each of the [`DECIDING`] resamples. Cheap, as the errors of a block are added once.
    #[must_use]
    pub fn deciding_mean_squares(&self, errors: &[(f64, f64)]) -> Vec<f64> {
        let add = |total: (f64, f64), one: &(f64, f64)| (total.0 + one.0, total.1 + one.1);
        let of_block: Vec<(f64, f64)> = errors.chunks(BLOCK).map(|block| block.iter().fold((0.0, 0.0), add)).collect();
        let resamples = self.deciding.chunks_exact(self.blocks.max(1));
        let mean = |resample: &[u32]| {
            let drawn = resample.iter().filter_map(|block| of_block.get(*block as usize));
            let (sum, freedom) = drawn.fold((0.0, 0.0), add);
            sum / freedom.max(1.0)
        };
        resamples.map(mean).collect()
    }

    /// Mean square error of a model in each resample, from the squared error and freedom of each rollout.
    #[must_use]
    pub fn mean_squares(&self, errors: &[(f64, f64)]) -> Vec<f64> {
        self.counts
            .iter()
            .map(|count| {
                let (sum, freedom) = count
                    .iter()
                    .zip(errors)
                    .fold((0.0, 0.0), |total, (times, one)| (total.0 + times * one.0, total.1 + times * one.1));
                sum / freedom.max(1.0)
            })
            .collect()
    }
}

/// The interval that holds all but `2·tail` of the values.
#[must_use]
pub fn interval(mut values: Vec<f64>, tail: f64) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return (f64::NAN, f64::NAN);
    }
    let low = ((n as f64 * tail) as usize).min(n - 1);
    (values[low], values[n - 1 - low])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 320 rollouts with errors from 0 to 2 in the mean square: the mean of 80 independent blocks is normal enough.
    fn errors() -> Vec<(f64, f64)> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        (0..80).flat_map(|_| [(random.random_range(0.0..2.0), 1.0); BLOCK]).collect()
    }

    #[test]
    fn a_tail_of_one_in_a_thousand_is_where_the_normal_distribution_has_it() {
        let errors = errors();
        for seed in 0..10 {
            let means = Bootstrap::new(errors.len(), seed).deciding_mean_squares(&errors);
            let n = means.len() as f64;
            let mean = means.iter().sum::<f64>() / n;
            let deviation = (means.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
            let (low, high) = interval(means, 0.001);
            for end in [(mean - low) / deviation, (high - mean) / deviation] {
                assert!((end - 3.09).abs() < 0.3, "seed {seed}: the end is {end} deviations away");
            }
        }
    }

    #[test]
    fn the_resamples_that_decide_are_those_of_the_intervals_and_more() {
        let errors = errors();
        let bootstrap = Bootstrap::new(errors.len(), 1);
        let spread = |values: Vec<f64>| interval(values, 0.025);
        let (few, many) = (spread(bootstrap.mean_squares(&errors)), spread(bootstrap.deciding_mean_squares(&errors)));
        let width = many.1 - many.0;
        assert!((few.0 - many.0).abs() < 0.1 * width && (few.1 - many.1).abs() < 0.1 * width, "{few:?} {many:?}");
    }

    #[test]
    fn a_tail_is_never_read_from_a_handful_of_resamples() {
        assert!(super::super::selection::TAIL * DECIDING as f64 >= 10.0);
    }

    #[test]
    fn no_rollouts_and_a_part_of_a_block_are_no_error() {
        assert!(Bootstrap::new(0, 1).deciding_mean_squares(&[]).is_empty());
        let means = Bootstrap::new(5, 1).deciding_mean_squares(&[(2.0, 1.0); 5]);
        assert!(means.len() == DECIDING && means.iter().all(|mean| *mean == 2.0));
    }
}
