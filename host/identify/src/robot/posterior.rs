//! How probable numbers are, given a table of speeds and what is believed of them.

use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::RobotError;
use super::cache::Cache;
use super::numbers::Numbers;
use super::table::Table;
use super::walk::{Run, speeds};
use crate::least_squares::Residuals;

/// Of the first derivatives: every coordinate is moved by this.
const NUDGE: f64 = 0.1;
/// Later ones move no coordinate farther.
const FARTHEST: f64 = 0.7;
/// Derivatives are taken to both sides where the speeds count for so much.
const TWO_SIDED: f64 = 0.5;
/// P. J. Huber, "Robust estimation of a location parameter", 1964: a gait that jumps under one condition counts by its size, not by
/// its square, beyond so many deviations.
const HUBER: f64 = 2.0;
/// Sets that are simulated before they are kept.
const AT_ONCE: usize = 16;

/// Residuals over coordinates: deviations of the fitted means from the simulated speeds, in units of what the means are known to; then
/// deviations of the numbers from what is believed, in units of its spread.
pub struct Posterior<'a> {
    /// What varies.
    pub numbers: &'a Numbers,
    /// What was measured.
    pub table: &'a Table,
    /// What the speeds count for beside what is believed: 1 in the end.
    pub weight: f64,
    /// Moves for derivatives, a column each.
    directions: DMatrix<f64>,
    run: Run,
    cache: Cache,
    /// What went wrong in keeping an evaluation, which a fit cannot say.
    failed: Option<RobotError>,
    told: &'a (dyn Fn(usize) + 'a),
}

impl<'a> Posterior<'a> {
    /// With what is simulated kept in a file of this directory, if one is named. `told` is called with how many sets were simulated.
    pub fn new(
        (numbers, table): (&'a Numbers, &'a Table),
        run: Run,
        keep_in: Option<&Path>,
        told: &'a (dyn Fn(usize) + 'a),
    ) -> Result<Self, RobotError> {
        let believed: Vec<String> =
            numbers.all.iter().map(|one| format!("{}={}±{}", one.path, one.file, one.at(1.0))).collect();
        // The plan has what the robot file's other numbers make of the body.
        let plan = numbers.plan(&vec![0.0; numbers.all.len()]).map_err(RobotError::CannotRun)?;
        let about = format!("{run:?} {:?} {} {plan:?}", table.conditions, believed.join(" ")).replace('\n', " ");
        let cache = Cache::open(keep_in, &about)?;
        let mut posterior =
            Self { numbers, table, weight: 1.0, directions: DMatrix::zeros(0, 0), run, cache, failed: None, told };
        posterior.turn_to(None);
        Ok(posterior)
    }

    /// The next derivatives are where these are of, or where nothing is known.
    pub fn turn_to(&mut self, derivatives: Option<&DMatrix<f64>>) {
        let count = self.numbers.all.len();
        self.directions = derivatives.map_or_else(|| DMatrix::identity(count, count) * NUDGE, next_directions);
    }

    /// How many sets of numbers were simulated.
    pub fn simulated(&self) -> usize {
        self.cache.len()
    }

    /// The file in which that is kept.
    pub fn kept(&self) -> Option<PathBuf> {
        self.cache.path()
    }

    /// Speeds at some points, condition after condition; none where nothing can be simulated.
    pub fn speeds(&mut self, points: &[DVector<f64>]) -> Result<Vec<Option<Vec<f64>>>, RobotError> {
        let new: Vec<&DVector<f64>> =
            points.iter().filter(|point| self.cache.get(point.as_slice()).is_none()).collect();
        for some in new.chunks(AT_ONCE) {
            let plans: Vec<_> = some.par_iter().map(|point| self.numbers.plan(point.as_slice()).ok()).collect();
            let found = speeds(&plans, &self.table.conditions, self.run);
            for (point, speeds) in some.iter().zip(found) {
                let flat = speeds.map(|speeds| speeds.into_iter().flatten().collect());
                self.cache.put(point.as_slice(), flat)?;
            }
            (self.told)(self.simulated());
        }
        Ok(points.iter().map(|point| self.cache.get(point.as_slice()).cloned().flatten()).collect())
    }

    /// Deviations of the fitted means, in units of what they are known to.
    pub fn deviations(&self, speeds: &[f64]) -> DVector<f64> {
        self.table.deviations_where(speeds, false)
    }

    /// Residuals of which half the square is minimised.
    pub fn residuals(&self, point: &DVector<f64>, speeds: &[f64]) -> DVector<f64> {
        let mut all: Vec<f64> = self.deviations(speeds).iter().map(|one| self.weight * huber(*one)).collect();
        all.extend(point.iter());
        DVector::from_vec(all)
    }

    /// What stopped the last fit, once.
    pub fn take_failure(&mut self) -> Result<(), RobotError> {
        self.failed.take().map_or(Ok(()), Err)
    }

    fn or_fail<T>(&mut self, found: Result<T, RobotError>) -> Option<T> {
        found.map_err(|error| self.failed = Some(error)).ok()
    }
}

