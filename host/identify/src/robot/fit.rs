//! The most probable numbers given a table of speeds and what is believed of them.

use std::path::PathBuf;

pub use common::Progress;
use hal_sim::random::{Source, Stream};
use nalgebra::{DMatrix, DVector};
use robot_file::edit::Document;
use sweep::Measured;

use super::RobotError;
use super::ensemble::{ROUNDS as ENSEMBLE_ROUNDS, about, smooth};
use super::numbers::Numbers;
use super::outcome::RobotFit;
use super::posterior::Posterior;
use super::table::{Held, Table};
use super::walk::Run;
use crate::least_squares::{Minimum, minimise};

/// How to identify.
#[derive(Clone)]
pub struct Options {
    /// Which conditions are held out.
    pub held: Held,
    /// Whether weight and friction may be uneven (`payload_offset`, `foot_friction`).
    pub uneven: bool,
    /// Speeds are those between these times, s: see [`Run::new`].
    pub window_s: (f64, f64),
    /// Integration step, s.
    pub step_s: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// Sets that are drawn from what is believed.
    pub draws: usize,
    /// Threads; 0 for as many as the machine has cores.
    pub threads: usize,
    /// A directory for a file of what was simulated: a fit that is stopped goes on from there ([`RobotFit::kept`]).
    pub keep_in: Option<PathBuf>,
    /// Told what is being done.
    pub progress: Option<Progress>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            held: Held::OneInFour,
            uneven: false,
            window_s: (1.0, 2.0),
            step_s: 2e-4,
            seed: 1,
            draws: 200,
            threads: 0,
            keep_in: None,
            progress: None,
        }
    }
}

/// A search from draws down to rough minima, in stages.
pub struct Search<'a> {
    /// Sets that are drawn from what is believed; the first is the file's.
    pub draws: usize,
    /// One after the other.
    pub stages: &'a [Stage],
}

/// A stage of a search.
pub struct Stage {
    /// What the speeds count for.
    pub weight: f64,
    /// Steps from each start, at most.
    pub steps: usize,
    /// Starts, at most.
    pub followed: usize,
}

const STAGES: [Stage; 2] =
    [Stage { weight: 0.1, steps: 4, followed: 12 }, Stage { weight: 0.3, steps: 5, followed: 6 }];
/// Rough minima that are refined, each with an ensemble of so many members.
const REFINED: usize = 3;
const MEMBERS: usize = 80;
/// Steps down from an ensemble's best member, at most.
const STEPS: usize = 6;
/// Draws lie within so many deviations of what is believed: beyond, feet sink and runs blow up.
const WITHIN: f64 = 2.0;

/// Finds the numbers of a robot from its speeds.
///
/// # Errors
/// The robot file has no body, the table too few conditions, the times are not two, nothing can be simulated, or evaluations cannot be
/// kept.
pub fn identify(document: &Document, measured: &Measured, options: &Options) -> Result<RobotFit, RobotError> {
    in_pool(options.threads, || identify_here(document, measured, options))
}

/// Does some work on so many threads; 0 for as many as the machine has cores.
pub fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(work),
        // No further threads to be had: the work is done on those there are.
        Err(_) => work(),
    }
}

fn identify_here(document: &Document, measured: &Measured, options: &Options) -> Result<RobotFit, RobotError> {
    let run = Run::new(options.window_s, options.step_s)?;
    let table = Table::new(measured, &options.held)?;
    let numbers = Numbers::new(document, options.uneven)?;
    let tell = |what: &str, share: f64| {
        if let Some(progress) = &options.progress {
            progress(what, share);
        }
    };
    let foreseen = foreseen(options, numbers.all.len()) as f64;
    let told = |simulated: usize| tell("simulating", (simulated as f64 / foreseen).min(0.99));
    let mut posterior = Posterior::new((&numbers, &table), run, options.keep_in.as_deref(), &told)?;
    let origin = DVector::zeros(numbers.all.len());
    if posterior.speeds(std::slice::from_ref(&origin))?[0].is_none() {
        return Err(RobotError::CannotRun("a run blew up, or the step is too long for its springs".into()));
    }
    let mut draws = Stream::new(options.seed, Source::Variation);
    let rough = rough_minima(&mut posterior, &Search { draws: options.draws, stages: &STAGES }, &mut draws)?;
    let found = refine(&mut posterior, &rough, &mut draws)?;
    posterior.take_failure()?;
    let Some(Refined { best, members }) = found else {
        return Err(RobotError::CannotRun("no set of numbers could be refined".into()));
    };
    tell("done", 1.0);
    RobotFit::new(&mut posterior, &best, (&rough, &members))
}

