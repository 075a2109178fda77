//! The models that held-out runs cannot tell from the best one: a model confidence set.
//!
//! Of several models one is the best, and which it is the runs say only with some error. The set holds it with a stated
//! probability: all models are taken for equally good; where that is refused, the worst goes, until it is not refused any more (P. R.
//! Hansen, A. Lunde, J. M. Nason, "The model confidence set", Econometrica 79, 2011, with the range statistic `T_R` and the block
//! bootstrap of its section 3, at the level of its own examples). Eliminations are no separate tests that add up: the set is right as
//! often as one of them is.

/// The set misses the best model this often.
pub const ERROR: f64 = 0.1;

/// Places of the models that stay. `means`: of each model, its mean loss; `resampled`: the same in each bootstrap resample, the same
/// resamples for all.
#[must_use]
pub fn of(means: &[f64], resampled: &[Vec<f64>]) -> Vec<usize> {
    let mut set: Vec<usize> = (0..means.len()).collect();
    while set.len() > 1 {
        let (worst, chance) = worst_of(&set, means, resampled);
        if chance >= ERROR {
            break;
        }
        set.remove(worst);
    }
    set
}

/// Which of a set is worst beside another one, in units of the scatter of their difference; and how often chance sets two of equals
/// as far apart.
fn worst_of(set: &[usize], means: &[f64], resampled: &[Vec<f64>]) -> (usize, f64) {
    let resamples = resampled.first().map_or(0, Vec::len);
    let mut largest = vec![0.0f64; resamples];
    let (mut worst, mut found) = (0, f64::NEG_INFINITY);
    for (place, &one) in set.iter().enumerate() {
        for (other_place, &other) in set.iter().enumerate().skip(place + 1) {
            let behind = means[one] - means[other];
            // How far each resample has the difference off what it is.
            let off: Vec<f64> = (0..resamples).map(|r| resampled[one][r] - resampled[other][r] - behind).collect();
            let square = off.iter().map(|one| one * one).sum::<f64>() / resamples.max(1) as f64;
            let deviation = square.sqrt().max(f64::MIN_POSITIVE);
            for (largest, off) in largest.iter_mut().zip(&off) {
                *largest = largest.max((off / deviation).abs());
            }
            if behind.abs() / deviation > found {
                found = behind.abs() / deviation;
                worst = if behind > 0.0 { place } else { other_place };
            }
        }
    }
    let as_far = largest.iter().filter(|largest| **largest >= found).count();
    (worst, (1.0 + as_far as f64) / (1.0 + resamples as f64))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::bootstrap::Bootstrap;
    use super::*;

    /// Losses of models on 240 rollouts: a part that all share, a part of their own, and what each is worse by.
    fn set_of(worse_by: &[f64], seed: u64) -> Vec<usize> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut errors = vec![Vec::new(); worse_by.len()];
        for _ in 0..240 {
            let shared = 1.0 + 0.3 * normal();
            for (errors, worse) in errors.iter_mut().zip(worse_by) {
                errors.push((shared + 0.1 * normal() + worse, 1.0));
            }
        }
        let bootstrap = Bootstrap::new(240, seed);
        let mean = |errors: &Vec<(f64, f64)>| errors.iter().map(|one| one.0).sum::<f64>() / 240.0;
        let means: Vec<f64> = errors.iter().map(mean).collect();
        let resampled: Vec<Vec<f64>> = errors.iter().map(|one| bootstrap.mean_squares(one)).collect();
        of(&means, &resampled)
    }

    #[test]
    fn the_best_model_is_missed_as_seldom_as_it_says() {
        // Four equals: each is a best one.
        let missed = (0..200).filter(|&seed| !set_of(&[0.0; 4], seed).contains(&0)).count();
        // At most 20 expected, standard deviation 4.
        assert!(missed <= 32, "{missed} of 200");
        let shrunk = (0..200).filter(|&seed| set_of(&[0.0; 4], seed).len() < 4).count();
        assert!((3..=45).contains(&shrunk), "{shrunk} of 200");
    }

    #[test]
    fn what_is_clearly_worse_goes_and_what_is_a_trace_worse_stays() {
        let sets: Vec<Vec<usize>> = (0..40).map(|seed| set_of(&[0.0, 0.001, 0.1], seed)).collect();
        assert!(sets.iter().all(|set| !set.contains(&2)), "{sets:?}");
        assert!(sets.iter().filter(|set| set.contains(&1)).count() >= 34, "{sets:?}");
    }

    #[test]
    fn one_model_and_two_that_say_the_same_are_the_set() {
        assert_eq!(of(&[1.0], &[vec![1.0; 10]]), [0]);
        assert_eq!(of(&[1.0, 1.0], &[vec![1.0; 10], vec![1.0; 10]]).len(), 2);
    }
}
