//! How sure a comparison on the held-out rollouts is: a block bootstrap, the same resamples for every model.

use rand::{RngExt, SeedableRng};

/// Rollouts that follow each other are resampled together: what is wrong in one is mostly wrong in the next.
const BLOCK: usize = 4;
/// Resamples.
const RESAMPLES: usize = 600;

/// Resamples of the held-out rollouts.
pub struct Bootstrap {
    /// How often each rollout occurs in each resample.
    counts: Vec<Vec<f64>>,
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
        Self { counts }
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
