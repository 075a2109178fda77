//! Hinges and starts of all runs at once.

use std::sync::atomic::AtomicBool;

use nalgebra::{DMatrix, DVector};
use robot_file::edit::Document;
use robot_file::robot::{Backbone, Quantity};
use robot_file::{Robot, RobotFileError};
use serde::Serialize;

#[cfg(feature = "bayes")]
use super::bayes::bayes;
use super::oscillation::Oscillation;
use super::rig::{Gravity, Hinges, Release, Rig, START, between, of_axis, widest};
use super::{BackboneError, FIELDS, start};
use crate::Z90;
use crate::least_squares::{Minimum, Residuals, minimise};

/// How to identify.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// The module at the backbone's end, from 1; none for the last.
    pub module: Option<usize>,
    /// How the backbone stands in the room.
    pub gravity: Gravity,
    /// How the six numbers are looked for.
    pub method: Method,
}

/// How the six numbers are looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Levenberg and Marquardt from the best of a grid, with intervals from the curvature.
    #[default]
    LeastSquares,
    /// Bayesian optimisation of (3.1), as in the thesis; it gives no intervals.
    Bayes(Search),
}

/// How Bayesian optimisation searches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// Of all that is drawn: the same seed finds the same numbers.
    pub seed: u64,
    /// Sets of the six numbers to try, [`Search::FEWEST`] or more.
    pub evaluations: usize,
}

impl Search {
    /// Turns, each in a smaller box around what the one before found.
    pub(super) const TURNS: usize = 3;
    /// Sets that are tried in a turn before there is anything to choose the next by.
    pub(super) const DRAWN: usize = 15;
    /// Fewer leave none to choose.
    pub const FEWEST: usize = Self::TURNS * (Self::DRAWN + 1);
}

impl Default for Search {
    fn default() -> Self {
        Self { seed: 1, evaluations: 120 }
    }
}

/// The 90 % interval of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end, N·m/rad or N·m·s/rad.
    pub low: f64,
    /// Upper end, N·m/rad or N·m·s/rad.
    pub high: f64,
}

/// One of the six numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HingeFit {
    /// In `[backbone]`.
    pub field: &'static str,
    /// Best, N·m/rad or N·m·s/rad.
    pub value: f64,
    /// How far it can be trusted, where the method says so.
    #[serde(flatten)]
    pub interval: Option<Interval>,
    /// What the robot file has.
    pub file: f64,
    /// Whether these runs tell it: an axis that does not swing has no stiffness to show.
    pub told: bool,
}

/// How the result does on a run that was not fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// The run.
    pub run: String,
    /// (3.1) with the file's numbers, rad.
    pub before_rad: f64,
    /// (3.1) with those found, rad.
    pub after_rad: f64,
}

/// A run and its simulation, for plots.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The run.
    pub run: String,
    /// Since the release, s.
    pub t_s: Vec<f64>,
    /// About x, y, z, rad; NaN where missing.
    pub measured: Vec<[f64; 3]>,
    /// About x, y, z, rad.
    pub simulated: Vec<[f64; 3]>,
    /// Whether it was held out.
    pub held_out: bool,
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BackboneFit {
    /// In the order of [`FIELDS`].
    pub hinges: Vec<HingeFit>,
    /// Deviation of what is left about x, y, z, rad; none for an axis that no run has.
    pub noise_rad: [Option<f64>; 3],
    /// What the noise alone makes of (3.1), rad.
    pub floor_rad: f64,
    /// (3.1) over the fitted runs, rad.
    pub error_rad: f64,
    /// Factor on the intervals for what is correlated in time.
    pub widened: f64,
    /// Samples left out because they lie far off.
    pub outliers: usize,
    /// Samples used.
    pub samples: usize,
    /// Sets of the six numbers that Bayesian optimisation tried; none for least squares, which moves them one by one.
    pub evaluations: Option<usize>,
    /// Oscillations that were simulated to find them, one for each run, set of numbers and start.
    pub simulated: usize,
    /// Moment of inertia about x, y, z against which stiffness is known, kg·m²: the module's, about the fast end.
    pub inertia_kg_m2: [f64; 3],
    /// Runs that were not fitted.
    pub held_out: Vec<HeldOut>,
    /// All runs.
    #[serde(skip)]
    pub tracks: Vec<Track>,
}