/// Sets of numbers that a fit simulates, about.
fn foreseen(options: &Options, numbers: usize) -> usize {
    let of = |stage: &Stage| stage.steps * stage.followed * (numbers + 1);
    let refined = MEMBERS * ENSEMBLE_ROUNDS / 2 + STEPS * (2 * numbers + 1);
    options.draws + STAGES.iter().map(of).sum::<usize>() + REFINED * refined
}

/// Down from the most probable of many sets that are drawn from what is believed, in stages: the speeds count more from stage to
/// stage, and fewer sets are followed. Lowest first; the posterior's weight stays that of the last stage.
///
/// # Errors
/// Evaluations cannot be kept.
pub fn rough_minima(
    posterior: &mut Posterior,
    search: &Search<'_>,
    draws: &mut Stream,
) -> Result<Vec<Minimum>, RobotError> {
    let count = posterior.numbers.all.len();
    let mut points = vec![DVector::zeros(count)];
    points.extend((1..search.draws).map(|_| DVector::from_fn(count, |_, _| draws.normal().clamp(-WITHIN, WITHIN))));
    let Some(first) = search.stages.first() else { return Ok(Vec::new()) };
    posterior.weight = first.weight;
    let drawn = best_of(posterior, points, first.followed)?;
    let mut left: Vec<(DVector<f64>, Option<DMatrix<f64>>)> = drawn.into_iter().map(|point| (point, None)).collect();
    let mut minima: Vec<Minimum> = Vec::new();
    for stage in search.stages {
        posterior.weight = stage.weight;
        left.truncate(stage.followed);
        minima.clear();
        for (start, derivatives) in left {
            posterior.turn_to(derivatives.as_ref());
            minima.extend(minimise(posterior, start, stage.steps));
        }
        sort(&mut minima);
        left = minima.iter().map(|minimum| (minimum.point.clone(), Some(minimum.derivatives.clone()))).collect();
    }
    Ok(minima)
}

/// Where the search ends.
struct Refined {
    /// The lowest of the minima.
    best: Minimum,
    /// All ensembles' members.
    members: Vec<DVector<f64>>,
}

/// From the lowest of the rough minima an ensemble each goes on to where the speeds count in full, and its best member down from there.
fn refine(posterior: &mut Posterior, rough: &[Minimum], draws: &mut Stream) -> Result<Option<Refined>, RobotError> {
    let counted = STAGES[STAGES.len() - 1].weight.powi(2);
    posterior.weight = 1.0;
    let (mut minima, mut all) = (Vec::new(), Vec::new());
    for minimum in rough.iter().take(REFINED) {
        let members = smooth(posterior, about(minimum, MEMBERS, draws), counted, draws)?;
        for best in best_of(posterior, members.clone(), 1)? {
            posterior.turn_to(Some(&minimum.derivatives));
            minima.extend(minimise(posterior, best, STEPS));
        }
        all.extend(members);
    }
    sort(&mut minima);
    Ok(minima.into_iter().next().map(|best| Refined { best, members: all }))
}

fn sort(minima: &mut [Minimum]) {
    minima.sort_by(|a, b| a.residuals.norm_squared().total_cmp(&b.residuals.norm_squared()));
}

/// The most probable of some points, at most so many; what cannot be simulated is none of them.
///
/// # Errors
/// Evaluations cannot be kept.
pub fn best_of(
    posterior: &mut Posterior,
    points: Vec<DVector<f64>>,
    most: usize,
) -> Result<Vec<DVector<f64>>, RobotError> {
    let speeds = posterior.speeds(&points)?;
    let mut judged: Vec<(f64, DVector<f64>)> = points
        .into_iter()
        .zip(speeds)
        .filter_map(|(point, speeds)| Some((posterior.residuals(&point, &speeds?).norm_squared(), point)))
        .collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(judged.into_iter().take(most).map(|(_, point)| point).collect())
}
