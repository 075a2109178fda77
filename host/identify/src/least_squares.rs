//! Levenberg's and Marquardt's method for residuals that a simulation gives.
//!
//! K. Levenberg, "A method for the solution of certain non-linear problems in least squares", 1944; D. W. Marquardt, "An
//! algorithm for least-squares estimation of nonlinear parameters", 1963. Every parameter is scaled so that a step of 1 is a
//! large one.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What is minimised: half the square of the residuals.
pub trait Residuals {
    /// Whether derivatives are estimates, of which a second one at the same place may be better.
    const ESTIMATED: bool = false;
    /// A step that gains less than this share of the cost is the last.
    const ENOUGH: f64 = 1e-6;
    /// At a point; `None` where nothing can be simulated there.
    fn at(&mut self, point: &DVector<f64>) -> Option<DVector<f64>>;
    /// Their derivatives at a point (a column a parameter), where they are known to be these.
    fn derivatives(&mut self, point: &DVector<f64>, residuals: &DVector<f64>) -> Option<DMatrix<f64>>;
}

/// A minimum.
pub struct Minimum {
    /// Where it is.
    pub point: DVector<f64>,
    /// Residuals there.
    pub residuals: DVector<f64>,
    /// Their derivatives there.
    pub derivatives: DMatrix<f64>,
}

/// Marquardt's factor at the start, and beyond which there is no way down.
const MARQUARDT: (f64, f64) = (1e-3, 1e6);

/// The minimum near a point, after at most `most_steps` steps; `None` where nothing can be simulated at the start.
pub fn minimise<R: Residuals>(residuals: &mut R, start: DVector<f64>, most_steps: usize) -> Option<Minimum> {
    let mut point = start;
    let mut here = residuals.at(&point)?;
    let mut derivatives = residuals.derivatives(&point, &here)?;
    let (mut factor, mut stuck) = (MARQUARDT.0, false);
    for _ in 0..most_steps {
        let normal = derivatives.tr_mul(&derivatives);
        let gradient = derivatives.tr_mul(&here);
        let cost = here.norm_squared();
        let mut gain = None;
        while factor < MARQUARDT.1 {
            let mut damped = normal.clone();
            for k in 0..damped.nrows() {
                damped[(k, k)] = damped[(k, k)] * (1.0 + factor) + 1e-12;
            }
            let trial = Cholesky::new(damped).map(|factors| &point - factors.solve(&gradient));
            let there = trial.and_then(|trial| Some((residuals.at(&trial)?, trial)));
            if let Some((there, trial)) = there.filter(|(there, _)| there.norm_squared() < cost) {
                gain = Some(1.0 - there.norm_squared() / cost);
                (here, point) = (there, trial);
                factor = (0.2 * factor).max(1e-9);
                break;
            }
            factor *= 5.0;
        }
        if gain.is_none() && (stuck || !R::ESTIMATED) {
            break;
        }
        stuck = gain.is_none();
        if stuck {
            factor = MARQUARDT.0;
        }
        derivatives = residuals.derivatives(&point, &here)?;
        if gain.is_some_and(|gain| gain < R::ENOUGH) {
            break;
        }
    }
    Some(Minimum { point, residuals: here, derivatives })
}

impl Minimum {
    /// Covariance of the parameters for residuals of variance 1; `None` where the data say nothing of one of them.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let normal: DMatrix<f64> = self.derivatives.tr_mul(&self.derivatives);
        Cholesky::<f64, Dyn>::new(normal).map(|factors| factors.inverse())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley: residuals 10 (y − x²) and 1 − x.
    struct Valley;

    impl Residuals for Valley {
        fn at(&mut self, point: &DVector<f64>) -> Option<DVector<f64>> {
            let (x, y) = (point[0], point[1]);
            (x < 1.5).then(|| DVector::from_vec(vec![10.0 * (y - x * x), 1.0 - x]))
        }

        fn derivatives(&mut self, point: &DVector<f64>, _: &DVector<f64>) -> Option<DMatrix<f64>> {
            Some(DMatrix::from_row_slice(2, 2, &[-20.0 * point[0], 10.0, -1.0, 0.0]))
        }
    }

    #[test]
    fn it_goes_down_a_bent_valley() {
        let found = minimise(&mut Valley, DVector::from_vec(vec![-1.2, 1.0]), 100).unwrap();
        assert!((found.point[0] - 1.0).abs() < 1e-4 && (found.point[1] - 1.0).abs() < 1e-4, "{}", found.point);
        // (JᵀJ)⁻¹ at the bottom, by hand: J = [[−20, 10], [−1, 0]].
        let covariance = found.covariance().unwrap();
        assert!((covariance[(0, 0)] - 1.0).abs() < 1e-3 && (covariance[(1, 1)] - 4.01).abs() < 1e-2, "{covariance}");
        assert!(minimise(&mut Valley, DVector::from_vec(vec![2.0, 1.0]), 100).is_none(), "nothing there");
    }
}