impl BackboneFit {
    /// Names of the runs that were fitted.
    #[must_use]
    pub fn fitted(&self) -> Vec<&str> {
        self.tracks.iter().filter(|track| !track.held_out).map(|track| track.run.as_str()).collect()
    }

    /// Writes the numbers that the runs tell into a robot file.
    ///
    /// # Errors
    /// The file does not take one.
    pub fn write_into(&self, document: &mut Document) -> Result<(), RobotFileError> {
        let Some(before) = document.robot()?.backbone else { return Ok(()) };
        let told = self.hinges.iter().zip(quantities(&before)).filter(|(hinge, _)| hinge.told);
        let found: Vec<(String, Quantity)> = told
            .map(|(hinge, spread)| (format!("backbone.{}", hinge.field), hinge.quantity(spread, &self.fitted())))
            .collect();
        let fields: Vec<(&str, Quantity)> = found.iter().map(|(path, value)| (path.as_str(), value.clone())).collect();
        document.set_all(&fields)
    }
}

impl HingeFit {
    /// For a robot file. Where the method gives no interval, the file's spread stays, widened where the value lies outside.
    fn quantity(&self, file: &Quantity, runs: &[&str]) -> Quantity {
        let runs = runs.join(", ");
        let (low, high, source) = match self.interval {
            Some(Interval { low, high }) => (low, high, format!("scram identify backbone, from {runs}; 90 % interval")),
            None => (
                file.low.min(self.value),
                file.high.max(self.value),
                format!(
                    "scram identify backbone --method bayes, from {runs}; no interval, the spread is the one before"
                ),
            ),
        };
        Quantity { value: self.value, low, high, source }
    }
}

/// Deviation of what is believed before of the logarithm of a number: a factor of three.
const BELIEVED: f64 = 1.1;
/// A number is told where the runs leave less than this share of that.
const TOLD: f64 = 0.5;
/// How often an axis may be said to swing that does not.
const NOTHING_SWINGS: f64 = 0.01;
/// Steps of the derivatives.
const NUDGE: f64 = 1e-5;
/// A sample this many deviations off is none.
const OUTLIER: f64 = 6.0;
/// Offsets of a run, about x, y, z, rad; no more than `OFFSET`.
const OFFSETS: usize = 3;
const OFFSET: f64 = 0.5;
pub(super) const STEPS: usize = 40;

/// Finds stiffness and damping from some runs and judges them on others.
///
/// # Errors
/// There is no run, one cannot be used, the robot file has no backbone, or none near its own swings like these.
pub fn identify(
    robot: &Robot,
    fit: &[Oscillation],
    held_out: &[Oscillation],
    options: Options,
) -> Result<BackboneFit, BackboneError> {
    identify_until(robot, fit, held_out, options, &AtomicBool::new(false))
}

/// The same until `stop` is true: no oscillation is simulated any more then.
///
/// # Errors
/// As [`identify`], or it was stopped.
pub fn identify_until(
    robot: &Robot,
    fit: &[Oscillation],
    held_out: &[Oscillation],
    options: Options,
    stop: &AtomicBool,
) -> Result<BackboneFit, BackboneError> {
    let rig = Rig::new(robot, options.module, options.gravity, stop)?;
    // Whatever cannot be simulated any more says something else.
    identify_on(&rig, robot, (fit, held_out), options).map_err(|error| match rig.is_stopped() {
        true => BackboneError::Stopped,
        false => error,
    })
}