impl Residuals for Posterior<'_> {
    const ESTIMATED: bool = true;
    // Less than the simulation's own roughness makes.
    const ENOUGH: f64 = 1e-3;

    fn at(&mut self, point: &DVector<f64>) -> Option<DVector<f64>> {
        let speeds = self.speeds(std::slice::from_ref(point));
        let speeds = self.or_fail(speeds)?.pop().flatten()?;
        Some(self.residuals(point, &speeds))
    }

    fn derivatives(&mut self, point: &DVector<f64>, residuals: &DVector<f64>) -> Option<DMatrix<f64>> {
        // To both sides in the end: along a bent valley a difference to one side points elsewhere.
        let sides: &[f64] = if self.weight < TWO_SIDED { &[1.0] } else { &[1.0, -1.0] };
        let points: Vec<DVector<f64>> = self
            .directions
            .column_iter()
            .flat_map(|direction| sides.iter().map(move |side| point + *side * direction))
            .collect();
        let there = self.speeds(&points);
        let there = self.or_fail(there)?;
        let mut slopes = DMatrix::zeros(residuals.len(), point.len());
        for (k, (points, there)) in points.chunks(sides.len()).zip(there.chunks(sides.len())).enumerate() {
            let seen = |side: usize| there[side].as_ref().map(|speeds| self.residuals(&points[side], speeds));
            let slope = match (seen(0), sides.get(1).and_then(|_| seen(1))) {
                (Some(there), Some(opposite)) => 0.5 * (there - opposite),
                (Some(there), None) => there - residuals,
                (None, Some(opposite)) => residuals - opposite,
                // Where nothing can be simulated beside, what is believed alone depends on it.
                (None, None) => {
                    let mut slope = DVector::zeros(residuals.len());
                    let believed = residuals.len() - point.len();
                    slope.rows_mut(believed, point.len()).copy_from(&self.directions.column(k));
                    slope
                }
            };
            slopes.column_mut(k).copy_from(&slope);
        }
        let derivatives = slopes * self.directions.clone().try_inverse()?;
        self.directions = next_directions(&derivatives);
        Some(derivatives)
    }
}

/// Moves for the next derivatives: along the axes of the ellipsoid of what is probable, as far as one deviation. What the speeds tell
/// well bends within a tenth of a belief; what they hardly tell moves them less over that than the steps of the simulation do.
fn next_directions(derivatives: &DMatrix<f64>) -> DMatrix<f64> {
    let axes = SymmetricEigen::new(derivatives.tr_mul(derivatives));
    let mut directions = axes.eigenvectors;
    for (mut direction, curvature) in directions.column_iter_mut().zip(axes.eigenvalues.iter()) {
        direction *= curvature.max(f64::MIN_POSITIVE).sqrt().recip().min(FARTHEST);
    }
    directions
}

/// Root of twice Huber's loss, with its sign.
fn huber(deviation: f64) -> f64 {
    let size = deviation.abs();
    if size <= HUBER { deviation } else { (HUBER * (2.0 * size - HUBER)).sqrt().copysign(deviation) }
}
