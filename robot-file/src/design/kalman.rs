//! Steady state of the Kalman filter on [θ, ω, i, τ], and how its covariance grows through the blind arc.

use control::parameters::Tuning;
use nalgebra::{DMatrix, DVector, RowDVector};

use super::model::Discrete;
use super::riccati::{RiccatiError, solve};

/// The filter in the reliable zone after a long time.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// Gain on the innovation: rad, rad/s, A and N·m per rad.
    pub gain: DVector<f64>,
    /// Covariance before a reading.
    pub predicted: DMatrix<f64>,
    /// Covariance after it.
    pub corrected: DMatrix<f64>,
    /// Transition with the drag.
    pub phi: DMatrix<f64>,
    /// Covariance of a tick's disturbance.
    pub disturbance: DMatrix<f64>,
    /// What a reading is of the state: `[1, −age, 0, 0]`.
    pub reading: RowDVector<f64>,
    /// Relative residual of the Riccati equation.
    pub residual: f64,
}

/// Solves the filter's Riccati equation for a tuning and readings of an age (s); `scale` is what counts as one unit of each
/// state.
pub(super) fn steady(
    model: &Discrete,
    tuning: &Tuning,
    age: f64,
    scale: &DVector<f64>,
) -> Result<Filter, RiccatiError> {
    let phi = model.with_drag();
    let disturbance = disturbance(tuning, model.period);
    let noise = f64::from(tuning.reading).powi(2);
    let d = DMatrix::from_diagonal(scale);
    let inverse = DMatrix::from_diagonal(&scale.map(|value| 1.0 / value));
    let reading = RowDVector::from_row_slice(&[1.0, -age, 0.0, 0.0]);
    let dual = solve(
        &(&inverse * &phi * &d).transpose(),
        &DMatrix::from_row_slice(4, 1, (&reading * &d).as_slice()),
        &(&inverse * &disturbance * &inverse),
        &DMatrix::from_element(1, 1, noise),
    )?;
    let predicted = &d * dual.x * &d;
    let column: DVector<f64> = &predicted * reading.transpose();
    let gain = &column / (reading.transpose().dot(&column) + noise);
    let corrected = &predicted - &gain * column.transpose();
    Ok(Filter { gain, predicted, corrected, phi, disturbance, reading, residual: dual.residual })
}

/// Covariance of a tick's disturbance on [θ, ω, i, τ]: a speed change spread over the tick, and the drag's drift.
fn disturbance(tuning: &Tuning, period: f64) -> DMatrix<f64> {
    let shape = DVector::from_row_slice(&[0.5 * period, 1.0, 0.0, 0.0]) * f64::from(tuning.speed);
    let mut q = &shape * shape.transpose();
    q[(3, 3)] = f64::from(tuning.drag).powi(2);
    q
}

impl Filter {
    /// Standard deviation of the angle, rad, after `ticks` without a reading.
    #[must_use]
    pub fn blind_angle(&self, ticks: usize) -> f64 {
        let mut p = self.corrected.clone();
        for _ in 0..ticks {
            p = &self.phi * p * self.phi.transpose() + &self.disturbance;
        }
        p[(0, 0)].sqrt()
    }

    /// What a reading leaves of the state's error, `I − L C`.
    #[must_use]
    pub fn keep(&self) -> DMatrix<f64> {
        DMatrix::identity(4, 4) - &self.gain * &self.reading
    }

    /// State matrix of the estimation error, `(I − L C) Φ`.
    #[must_use]
    pub fn error_dynamics(&self) -> DMatrix<f64> {
        self.keep() * &self.phi
    }
}