fn identify_on(
    rig: &Rig<'_>,
    robot: &Robot,
    (fit, held_out): (&[Oscillation], &[Oscillation]),
    options: Options,
) -> Result<BackboneFit, BackboneError> {
    if fit.is_empty() {
        return Err(BackboneError::Nothing);
    }
    let released = |runs: &[Oscillation]| runs.iter().map(Oscillation::released).collect::<Result<Vec<_>, _>>();
    let (runs, others) = (released(fit)?, released(held_out)?);
    let (problem, minimum) = match options.method {
        Method::LeastSquares => least_squares(rig, runs).ok_or(BackboneError::Hopeless)?,
        Method::Bayes(search) => {
            let backbone = robot.backbone.as_ref().ok_or(BackboneError::Hopeless)?;
            bayes(rig, runs, quantities(backbone).map(|one| [one.low, one.high]), search)?
        }
    };
    let found = problem.hinges(&minimum.point);
    let mut result = problem.summary(&minimum);
    if let Method::Bayes(search) = options.method {
        result.evaluations = Some(search.evaluations);
    }
    result.tracks = problem.tracks(&minimum, false);
    for run in others {
        let (weights, name) = (problem.weights, run.name.clone());
        let judge = |hinges: Hinges| {
            let mut judged = Problem { weights, ..Problem::of(rig, vec![run.clone()], hinges) };
            let minimum = judged.starts(STEPS)?;
            Some((judged.error(&minimum), judged.tracks(&minimum, true)))
        };
        let (Some((before_rad, _)), Some((after_rad, tracks))) = (judge(rig.file()), judge(found)) else {
            return Err(BackboneError::Hopeless);
        };
        result.held_out.push(HeldOut { run: name, before_rad, after_rad });
        result.tracks.extend(tracks);
    }
    Ok(result)
}

/// The six numbers of a robot file, in the order of [`FIELDS`].
fn quantities(backbone: &Backbone) -> [&Quantity; 6] {
    [
        &backbone.torsion_nm_per_rad,
        &backbone.stiff_nm_per_rad,
        &backbone.soft_nm_per_rad,
        &backbone.torsion_nm_s_per_rad,
        &backbone.stiff_nm_s_per_rad,
        &backbone.soft_nm_s_per_rad,
    ]
}

fn least_squares<'a>(rig: &'a Rig<'a>, runs: Vec<Oscillation>) -> Option<(Problem<'a>, Minimum)> {
    let begin = start::of_grid(rig, &runs)?;
    let mut problem = Problem { begin: Some(begin), ..Problem::of(rig, runs, rig.file()) };
    let minimum = problem.settle()?;
    Some((problem, minimum))
}

#[cfg(not(feature = "bayes"))]
fn bayes<'a>(
    _: &'a Rig<'a>,
    _: Vec<Oscillation>,
    _: [[f64; 2]; 6],
    _: Search,
) -> Result<(Problem<'a>, Minimum), BackboneError> {
    Err(BackboneError::WithoutBayes)
}

/// Everything that is looked for: logarithms of the hinges over the file's, then start and offsets of each run.
pub(super) struct Problem<'a> {
    rig: &'a Rig<'a>,
    pub(super) runs: Vec<Oscillation>,
    /// One over the noise about x, y, z, 1/rad.
    weights: [f64; 3],
    /// Where the hinges begin, if they are looked for.
    begin: Option<Hinges>,
    /// The hinges, if they are not.
    pub(super) fixed: Hinges,
    outliers: usize,
}

impl<'a> Problem<'a> {
    /// With given hinges: only the runs' starts and offsets are looked for.
    pub(super) fn of(rig: &'a Rig<'a>, runs: Vec<Oscillation>, fixed: Hinges) -> Self {
        Self { rig, runs, weights: [1e3; 3], begin: None, fixed, outliers: 0 }
    }

    /// The runs' starts and offsets, from rest, in at most so many steps; `None` where nothing can be simulated.
    pub(super) fn starts(&mut self, most_steps: usize) -> Option<Minimum> {
        let begin = self.begin();
        minimise(self, begin, most_steps)
    }

    fn numbers(&self) -> usize {
        if self.begin.is_some() { 6 } else { 0 }
    }

    /// Where a run's own parameters stand.
    fn of_run(&self, run: usize) -> usize {
        self.numbers() + run * (START + OFFSETS)
    }

    fn begin(&self) -> DVector<f64> {
        let mut point = DVector::zeros(self.of_run(self.runs.len()));
        if let Some(begin) = self.begin {
            for (k, (value, file)) in begin.iter().zip(self.rig.file()).enumerate() {
                point[k] = (value / file).ln();
            }
        }
        point
    }

