//! Covariance of a fit's numbers: from the curvature and the scatter of the segments' gradients, also where few segments say
//! what is known of a number.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::fit::WIDE;
use super::normal_equations::SegmentEquations;

/// Standard deviation, in a fit's coordinates, of numbers of which nothing is known: an interval reaches to the bounds.
const UNKNOWN: f64 = 1e3;
/// Of a segment that alone holds a number its residuals say nothing; what they leave of its scatter is taken to be at least this
/// share.
const LEAST_LEFT: f64 = 0.1;
/// Degrees of freedom from which Student's t is the normal distribution, to a thousandth.
const MANY: f64 = 1e3;

/// The sandwich `A⁻¹ (Σ g gᵀ) A⁻¹` over segments, so that it holds for a wrong model too (H. White, Econometrica 50, 1982), with a
/// prior's share, of which no gradient scatters.
///
/// Where few segments hold a number, their gradients at the minimum scatter less than they would at the truth, and the scatter of a
/// few says little: each number's share is divided by what its segments leave of it in expectation, were the model right, and
/// widened so that [`WIDE`] standard deviations reach as far as Student's t with Satterthwaite's degrees of freedom (R. Bell, D.
/// McCaffrey, "Bias reduction in standard errors for linear regression with multi-stage samples", Survey Methodology 28, 2002).
///
/// `matrix` is the curvature with the prior's, `prior` the diagonal of that alone; `misfit` is the mean square error over the noise's:
/// where the model misses the data by more than their noise, the data count for as much less beside the prior, so that a direction that
/// they leave open keeps the prior's width.
#[must_use]
pub fn of<'a>(
    matrix: &DMatrix<f64>,
    prior: &[f64],
    misfit: f64,
    segments: impl Iterator<Item = &'a SegmentEquations> + Clone,
) -> DMatrix<f64> {
    let size = prior.len();
    let mut regular = matrix.clone();
    for i in 0..size {
        regular[(i, i)] = regular[(i, i)] * (1.0 + 1e-9) + 1e-9 * misfit;
    }
    let Some(factor) = regular.cholesky() else {
        // The data and the priors leave a direction open: nothing is known.
        return DMatrix::from_diagonal_element(size, size, UNKNOWN * UNKNOWN);
    };
    let inverse = factor.inverse();
    let meat =
        segments.clone().fold(DMatrix::zeros(size, size), |sum, one| sum + &one.gradient * one.gradient.transpose());
    let prior = DMatrix::from_diagonal(&DVector::from_column_slice(prior)) * misfit;
    let (of_data, of_prior) = (&inverse * meat * &inverse, &inverse * prior * &inverse);
    let few = small_samples(&inverse, of_prior.diagonal().as_slice(), misfit, segments);
    let widening: Vec<f64> = few.iter().map(SmallSample::widening).collect();
    let mut covariance = DMatrix::from_fn(size, size, |i, j| {
        let scatter = of_data[(i, j)] / (few[i].left * few[j].left).sqrt();
        (scatter + of_prior[(i, j)]) * widening[i] * widening[j]
    });
    // Of a number that moves nothing and has no prior, no gradient scatters: that is no knowledge of it.
    for i in (0..size).filter(|&i| matrix[(i, i)] <= 0.0) {
        covariance[(i, i)] = UNKNOWN * UNKNOWN;
    }
    covariance
}

/// What comes of a number's being held by few segments.
struct SmallSample {
    /// Share of its variance that the segments' gradients scatter by at the minimum, in expectation.
    left: f64,
    /// Degrees of freedom of its variance.
    freedom: f64,
}

impl SmallSample {
    /// Student's t beside the normal distribution, at the end of a 95 % interval.
    fn widening(&self) -> f64 {
        if self.freedom >= MANY {
            return 1.0;
        }
        let t = StudentsT::new(0.0, 1.0, self.freedom).map_or(WIDE, |t| t.inverse_cdf(0.975));
        (t / WIDE).max(1.0)
    }
}

