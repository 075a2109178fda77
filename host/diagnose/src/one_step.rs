//! Where one step of the linear model about a fit puts further numbers, and how well the data know them there.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::fit::{self, Columns, Data, Fit};
use super::normal_equations;
use super::rollout::Rolled;

/// Standard deviation that a further number has where the data say nothing of it, in its own unit.
const DEVIATION: f64 = 10.0;

/// Estimates the numbers of some columns (places among `columns` after the starts' two and the fit's numbers), together with the
/// fit's own numbers and starts. The covariance is from the curvature and from the scatter of the scores of whole blocks *after*
/// the step (H. White, Econometrica 50, 1982), so that what the step explains is no scatter.
#[must_use]
pub fn one_step(
    data: &Data,
    fit: &Fit,
    rolled: &[Rolled],
    columns: &[Columns],
    own: &Range<usize>,
    block_rollouts: &dyn Fn(usize) -> usize,
) -> (DVector<f64>, DMatrix<f64>) {
    let (numbers, size) = (fit.free.len(), fit.free.len() + own.len());
    let columns: Vec<Columns> =
        columns.iter().map(|all| [&all[..2 + numbers], &all[2 + own.start..2 + own.end]].concat()).collect();
    let squares = fit::squares(data, rolled);
    let mut held = DVector::from_element(size, fit::misfit(data, squares) * DEVIATION.powi(-2));
    let mut pull = DVector::zeros(size);
    for (i, (curvature, towards)) in fit::prior_equations(data, squares, fit).into_iter().enumerate() {
        (held[i], pull[i]) = (curvature, towards);
    }
    let held = DMatrix::from_diagonal(&held);
    let mut matrix = held.clone();
    let mut total = pull;
    for equations in normal_equations::of_tracks(data, rolled, &columns) {
        matrix += equations.matrix;
        total = equations.gradients.iter().fold(total, |total, one| total + one);
    }
    for i in 0..size {
        matrix[(i, i)] *= 1.0 + 1e-9;
    }
    let Some(factor) = matrix.cholesky() else {
        return (DVector::zeros(own.len()), DMatrix::from_diagonal_element(own.len(), own.len(), DEVIATION.powi(2)));
    };
    let step = factor.solve(&total);
    let stepped: Vec<Rolled> =
        rolled.iter().zip(&columns).map(|(rolled, columns)| after(rolled, &columns[2..], &step)).collect();
    let mut meat = held;
    for (index, equations) in normal_equations::of_tracks(data, &stepped, &columns).iter().enumerate() {
        for block in equations.gradients.chunks(block_rollouts(index)) {
            let score: DVector<f64> = block.iter().sum();
            meat += &score * score.transpose();
        }
    }
    let inverse = factor.inverse();
    let covariance = &inverse * meat * &inverse;
    (
        step.rows(numbers, own.len()).into_owned(),
        covariance.view((numbers, numbers), (own.len(), own.len())).into_owned(),
    )
}

/// What the linear model makes of rollouts after a step of the numbers.
fn after(rolled: &Rolled, columns: &[(Vec<f64>, Vec<f64>)], step: &DVector<f64>) -> Rolled {
    let mut out = rolled.clone();
    for ((readings, currents), step) in columns.iter().zip(step) {
        for (value, slope) in out.readings.iter_mut().zip(readings) {
            *value += step * slope;
        }
        for (value, slope) in out.currents.iter_mut().zip(currents) {
            *value += step * slope;
        }
    }
    out
}
