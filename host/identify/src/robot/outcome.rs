//! What was found, beside what was measured.

use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};
use robot_file::edit::Document;
use robot_file::robot::Quantity;
use serde::Serialize;

use super::RobotError;
use super::numbers::{Number, Numbers};
use super::posterior::Posterior;
use super::table::Table;
use crate::Z90;
use crate::least_squares::Minimum;

/// One of the numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Dotted path in the robot file.
    pub path: String,
    /// Most probable value, in the file's unit.
    pub value: f64,
    /// Of the 90 % interval.
    pub low: f64,
    /// Of the 90 % interval.
    pub high: f64,
    /// What the robot file has.
    pub file: f64,
    /// How much of the belief's width is left, 0 … 1.
    pub left: f64,
    /// Whether the speeds tell it: at most half of the width is left.
    pub told: bool,
}

/// A condition, measured and simulated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionFit {
    /// Hz, positive clockwise.
    pub f_hz: f64,
    /// Degrees.
    pub alpha_deg: f64,
    /// Whether it was held out.
    pub held_out: bool,
    /// Longitudinal and lateral, mm/s, yaw, °/s.
    pub measured: [Option<f64>; 3],
    /// With the file's numbers.
    pub before: [f64; 3],
    /// With those found.
    pub after: [f64; 3],
}

/// Error of a speed over some conditions, share of the largest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ComponentError {
    /// Root mean square with the file's numbers.
    pub before: f64,
    /// With those found.
    pub after: f64,
    /// Largest with those found.
    pub worst_after: f64,
    /// What repeats alone make of a mean of all, where there are repeats.
    pub scatter: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct RobotFit {
    /// What the speeds tell best first.
    pub parameters: Vec<Parameter>,
    /// By α, then f.
    pub conditions: Vec<ConditionFit>,
    /// Of the fitted conditions: longitudinal, lateral, yaw.
    pub fitted: [Option<ComponentError>; 3],
    /// Of the held-out conditions.
    pub held_out: [Option<ComponentError>; 3],
    /// (3.2) over all conditions with the file's numbers, and with those found; mm/s and °/s added up as in the thesis.
    pub thesis_loss: [f64; 2],
    /// Deviation of the fitted means from the model over what repeats and windows explain; above 1 something is missing.
    pub misfit: f64,
    /// Sets of numbers simulated.
    pub simulated: usize,
    /// The file of what was simulated, if it was kept; of no use when the fit is done.
    #[serde(skip)]
    pub kept: Option<PathBuf>,
    /// The robot file with these numbers and intervals.
    #[serde(skip)]
    pub document: Document,
}

/// A number is told where no more than this is left of its width.
const TOLD: f64 = 0.5;

impl RobotFit {
    /// Of a minimum, and of what else may be: the valleys that are left where the speeds count little, and an ensemble.
    ///
    /// # Errors
    /// A run blew up, or the file cannot hold what was found.
    pub fn new(
        posterior: &mut Posterior,
        best: &Minimum,
        (valleys, members): (&[Minimum], &[DVector<f64>]),
    ) -> Result<Self, RobotError> {
        let both = posterior.speeds(&[DVector::zeros(best.point.len()), best.point.clone()])?;
        let (Some(before), Some(after)) = (&both[0], &both[1]) else {
            return Err(RobotError::CannotRun("a run blew up".into()));
        };
        let (table, numbers) = (posterior.table, posterior.numbers);
        let of = |all: &[f64], k: usize| [0, 1, 2].map(|part| all[3 * k + part]);
        let condition = |k: usize| ConditionFit {
            f_hz: table.conditions[k].0,
            alpha_deg: table.conditions[k].1,
            held_out: table.held_out[k],
            measured: table.means[k],
            before: of(before, k),
            after: of(after, k),
        };
        let conditions: Vec<ConditionFit> = (0..table.conditions.len()).map(condition).collect();
        let misfit = misfit(best);
        let parameters = parameters(numbers, best, &others(valleys, members), misfit.max(1.0));
        let document = document(numbers, &parameters, best)?;
        Ok(Self {
            fitted: errors(&conditions, table, false),
            held_out: errors(&conditions, table, true),
            thesis_loss: [
                loss(&conditions, |condition| condition.before),
                loss(&conditions, |condition| condition.after),
            ],
            misfit,
            simulated: posterior.simulated(),
            kept: posterior.kept(),
            parameters: sorted(parameters),
            conditions,
            document,
        })
    }
}