    fn hinges(&self, point: &DVector<f64>) -> Hinges {
        if self.begin.is_none() {
            return self.fixed;
        }
        let file = self.rig.file();
        std::array::from_fn(|k| file[k] * point[k].exp())
    }

    fn release(&self, point: &DVector<f64>, run: usize) -> Release {
        let from = self.of_run(run);
        Release {
            hinges: self.hinges(point),
            start: std::array::from_fn(|number| point[from + number] * widest(number)),
            seconds: self.runs[run].seconds(),
        }
    }

    /// Fits, takes each axis's weight from what is left, drops outliers, and fits again.
    fn settle(&mut self) -> Option<Minimum> {
        // The starts alone first: from rest nothing tells how the hinges matter.
        let hinges = self.begin.take()?;
        let mut starts = Problem { weights: self.weights, ..Problem::of(self.rig, self.runs.clone(), hinges) };
        let begun = starts.starts(STEPS)?;
        self.begin = Some(hinges);
        let mut point = self.begin();
        point.rows_mut(6, begun.point.len()).copy_from(&begun.point);
        let mut minimum = minimise(self, point, STEPS)?;
        for _ in 0..2 {
            self.weigh(&minimum);
            minimum = minimise(self, minimum.point, STEPS)?;
        }
        Some(minimum)
    }

    /// Residuals of the readings, run after run, sample after sample, with their axes; without their weights.
    fn read<'b>(&'b self, minimum: &'b Minimum) -> impl Iterator<Item = (usize, usize, usize, f64)> + 'b {
        self.rows()
            .zip(minimum.residuals.iter())
            .map(|((run, k, axis), value)| (run, k, axis, value / self.weights[axis]))
    }

