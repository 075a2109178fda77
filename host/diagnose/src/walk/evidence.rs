//! How probable measured speeds are under models of different size.
//!
//! The evidence of a model is the probability of the speeds averaged over what is believed of its numbers, here by Laplace's method
//! about the most probable set (R. E. Kass, A. E. Raftery, "Bayes factors", JASA 90, 1995): a number that may be anything costs a model
//! that does not need it. The mean of the factors by which the effects raise the evidence is an e-value against "the file lacks nothing":
//! on such a robot it passes 1/p in at most a share p of all tables, whatever the number of effects and however alike they are (V. Vovk,
//! R. Wang, "E-values: calibration, combination and applications", Ann. Statist. 49, 2021).

use identify::least_squares::Minimum;
use identify::robot::Numbers;
use nalgebra::Cholesky;
use statrs::distribution::{ContinuousCDF, Normal};

/// log₁₀ of the mean factor at which something is said to be missing: a false alarm in a hundred tables at most.
pub const ALARM: f64 = 2.0;
/// A class of models holds the right one with this probability, if it is among those that were tried.
pub const CLASS: f64 = 0.95;

/// Logarithm of a model's evidence, but for what all models of a table share.
pub fn log_evidence(minimum: &Minimum, numbers: &Numbers) -> Option<f64> {
    let point = &minimum.point;
    let factors = Cholesky::new(minimum.derivatives.tr_mul(&minimum.derivatives))?;
    let half_log_determinant: f64 = factors.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
    let covariance = factors.inverse();
    // The negative of a one-sided number's coordinate is as probable: both hills count, one where they merge.
    let hills = |k: usize| (2.0 * Normal::standard().cdf(point[k].abs() / covariance[(k, k)].sqrt())).ln();
    let one_sided = (0..point.len()).filter(|k| numbers.all[*k].is_one_sided()).map(hills).sum::<f64>();
    Some(-0.5 * minimum.residuals.norm_squared() - half_log_determinant + one_sided)
}

/// log₁₀ of the mean of the factors by which some models raise the evidence of one that they extend, of as many as there could be.
pub fn log10_mean_factor(base: f64, extended: &[f64], tried: usize) -> f64 {
    let most = extended.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = extended.iter().map(|evidence| (evidence - most).exp()).sum();
    (most - base + (sum / tried.max(1) as f64).ln()) / std::f64::consts::LN_10
}

/// Probabilities of models that are as likely as one another before.
pub fn probabilities(evidence: &[f64]) -> Vec<f64> {
    let most = evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = evidence.iter().map(|one| (one - most).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_alike_shares_the_probability() {
        let shares = probabilities(&[-10.0, -10.0, -10.0 - 1e3]);
        assert!((shares[0] - 0.5).abs() < 1e-12 && shares[2] < 1e-12, "{shares:?}");
        // One of four raises the evidence by e³, one not at all; two were not worth a fit.
        let mean = log10_mean_factor(-5.0, &[-2.0, -5.0], 4);
        assert!((mean - ((3f64.exp() + 1.0) / 4.0).log10()).abs() < 1e-9, "{mean}");
        assert!((log10_mean_factor(0.0, &[1e4], 1) - 1e4 / std::f64::consts::LN_10).abs() < 1e-6, "no overflow");
    }
}