/// In the numbers' order. `widened`: the factor by which the speeds are known worse than repeats say.
fn parameters(numbers: &Numbers, best: &Minimum, others: &[Vec<(f64, DVector<f64>)>], widened: f64) -> Vec<Parameter> {
    let count = numbers.all.len();
    let data = best.derivatives.rows(0, best.derivatives.nrows() - count);
    let mut normal = data.tr_mul(&data) / (widened * widened);
    for k in 0..count {
        normal[(k, k)] += 1.0;
    }
    let covariance = normal.try_inverse().unwrap_or_else(|| DMatrix::identity(count, count));
    let one = |(k, number): (usize, &Number)| {
        let at = best.point[k];
        // The curvature knows one valley.
        let apart = others.iter().map(|some| mean(some, |other| (other[k] - at).powi(2)));
        let deviation = apart.fold(covariance[(k, k)], f64::max).sqrt().min(1.0);
        let (low, high) = number.interval(at, Z90 * deviation);
        Parameter {
            path: number.path.clone(),
            value: number.at(at),
            low,
            high,
            file: number.file,
            left: deviation,
            told: deviation <= TOLD,
        }
    };
    numbers.all.iter().enumerate().map(one).collect()
}

/// Sets of numbers that may be true as well, with their weights: valleys by their probability, members of the ensemble alike.
fn others(valleys: &[Minimum], members: &[DVector<f64>]) -> [Vec<(f64, DVector<f64>)>; 2] {
    let cost = |valley: &Minimum| valley.residuals.norm_squared();
    let least = valleys.iter().map(cost).fold(f64::INFINITY, f64::min);
    let weighted = |valley: &Minimum| ((-0.5 * (cost(valley) - least)).exp(), valley.point.clone());
    [valleys.iter().map(weighted).collect(), members.iter().map(|member| (1.0, member.clone())).collect()]
}

fn mean(points: &[(f64, DVector<f64>)], of: impl Fn(&DVector<f64>) -> f64) -> f64 {
    let (sum, weights) =
        points.iter().fold((0.0, 0.0), |(sum, weights), (weight, point)| (sum + weight * of(point), weights + weight));
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// Degrees of freedom that a minimum leaves the data: numbers take them as far as the data set them, and not the belief.
#[must_use]
pub fn freedom(best: &Minimum) -> f64 {
    let numbers = best.point.len();
    let rows = best.residuals.len() - numbers;
    let data = best.derivatives.rows(0, rows);
    let normal = best.derivatives.tr_mul(&best.derivatives);
    let taken = normal.try_inverse().map_or(numbers as f64, |inverse| (inverse * data.tr_mul(&data)).trace());
    (rows as f64 - taken).max(1.0)
}

/// Root mean square of the means' deviations, with the degrees of freedom that the numbers take given back.
fn misfit(best: &Minimum) -> f64 {
    let rows = best.residuals.len() - best.point.len();
    (best.residuals.rows(0, rows).norm_squared() / freedom(best)).sqrt()
}

fn sorted(mut parameters: Vec<Parameter>) -> Vec<Parameter> {
    parameters.sort_by(|a, b| a.left.total_cmp(&b.left));
    parameters
}

fn errors(conditions: &[ConditionFit], table: &Table, held_out: bool) -> [Option<ComponentError>; 3] {
    [0, 1, 2].map(|part| {
        let some = || conditions.iter().filter(|one| one.held_out == held_out);
        let off = |of: fn(&ConditionFit) -> [f64; 3]| -> Vec<f64> {
            some().filter_map(|one| Some((of(one)[part] - one.measured[part]?) / table.largest[part])).collect()
        };
        let (before, after) = (off(|one| one.before), off(|one| one.after));
        let rms = |all: &[f64]| (all.iter().map(|x| x * x).sum::<f64>() / all.len().max(1) as f64).sqrt();
        (!after.is_empty()).then(|| ComponentError {
            before: rms(&before),
            after: rms(&after),
            worst_after: after.iter().fold(0.0, |worst: f64, x| worst.max(x.abs())),
            scatter: table.scatter_of_mean(part).map(|scatter| scatter / table.largest[part]),
        })
    })
}

/// The thesis's (3.2).
fn loss(conditions: &[ConditionFit], of: fn(&ConditionFit) -> [f64; 3]) -> f64 {
    let off = |one: &ConditionFit| -> f64 {
        of(one).iter().zip(one.measured).filter_map(|(simulated, measured)| Some((measured? - simulated).abs())).sum()
    };
    conditions.iter().map(off).sum()
}

/// The robot file with values and intervals.
fn document(numbers: &Numbers, parameters: &[Parameter], best: &Minimum) -> Result<Document, RobotError> {
    let mut document = numbers.document(best.point.as_slice())?;
    let source = "scram identify robot, from measured speeds; 90 % interval";
    let quantity = |one: &Parameter| Quantity {
        value: one.value,
        low: one.low,
        high: one.high,
        source: if one.told { source.to_owned() } else { format!("{source}; the speeds hardly tell it") },
    };
    let quantities: Vec<(&str, Quantity)> = parameters.iter().map(|one| (one.path.as_str(), quantity(one))).collect();
    document.set_all(&quantities).map_err(|error| RobotError::CannotRun(error.to_string()))?;
    Ok(document)
}