    fn rows(&self) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        self.runs.iter().enumerate().flat_map(|(run, one)| {
            (0..one.t_s.len())
                .flat_map(move |k| (0..3).map(move |axis| (run, k, axis)))
                .filter(move |&(_, k, axis)| one.angles[k][axis].is_finite())
        })
    }

    fn noise(&self, minimum: &Minimum) -> [Option<f64>; 3] {
        let free = (1.0 - minimum.point.len() as f64 / self.rows().count() as f64).max(0.1);
        self.errors(minimum).map(|error| error.map(|error| (error / free.sqrt()).max(1e-9)))
    }

    fn weigh(&mut self, minimum: &Minimum) {
        let noise = self.noise(minimum).map(|noise| noise.unwrap_or(1e-3));
        let far: Vec<_> =
            self.read(minimum).filter(|(_, _, axis, value)| value.abs() > OUTLIER * noise[*axis]).collect();
        self.outliers += far.len();
        for (run, k, axis, _) in far {
            self.runs[run].angles[k][axis] = f64::NAN;
        }
        self.weights = noise.map(|noise| 1.0 / noise);
    }

    /// (3.1) over all runs, rad, with the degrees of freedom that the fit took given back.
    fn error(&self, minimum: &Minimum) -> f64 {
        let sum: f64 = self.read(minimum).map(|(_, _, _, value)| value * value).sum();
        let rows = self.rows().count() as f64;
        let samples = self.runs.iter().map(|run| run.angles.iter().filter(|a| a.iter().any(|x| x.is_finite())).count());
        let free = (1.0 - minimum.point.len() as f64 / rows).max(0.1);
        (sum / free / samples.sum::<usize>().max(1) as f64).sqrt()
    }

    /// (3.1) about one axis alone, rad; none for an axis that no run has.
    pub(super) fn errors(&self, minimum: &Minimum) -> [Option<f64>; 3] {
        let mut sums = [(0.0, 0.0); 3];
        for (_, _, axis, value) in self.read(minimum) {
            sums[axis].0 += value * value;
            sums[axis].1 += 1.0;
        }
        sums.map(|(sum, count)| (count > 0.0).then(|| f64::sqrt(sum / count)))
    }

    /// How much wider intervals are than white noise would have them: the sum of the correlations, never below 1.
    fn widened(&self, minimum: &Minimum) -> f64 {
        let mut series: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); 3]; self.runs.len()];
        for (run, _, axis, value) in self.read(minimum) {
            series[run][axis].push(value * self.weights[axis]);
        }
        let series: Vec<Vec<f64>> = series.into_iter().flatten().collect();
        let at_lag = |lag: usize| -> f64 {
            series.iter().map(|one| one.iter().zip(one.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>()).sum()
        };
        let (all, count) = (at_lag(0), series.iter().map(Vec::len).sum::<usize>() as f64);
        let mut sum = 0.0;
        for lag in 1..200 {
            let correlation = at_lag(lag) / all;
            if correlation < 2.0 / count.sqrt() {
                break;
            }
            sum += correlation;
        }
        (1.0 + 2.0 * sum).sqrt()
    }

    fn summary(&self, minimum: &Minimum) -> BackboneFit {
        let widened = self.widened(minimum);
        let covariance = minimum.covariance();
        let (mut found, file) = (self.hinges(&minimum.point), self.rig.file());
        let swings = self.swings(minimum);
        for (k, value) in found.iter_mut().enumerate().filter(|(k, _)| !swings[k % 3]) {
            *value = file[k];
        }
        let hinges = (0..6)
            .map(|k| {
                // Hinges that were given have no curvature.
                let curved = self.begin.is_some().then(|| {
                    let curved = covariance.as_ref().map_or(BELIEVED, |all| all[(k, k)].sqrt() * widened);
                    if swings[k % 3] { curved.min(BELIEVED) } else { BELIEVED }
                });
                HingeFit {
                    field: FIELDS[k],
                    value: found[k],
                    interval: curved.map(|deviation| Interval {
                        low: found[k] * (-Z90 * deviation).exp(),
                        high: found[k] * (Z90 * deviation).exp(),
                    }),
                    file: file[k],
                    told: curved.map_or(swings[k % 3], |deviation| deviation < TOLD * BELIEVED),
                }
            })
            .collect();
        let noise_rad = self.noise(minimum);
        BackboneFit {
            hinges,
            noise_rad,
            floor_rad: noise_rad.iter().flatten().map(|noise| noise * noise).sum::<f64>().sqrt(),
            error_rad: self.error(minimum),
            widened,
            outliers: self.outliers,
            samples: self.rows().count(),
            evaluations: None,
            simulated: self.rig.simulated(),
            inertia_kg_m2: self.rig.inertia(),
            held_out: Vec::new(),
            tracks: Vec::new(),
        }
    }

    /// Whether the end swings about x, y, z at all: more than the best of the grid's oscillations follows of mere noise, by the bound of
    /// B. Laurent and P. Massart, "Adaptive estimation of a quadratic functional by model selection", 2000, lemma 1, for each of them.
    fn swings(&self, minimum: &Minimum) -> [bool; 3] {
        let noise = self.noise(minimum);
        let tracks = self.tracks(minimum, false);
        [0, 1, 2].map(|axis| {
            let Some(noise) = noise[axis] else { return false };
            let mut followed = 0.0;
            for (run, track) in tracks.iter().enumerate() {
                let offset = self.offsets(&minimum.point, run)[axis];
                for (measured, simulated) in track.measured.iter().zip(&track.simulated) {
                    if measured[axis].is_finite() {
                        followed += ((simulated[axis] - offset) / noise).powi(2);
                    }
                }
            }
            let freedom = (of_axis(axis).count() * self.runs.len()) as f64;
            let rare = (start::GRID as f64 / NOTHING_SWINGS).ln();
            followed > freedom + 2.0 * (freedom * rare).sqrt() + 2.0 * rare
        })
    }

    fn tracks(&self, minimum: &Minimum, held_out: bool) -> Vec<Track> {
        let releases: Vec<Release> = (0..self.runs.len()).map(|run| self.release(&minimum.point, run)).collect();
        let Some(oscillations) = self.rig.oscillations(&releases) else { return Vec::new() };
        let of = |(run, points): (usize, &Vec<[f64; 3]>)| {
            let (one, offsets) = (&self.runs[run], self.of_run(run) + START);
            let shown = |t: &f64| {
                let angles = between(points, *t);
                std::array::from_fn(|axis| angles[axis] + OFFSET * minimum.point[offsets + axis])
            };
            Track {
                run: one.name.clone(),
                t_s: one.t_s.clone(),
                measured: one.angles.clone(),
                simulated: one.t_s.iter().map(shown).collect(),
                held_out,
            }
        };
        oscillations.iter().enumerate().map(of).collect()
    }

    /// Weighted residuals of one run for its simulated points.
    fn compare<'b>(&'b self, run: usize, points: &'b [[f64; 3]], offsets: [f64; 3]) -> impl Iterator<Item = f64> + 'b {
        let one = &self.runs[run];
        one.t_s.iter().zip(&one.angles).flat_map(move |(t, measured)| {
            let simulated = between(points, *t);
            (0..3)
                .filter(|&axis| measured[axis].is_finite())
                .map(move |axis| self.weights[axis] * (simulated[axis] + offsets[axis] - measured[axis]))
        })
    }

    fn offsets(&self, point: &DVector<f64>, run: usize) -> [f64; 3] {
        std::array::from_fn(|axis| OFFSET * point[self.of_run(run) + START + axis])
    }

    /// What is believed before: the hinges near the file's, the starts within their widths.
    fn beliefs(&self, point: &DVector<f64>) -> impl Iterator<Item = f64> {
        let numbers = self.numbers();
        point
            .clone()
            .iter()
            .enumerate()
            .map(|(k, value)| if k < numbers { value / BELIEVED } else { *value })
            .collect::<Vec<_>>()
            .into_iter()
    }
}

