//! Phase polynomial, straight line and harmonics of the sensor, fitted together with a robust loss.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::phase::{PHASE_DEGREE, Ramp, Reading};
use common::{median, wrap};

/// Tukey's biweight rejects residuals beyond this many standard deviations (95 % efficiency for Gaussian noise).
const TUKEY: f64 = 4.685;
/// Noise of a reading before it is known, rad.
const START_SIGMA: f64 = 0.02;
/// Rounds of reweighting.
const ROUNDS: usize = 8;
/// Rounds of moving the fitted slope into the line whose angle the harmonics are functions of.
const PASSES: usize = 3;
/// Harmonics: as many as `control::sensor` evaluates.
const HARMONICS: usize = 6;
/// Expected before any data: standard deviation of the slope's relative error (converters differ by a few percent).
const SLOPE_EXPECTED: f64 = 0.03;
/// The same for the first two harmonics, the potentiometer's own, rad; the higher ones stand for the converter's integral
/// nonlinearity and are expected to be as large as the robot file says.
///
/// The data outweigh this by far wherever they say anything; but with the blind arc missing from the turn, slope and
/// harmonics can grow against each other, and this keeps them small.
const LINEARITY_EXPECTED: f64 = 0.06;

/// `φ = zero + per_code·straightened code`, `angle = φ + Σ_k (cos_k cos kφ + sin_k sin kφ)`; rad.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    pub zero: f64,
    pub per_code: f64,
    pub cos: Vec<f64>,
    pub sin: Vec<f64>,
}

impl Curve {
    /// A straight line.
    pub fn line(zero: f64, per_code: f64) -> Self {
        Self { zero, per_code, cos: Vec::new(), sin: Vec::new() }
    }

    /// Angle of a straightened code, rad, not wrapped.
    pub fn angle(&self, code: f64) -> f64 {
        let straight = self.zero + self.per_code * code;
        straight + self.error(straight)
    }

    fn error(&self, straight: f64) -> f64 {
        let harmonic = |k: usize| ((k + 1) as f64 * straight).sin_cos();
        let pairs = self.cos.iter().zip(&self.sin).enumerate();
        pairs.map(|(k, (cos, sin))| cos * harmonic(k).1 + sin * harmonic(k).0).sum()
    }

    /// The same sensor with every angle larger by `shift`: the harmonics turn along.
    pub fn shifted(&self, shift: f64) -> Self {
        let mut turned = self.clone();
        turned.zero += shift;
        for (k, (cos, sin)) in turned.cos.iter_mut().zip(&mut turned.sin).enumerate() {
            let (s, c) = ((k + 1) as f64 * shift).sin_cos();
            (*cos, *sin) = (*cos * c - *sin * s, *cos * s + *sin * c);
        }
        turned
    }
}

/// A fitted sensor.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub curve: Curve,
    pub ramp: Ramp,
    /// Robust standard deviation of one sample's residual, rad.
    pub sigma: f64,
    /// RMS over the samples of the curve's own standard error, rad.
    pub standard_error: f64,
}

/// Fits line and harmonics. `nonlinearity` is the expected size of an amplitude beyond the second, rad. `None` where the samples do not determine them.
pub(super) fn fit(readings: &[Reading], ramp: &Ramp, line: &Curve, nonlinearity: f64) -> Option<Fit> {
    let harmonics = HARMONICS;
    let mut state = Curve { cos: vec![0.0; harmonics], sin: vec![0.0; harmonics], ..line.clone() };
    let mut ramp = ramp.clone();
    let mut weights = vec![1.0; readings.len()];
    let mut solved = None;
    let mut sigma = START_SIGMA;
    for _ in 0..PASSES {
        let system = System::new(readings, &ramp, &state, (line.per_code / state.per_code) - 1.0);
        for _ in 0..ROUNDS {
            let solution = system.solve(&weights, sigma, nonlinearity)?;
            sigma = solution.sigma;
            weights = solution.weights(&system);
            solved = Some(solution);
        }
        let solution = solved.as_ref()?;
        let x = &solution.x;
        ramp.coefficients = x.rows(0, PHASE_DEGREE + 1).iter().copied().collect();
        // The slope becomes part of the line; its pivot is the middle of the turn.
        let slope = x[PHASE_DEGREE + 1];
        let pivot = system.pivot;
        state.zero += slope * (state.zero - pivot);
        state.per_code *= 1.0 + slope;
        for k in 0..harmonics {
            state.cos[k] = x[PHASE_DEGREE + 2 + 2 * k];
            state.sin[k] = x[PHASE_DEGREE + 3 + 2 * k];
        }
    }
    let solution = solved?;
    let n: f64 = weights.iter().filter(|&&w| w > 0.0).count() as f64;
    let parameters = solution.x.len() as f64;
    if n < 4.0 * parameters {
        return None;
    }
    Some(Fit { curve: state, ramp, sigma: solution.sigma, standard_error: solution.standard_error })
}