/// For each number, were the model right and the noise even.
fn small_samples<'a>(
    inverse: &DMatrix<f64>,
    of_prior: &[f64],
    misfit: f64,
    segments: impl Iterator<Item = &'a SegmentEquations>,
) -> Vec<SmallSample> {
    let mut sums = vec![[0.0; 3]; of_prior.len()];
    for segment in segments {
        let moved = &segment.matrix * inverse;
        for (i, [whole, lost, squares]) in sums.iter_mut().enumerate() {
            let variance = inverse.column(i).dot(&moved.column(i));
            *whole += variance;
            *lost += moved.column(i).dot(&(inverse * moved.column(i)));
            *squares += variance * variance;
        }
    }
    let few = |([whole, lost, squares], of_prior): ([f64; 3], &f64)| {
        let all = misfit * whole + of_prior;
        SmallSample {
            left: if whole > 0.0 { (1.0 - lost / whole).clamp(LEAST_LEFT, 1.0) } else { 1.0 },
            freedom: (all * all / (misfit * misfit * squares).max(f64::MIN_POSITIVE)).clamp(1.0, MANY),
        }
    };
    sums.into_iter().zip(of_prior).map(few).collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::rollout::Normal2;

    /// Two numbers, a level and a slope, and twelve segments of ten readings, of which one in three shows the slope, some of these
    /// better; the readings' noise is 1.
    fn segments(random: &mut rand_pcg::Pcg64Mcg) -> Vec<SegmentEquations> {
        let one = |index: usize| {
            let steepness = [2.0, 0.1, 0.1, 2.0, 0.1, 0.1, 1.5, 0.1, 0.1, 1.5, 0.1, 0.1][index];
            let (mut matrix, mut gradient) = (DMatrix::zeros(2, 2), DVector::zeros(2));
            for reading in 0..10 {
                let row = DVector::from_vec(vec![1.0, steepness * (f64::from(reading) - 4.5)]);
                let noise: f64 = random.sample(StandardNormal);
                matrix += &row * row.transpose();
                gradient += row * noise;
            }
            SegmentEquations { matrix, gradient, start: Normal2::default(), coupling: Vec::new() }
        };
        (0..12).map(one).collect()
    }

    /// How far the fitted slope is off in its own standard deviations: of the sandwich alone, and of [`of`].
    fn off(random: &mut rand_pcg::Pcg64Mcg) -> [f64; 2] {
        let mut segments = segments(random);
        let matrix = segments.iter().fold(DMatrix::zeros(2, 2), |sum, one| sum + &one.matrix);
        let pull: DVector<f64> = segments.iter().map(|one| &one.gradient).sum();
        let inverse = matrix.clone().try_inverse().unwrap();
        let fitted = &inverse * pull;
        for one in &mut segments {
            one.gradient -= &one.matrix * &fitted;
        }
        let meat =
            segments.iter().fold(DMatrix::zeros(2, 2), |sum, one| sum + &one.gradient * one.gradient.transpose());
        let covariances = [&inverse * meat * &inverse, of(&matrix, &[0.0; 2], 1.0, segments.iter())];
        covariances.map(|covariance| fitted[1] / covariance[(1, 1)].sqrt())
    }

    #[test]
    fn an_interval_holds_the_truth_where_few_segments_say_what_is_known() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let all: Vec<[f64; 2]> = (0..4000).map(|_| off(&mut random)).collect();
        let held = |which: usize| all.iter().filter(|off| off[which].abs() < WIDE).count() as f64 / all.len() as f64;
        assert!((0.92..0.97).contains(&held(1)), "{}", held(1));
        // Else the segments would be none to show it with.
        assert!(held(0) < 0.85, "{}", held(0));
    }

    #[test]
    fn where_many_say_the_same_or_the_prior_says_all_it_is_the_sandwich() {
        let one = |i: usize| {
            let gradient = DVector::from_element(1, if i.is_multiple_of(2) { 1.0 } else { -1.0 });
            SegmentEquations {
                matrix: DMatrix::from_element(1, 1, 1.0),
                gradient,
                start: Normal2::default(),
                coupling: Vec::new(),
            }
        };
        let segments: Vec<_> = (0..1000).map(one).collect();
        let many = of(&DMatrix::from_element(1, 1, 1000.0), &[0.0], 1.0, segments.iter())[(0, 0)];
        assert!((many * 1000.0 - 1.0).abs() < 5e-3, "{many}");
        let prior = of(&DMatrix::from_element(1, 1, 1e9), &[1e9], 1.0, segments[..1].iter())[(0, 0)];
        assert!((prior * 1e9 - 1.0).abs() < 5e-3, "{prior}");
    }
}