impl Residuals for Problem<'_> {
    fn at(&mut self, point: &DVector<f64>) -> Option<DVector<f64>> {
        let releases: Vec<Release> = (0..self.runs.len()).map(|run| self.release(point, run)).collect();
        let oscillations = self.rig.oscillations(&releases)?;
        let mut residuals: Vec<f64> = Vec::new();
        for (run, points) in oscillations.iter().enumerate() {
            residuals.extend(self.compare(run, points, self.offsets(point, run)));
        }
        residuals.extend(self.beliefs(point));
        Some(DVector::from_vec(residuals))
    }

    fn derivatives(&mut self, point: &DVector<f64>, residuals: &DVector<f64>) -> Option<DMatrix<f64>> {
        let mut releases = Vec::new();
        let mut places = Vec::new();
        for run in 0..self.runs.len() {
            let own = self.of_run(run)..self.of_run(run) + START;
            for column in (0..self.numbers()).chain(own) {
                let mut nudged = point.clone();
                nudged[column] += NUDGE;
                releases.push(self.release(&nudged, run));
                places.push((run, column));
            }
        }
        let oscillations = self.rig.oscillations(&releases)?;
        let rows = self.rows().count();
        let firsts: Vec<usize> = self.first_rows();
        let mut jacobian = DMatrix::zeros(residuals.len(), point.len());
        for ((run, column), points) in places.into_iter().zip(&oscillations) {
            for (k, value) in self.compare(run, points, self.offsets(point, run)).enumerate() {
                let row = firsts[run] + k;
                jacobian[(row, column)] = (value - residuals[row]) / NUDGE;
            }
        }
        for (row, (run, _, axis)) in self.rows().enumerate() {
            jacobian[(row, self.of_run(run) + START + axis)] = self.weights[axis] * OFFSET;
        }
        for k in 0..point.len() {
            jacobian[(rows + k, k)] = if k < self.numbers() { 1.0 / BELIEVED } else { 1.0 };
        }
        Some(jacobian)
    }
}

impl Problem<'_> {
    fn first_rows(&self) -> Vec<usize> {
        let mut firsts = vec![0; self.runs.len()];
        let mut counts = vec![0; self.runs.len()];
        self.rows().for_each(|(run, _, _)| counts[run] += 1);
        for run in 1..firsts.len() {
            firsts[run] = firsts[run - 1] + counts[run - 1];
        }
        firsts
    }
}
