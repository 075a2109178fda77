//! An ensemble of sets of numbers that moves towards the measured speeds.
//!
//! A. A. Emerick, A. C. Reynolds, "Ensemble smoother with multiple data assimilation", Computers & Geosciences 55, 2013. In several
//! rounds the whole ensemble is moved along the regression of numbers on speeds over all its members, with the measurements' variances
//! inflated by factors whose inverses add up to 1. Such a regression looks past what single derivatives stumble over: the speeds'
//! roughness, and a gait that jumps as numbers change. Where the members end says how far apart sets of numbers are that do about as
//! well.

use hal_sim::random::Stream;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::RobotError;
use super::posterior::Posterior;
use crate::least_squares::Minimum;

/// More rounds are not made: what is left of the weight goes into the last.
pub const ROUNDS: usize = 8;
/// An ensemble that has lost more of its members to runs that blow up says nothing.
const FEWEST: usize = 10;

/// Members drawn about a minimum, as far as what the speeds told until then leaves open.
pub fn about(minimum: &Minimum, members: usize, draws: &mut Stream) -> Vec<DVector<f64>> {
    let axes = SymmetricEigen::new(minimum.derivatives.tr_mul(&minimum.derivatives));
    let widths = axes.eigenvalues.map(|curvature| curvature.max(f64::MIN_POSITIVE).sqrt().recip().min(1.0));
    let mut drawn = |_| {
        let along = widths.map(|width| width * draws.normal());
        &minimum.point + &axes.eigenvectors * along
    };
    (0..members).map(&mut drawn).collect()
}

/// Moves members towards the speeds, which have counted for a share of their information before.
pub fn smooth(
    posterior: &mut Posterior,
    mut points: Vec<DVector<f64>>,
    counted: f64,
    draws: &mut Stream,
) -> Result<Vec<DVector<f64>>, RobotError> {
    let mut left = 1.0 - counted;
    for round in 1..=ROUNDS {
        let speeds = posterior.speeds(&points)?;
        let (kept, deviations): (Vec<DVector<f64>>, Vec<DVector<f64>>) = points
            .into_iter()
            .zip(&speeds)
            .filter_map(|(point, speeds)| Some((point, posterior.deviations(speeds.as_ref()?))))
            .unzip();
        if kept.len() < FEWEST {
            return Err(RobotError::CannotRun("nearly every set of numbers that is believed blows up".into()));
        }
        let weight = if round == ROUNDS { left } else { weight(&deviations).min(left) };
        let (kept, deviations) = (DMatrix::from_columns(&kept), DMatrix::from_columns(&deviations));
        points = moved(&kept, &deviations, weight, draws).unwrap_or_else(|| columns(&kept));
        left -= weight;
        if left <= 0.0 {
            break;
        }
    }
    Ok(points)
}

/// With which the measurements count in a round: as much as makes the usual member's deviations those of chance (M. Iglesias, Y. Yang,
/// "Adaptive regularisation for ensemble Kalman inversion", Inverse Problems 37, 2021, with the median in place of the mean: a few
/// members may be far off).
fn weight(deviations: &[DVector<f64>]) -> f64 {
    let mut squares: Vec<f64> = deviations.iter().map(|one| one.norm_squared()).collect();
    let median = common::median(&mut squares).unwrap_or(f64::INFINITY);
    deviations[0].len() as f64 / median
}

/// Members (a column each) after a round; `None` where the regression cannot be solved.
fn moved(
    members: &DMatrix<f64>,
    deviations: &DMatrix<f64>,
    weight: f64,
    draws: &mut Stream,
) -> Option<Vec<DVector<f64>>> {
    let (about, seen) = (centred(members), centred(deviations));
    let freedom = (members.ncols() - 1) as f64;
    let mut scatter = &seen * seen.transpose() / freedom;
    for k in 0..scatter.nrows() {
        scatter[(k, k)] += 1.0 / weight;
    }
    let factors = Cholesky::new(scatter)?;
    // Each member meets measurements of its own, so that the ensemble stays as wide as the measurements leave it.
    let met = DMatrix::from_fn(deviations.nrows(), deviations.ncols(), |_, _| draws.normal() / weight.sqrt());
    let steps = about * (seen.transpose() * factors.solve(&(deviations + met))) / freedom;
    Some(columns(&(members - steps)))
}

fn centred(of: &DMatrix<f64>) -> DMatrix<f64> {
    let mean = of.column_mean();
    let mut centred = of.clone();
    centred.column_iter_mut().for_each(|mut column| column -= &mean);
    centred
}

fn columns(of: &DMatrix<f64>) -> Vec<DVector<f64>> {
    of.column_iter().map(|column| column.into_owned()).collect()
}