/// `reading + slope·(reading − pivot) + Σ harmonics(reading) = Σ c_j x^j`, linear in all unknowns: the right-hand side
/// is moved to the left, so that one row is `[x^j …, −(reading − pivot), −cos kφ, −sin kφ …]·unknowns = reading`.
struct System {
    rows: DMatrix<f64>,
    readings: DVector<f64>,
    pivot: f64,
    /// The slope's change that would bring the nominal line back.
    slope_expected: f64,
}

struct Solution {
    x: DVector<f64>,
    sigma: f64,
    standard_error: f64,
}

impl System {
    fn new(readings: &[Reading], ramp: &Ramp, curve: &Curve, slope_expected: f64) -> Self {
        let harmonics = HARMONICS;
        let columns = PHASE_DEGREE + 2 + 2 * harmonics;
        let mut rows = DMatrix::zeros(readings.len(), columns);
        let mut right = DVector::zeros(readings.len());
        let pivot = std::f64::consts::PI;
        for (i, reading) in readings.iter().enumerate() {
            let straight = curve.zero + curve.per_code * reading.straightened;
            let x = ramp.x(reading.t);
            let mut power = 1.0;
            for j in 0..=PHASE_DEGREE {
                rows[(i, j)] = power;
                power *= x;
            }
            rows[(i, PHASE_DEGREE + 1)] = -(straight - pivot);
            for k in 0..harmonics {
                let (sin, cos) = ((k + 1) as f64 * straight).sin_cos();
                rows[(i, PHASE_DEGREE + 2 + 2 * k)] = -cos;
                rows[(i, PHASE_DEGREE + 3 + 2 * k)] = -sin;
            }
            let turns = ((ramp.angle(reading.t) - reading.nominal) / TAU).round();
            right[i] = straight + TAU * turns;
        }
        Self { rows, readings: right, pivot, slope_expected }
    }

    fn solve(&self, weights: &[f64], sigma: f64, nonlinearity: f64) -> Option<Solution> {
        let mut weighted = self.rows.clone();
        for (mut row, &weight) in weighted.row_iter_mut().zip(weights) {
            row *= weight;
        }
        let mut normal = weighted.transpose() * &self.rows;
        let mut right = weighted.transpose() * &self.readings;
        // What is expected, as one more observation each.
        let slope = PHASE_DEGREE + 1;
        let weight = (sigma / SLOPE_EXPECTED).powi(2);
        normal[(slope, slope)] += weight;
        right[slope] += weight * self.slope_expected;
        for k in 0..HARMONICS {
            let expected = if k < 2 { LINEARITY_EXPECTED } else { nonlinearity };
            for column in [slope + 1 + 2 * k, slope + 2 + 2 * k] {
                normal[(column, column)] += (sigma / expected).powi(2);
            }
        }
        let factor = normal.cholesky()?;
        let x = factor.solve(&right);
        let mut magnitudes: Vec<f64> = (&self.rows * &x - &self.readings).iter().map(|r| r.abs()).collect();
        let sigma = (median(&mut magnitudes).unwrap_or(f64::NAN) / 0.6745).max(1e-9);
        // Mean of a·C·aᵀ over the rows is trace(C·AᵀA)/n, of the sensor's columns alone and about their means: a constant
        // is a matter of the zero.
        let inverse = factor.inverse();
        let own = PHASE_DEGREE + 1;
        let size = self.rows.ncols() - own;
        let total: f64 = weights.iter().sum();
        let means = weighted.columns(own, size).row_sum() / total;
        let gram =
            weighted.columns(own, size).transpose() * self.rows.columns(own, size) - means.transpose() * &means * total;
        let variance = sigma * sigma * (inverse.view((own, own), (size, size)) * gram).trace() / total;
        Some(Solution { x, sigma, standard_error: variance.max(0.0).sqrt() })
    }
}

impl Solution {
    fn weights(&self, system: &System) -> Vec<f64> {
        let reach = TUKEY * self.sigma;
        (&system.rows * &self.x - &system.readings)
            .iter()
            .map(|r| {
                let u = r / reach;
                if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
            })
            .collect()
    }
}

/// What the curve leaves of a reading, rad, −π … π: curve minus the shaft's angle.
pub(super) fn residual(curve: &Curve, ramp: &Ramp, reading: &Reading) -> f64 {
    wrap(curve.angle(reading.straightened) - ramp.angle(reading.t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shifted_curve_reads_the_same_sensor_with_another_zero() {
        let curve = Curve { zero: 0.3, per_code: 1.4e-3, cos: vec![0.05, -0.02, 0.01], sin: vec![-0.04, 0.03, 0.02] };
        let shifted = curve.shifted(0.7);
        for code in (0..4096).step_by(64) {
            let code = f64::from(code);
            assert!((shifted.angle(code) - curve.angle(code) - 0.7).abs() < 1e-12, "code {code}");
        }
    }
}
