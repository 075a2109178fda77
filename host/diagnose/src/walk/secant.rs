//! Residuals whose derivatives are not simulated again from step to step, but follow from what the last step showed.
//!
//! C. G. Broyden, "A class of methods for solving nonlinear simultaneous equations", Math. Comp. 19, 1965.

use identify::least_squares::Residuals;
use identify::robot::Posterior;
use nalgebra::{DMatrix, DVector};

/// A posterior with derivatives known where a fit begins.
pub struct Secant<'a, 'b> {
    posterior: &'a mut Posterior<'b>,
    derivatives: DMatrix<f64>,
    /// Where the derivatives were updated last, and the residuals there.
    last: Option<(DVector<f64>, DVector<f64>)>,
}

impl<'a, 'b> Secant<'a, 'b> {
    /// From derivatives of its residuals near where a fit begins.
    pub fn new(posterior: &'a mut Posterior<'b>, derivatives: DMatrix<f64>) -> Self {
        Self { posterior, derivatives, last: None }
    }
}

impl Residuals for Secant<'_, '_> {
    const ENOUGH: f64 = 1e-3;

    fn at(&mut self, point: &DVector<f64>) -> Option<DVector<f64>> {
        self.posterior.at(point)
    }

    fn derivatives(&mut self, point: &DVector<f64>, residuals: &DVector<f64>) -> Option<DMatrix<f64>> {
        if let Some((before, there)) = &self.last {
            let moved = point - before;
            let square = moved.norm_squared();
            if square > 0.0 {
                let missed = residuals - there - &self.derivatives * &moved;
                self.derivatives += missed * moved.transpose() / square;
            }
        }
        self.last = Some((point.clone(), residuals.clone()));
        Some(self.derivatives.clone())
    }
}
