//! Models of a walk: the file's, and those with effects on top, at their most probable numbers.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use effects::Id;
use hal_sim::random::{Source, Stream};
use identify::least_squares::{Minimum, minimise};
use identify::robot::{Numbers, Posterior, RobotError, Run, Search, Stage, Table, best_of, rough_minima};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use robot_file::edit::Document;

use super::evidence::log_evidence;
use super::secant::Secant;

/// A search for where the refit of the file's model starts.
const STAGES: [Stage; 1] = [Stage { weight: 0.3, steps: 4, followed: 3 }];
/// The same for a model with effects that no fit has brought near the speeds.
const WIDE: [Stage; 1] = [Stage { weight: 0.3, steps: 3, followed: 2 }];
/// Steps to the refit of the file's model where the speeds count in full, at most.
const STEPS: usize = 5;
/// Steps of a fit whose derivatives follow from its own steps, at most.
const ROUGH_STEPS: usize = 12;
/// Steps with derivatives of their own that follow, at most.
pub const FEW_STEPS: usize = 2;
/// Steps after which a fit ends in any case.
pub const MANY_STEPS: usize = 6;
/// Of a screen: an effect's coordinates are moved by this.
const NUDGE: f64 = 0.5;
/// A one-sided coordinate starts no nearer to the absence of its effect: there it has no slope.
const OFF: f64 = 0.3;
/// A fit starts so far of the way to where a screen sees the model: where that comes nearest to the speeds.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.1];
/// A screen is not believed farther than so many deviations of the belief.
const FAR: f64 = 2.0;

/// What models are fitted to.
pub struct Bench<'a> {
    /// The robot file.
    pub document: &'a Document,
    /// What was measured.
    pub table: &'a Table,
    run: Run,
    keep_in: Option<PathBuf>,
    /// Told how many sets were simulated.
    told: &'a (dyn Fn(usize) + Sync),
    simulated: AtomicUsize,
    kept: Mutex<Vec<PathBuf>>,
}

/// A model at its most probable numbers.
pub struct Model {
    /// The effects that it has beyond the file's.
    pub effects: Vec<Id>,
    /// Its numbers.
    pub numbers: Numbers,
    /// The most probable of them.
    pub minimum: Minimum,
    /// Logarithm of its evidence, but for what all models of a table share.
    pub evidence: f64,
}

/// What an effect would do to a model, by derivatives at the model's numbers.
pub struct Screened {
    /// The effect.
    pub effect: Id,
    /// Most probable numbers of the model and the effect.
    point: DVector<f64>,
    /// Derivatives of the residuals by all of them.
    derivatives: DMatrix<f64>,
    /// Of the effect's numbers: paths, with how large they may be in the key's unit, at 95 %.
    pub largest: Vec<(String, f64)>,
    /// The effect's numbers that the speeds tell something of, each where it alone is free beside the model's.
    pub alone: Vec<Alone>,
}

/// A number of an effect where it alone is free beside the model's, and what is believed of it does not count.
pub struct Alone {
    /// In the robot file.
    pub path: String,
    /// Most probable, in the key's unit.
    pub value: f64,
    /// How many standard deviations that is from where the effect is absent.
    pub deviations: f64,
}

impl<'a> Bench<'a> {
    /// With what is simulated kept in files of a directory, if one is named.
    pub fn new(
        (document, table): (&'a Document, &'a Table),
        run: Run,
        keep_in: Option<PathBuf>,
        told: &'a (dyn Fn(usize) + Sync),
    ) -> Self {
        Self { document, table, run, keep_in, told, simulated: AtomicUsize::new(0), kept: Mutex::default() }
    }

    /// Sets of numbers simulated.
    pub fn simulated(&self) -> usize {
        self.simulated.load(Ordering::Relaxed)
    }

    /// The files in which that is kept.
    pub fn kept(&self) -> Vec<PathBuf> {
        let mut kept = self.kept.lock().map(|kept| kept.clone()).unwrap_or_default();
        kept.sort();
        kept.dedup();
        kept
    }

    /// Does something with the posterior of some numbers.
    pub fn with<T>(
        &self,
        numbers: &Numbers,
        work: impl FnOnce(&mut Posterior) -> Result<T, RobotError>,
    ) -> Result<T, RobotError> {
        let before = AtomicUsize::new(0);
        let told = |simulated: usize| {
            let new = simulated - before.swap(simulated, Ordering::Relaxed);
            (self.told)(self.simulated.fetch_add(new, Ordering::Relaxed) + new);
        };
        let mut posterior = Posterior::new((numbers, self.table), self.run, self.keep_in.as_deref(), &told)?;
        // What was simulated when the diagnosis was stopped does not count again.
        before.store(posterior.simulated(), Ordering::Relaxed);
        let done = work(&mut posterior)?;
        posterior.take_failure()?;
        if let Ok(mut kept) = self.kept.lock() {
            kept.extend(posterior.kept());
        }
        Ok(done)
    }

    /// The file's model, refitted.
    pub fn baseline(&self, draws: usize, random: &mut Stream) -> Result<Model, RobotError> {
        let numbers = Numbers::with_effects(self.document, &[])?;
        let minimum = self.with(&numbers, |posterior| {
            let origin = DVector::zeros(numbers.all.len());
            if posterior.speeds(std::slice::from_ref(&origin))?[0].is_none() {
                return Err(RobotError::CannotRun("a run blew up, or the step is too long for its springs".into()));
            }
            let rough = rough_minima(posterior, &Search { draws, stages: &STAGES }, random)?;
            posterior.weight = 1.0;
            Ok(rough.into_iter().next().and_then(|start| {
                posterior.turn_to(Some(&start.derivatives));
                minimise(posterior, start.point, STEPS)
            }))
        })?;
        let model = minimum.and_then(|minimum| Model::new(Vec::new(), numbers, minimum));
        model.ok_or_else(|| RobotError::CannotRun("the speeds do not depend on the file's numbers".into()))
    }

    /// The file's model at the file's own numbers: where an effect is large, the refit has gone astray.
    pub fn unfitted(&self) -> Result<Option<Model>, RobotError> {
        let numbers = Numbers::with_effects(self.document, &[])?;
        let minimum = self.with(&numbers, |posterior| Ok(minimise(posterior, DVector::zeros(numbers.all.len()), 0)))?;
        Ok(minimum.and_then(|minimum| Model::new(Vec::new(), numbers, minimum)))
    }

    /// What an effect would do to a model; none where nothing can be simulated with it.
    pub fn screen(&self, base: &Model, effect: Id) -> Result<Option<Screened>, RobotError> {
        let effects: Vec<Id> = base.effects.iter().copied().chain([effect]).collect();
        let numbers = Numbers::with_effects(self.document, &effects)?;
        let (start, places) = carried(base, &numbers);
        let slopes = self.with(&numbers, |posterior| slopes(posterior, &start, &base.minimum, &places))?;
        Ok(slopes.and_then(|derivatives| Screened::new(effect, &numbers, (&start, derivatives), base)))
    }

    /// A model with an effect on top, from where a screen sees it; its derivatives are an estimate.
    pub fn refit(&self, base: &Model, screened: &Screened) -> Result<Option<Model>, RobotError> {
        let effects: Vec<Id> = base.effects.iter().copied().chain([screened.effect]).collect();
        let numbers = Numbers::with_effects(self.document, &effects)?;
        let (there, _) = carried(base, &numbers);
        let minimum = self.with(&numbers, |posterior| {
            // The screen may reach too far.
            let starts = SHARES.map(|share| off(&numbers, &there + share * (&screened.point - &there)));
            let start = best_of(posterior, starts.to_vec(), 1)?.pop();
            Ok(start.and_then(|start| {
                minimise(&mut Secant::new(posterior, screened.derivatives.clone()), start, ROUGH_STEPS)
            }))
        })?;
        Ok(minimum.and_then(|minimum| Model::new(effects, numbers, minimum)))
    }

    /// A model with effects from wherever in what is believed its speeds come near: a valley that no fit has met so far.
    pub fn search(&self, effects: Vec<Id>, draws: usize, seed: u64) -> Result<Option<Model>, RobotError> {
        let numbers = Numbers::with_effects(self.document, &effects)?;
        let mut random = Stream::new(seed, Source::Variation);
        let minimum = self.with(&numbers, |posterior| {
            let rough = rough_minima(posterior, &Search { draws, stages: &WIDE }, &mut random)?;
            posterior.weight = 1.0;
            let ends = rough.into_iter().filter_map(|start| {
                let derivatives = in_full(&start, WIDE[0].weight);
                minimise(&mut Secant::new(posterior, derivatives), start.point, ROUGH_STEPS)
            });
            Ok(ends.min_by(|a, b| a.residuals.norm_squared().total_cmp(&b.residuals.norm_squared())))
        })?;
        Ok(minimum.and_then(|minimum| Model::new(effects, numbers, minimum)))
    }

    /// A model some steps further down, with derivatives of its own.
    pub fn go_on(&self, model: Model, steps: usize) -> Result<Model, RobotError> {
        let start = model.minimum.point.clone();
        self.go_on_from(start, model, steps)
    }

    /// The same from where a model with further effects ended, if that is lower.
    pub fn restart(&self, model: Model, other: &Model) -> Result<Model, RobotError> {
        let (start, _) = carried(other, &model.numbers);
        self.go_on_from(start, model, MANY_STEPS)
    }

    fn go_on_from(&self, start: DVector<f64>, model: Model, steps: usize) -> Result<Model, RobotError> {
        let minimum = self.with(&model.numbers, |posterior| {
            posterior.turn_to(Some(&model.minimum.derivatives));
            Ok(minimise(posterior, start, steps))
        })?;
        let lower = minimum.filter(|found| found.residuals.norm_squared() <= model.minimum.residuals.norm_squared());
        Ok(match lower.and_then(|minimum| Some((log_evidence(&minimum, &model.numbers)?, minimum))) {
            Some((evidence, minimum)) => Model { evidence, minimum, ..model },
            None => model,
        })
    }
}

impl Model {
    fn new(effects: Vec<Id>, numbers: Numbers, minimum: Minimum) -> Option<Self> {
        let evidence = log_evidence(&minimum, &numbers)?;
        Some(Self { effects, numbers, minimum, evidence })
    }
}

/// A model's numbers among those of one that extends it, with the others at what is believed of them; and their places.
fn carried(base: &Model, numbers: &Numbers) -> (DVector<f64>, Vec<Option<usize>>) {
    let place = |path: &str| base.numbers.all.iter().position(|one| one.path == path);
    let places: Vec<Option<usize>> = numbers.all.iter().map(|one| place(&one.path)).collect();
    let at = places.iter().map(|place| place.map_or(0.0, |place| base.minimum.point[place]));
    (DVector::from_iterator(places.len(), at), places)
}

/// Derivatives that were taken where the speeds counted for a share, as they are where these count in full.
fn in_full(minimum: &Minimum, weight: f64) -> DMatrix<f64> {
    let mut derivatives = minimum.derivatives.clone();
    let rows = minimum.residuals.len() - minimum.point.len();
    derivatives.rows_mut(0, rows).scale_mut(1.0 / weight);
    derivatives
}

/// One-sided coordinates away from where they have no slope.
fn off(numbers: &Numbers, mut point: DVector<f64>) -> DVector<f64> {
    for (at, number) in point.iter_mut().zip(&numbers.all) {
        if number.is_one_sided() && at.abs() < OFF {
            *at = OFF;
        }
    }
    point
}

/// Derivatives of the residuals by a model's numbers, which are known, and by those of the effect, which are simulated.
fn slopes(
    posterior: &mut Posterior,
    start: &DVector<f64>,
    known: &Minimum,
    places: &[Option<usize>],
) -> Result<Option<DMatrix<f64>>, RobotError> {
    let count = start.len();
    let rows = known.residuals.len() - known.point.len();
    let moved = |k: usize, by: f64| {
        let mut point = start.clone();
        point[k] += by;
        point
    };
    let mut derivatives = DMatrix::zeros(rows + count, count);
    for (k, place) in places.iter().enumerate() {
        derivatives[(rows + k, k)] = 1.0;
        if let Some(place) = place {
            derivatives.view_mut((0, k), (rows, 1)).copy_from(&known.derivatives.view((0, *place), (rows, 1)));
            continue;
        }
        let sides = if posterior.numbers.all[k].is_one_sided() { [0.0, NUDGE] } else { [-NUDGE, NUDGE] };
        let points = sides.map(|by| moved(k, by));
        let speeds = posterior.speeds(&points)?;
        let [Some(below), Some(above)] = &speeds[..] else { return Ok(None) };
        let change = posterior.residuals(&points[1], above) - posterior.residuals(&points[0], below);
        let slope = change.rows(0, rows) / (sides[1] - sides[0]);
        derivatives.view_mut((0, k), (rows, 1)).copy_from(&slope);
    }
    Ok(Some(derivatives))
}

impl Screened {
    fn new(
        effect: Id,
        numbers: &Numbers,
        (start, derivatives): (&DVector<f64>, DMatrix<f64>),
        base: &Model,
    ) -> Option<Self> {
        let count = start.len();
        let rows = base.minimum.residuals.len() - base.minimum.point.len();
        let mut residuals = DVector::zeros(rows + count);
        residuals.rows_mut(0, rows).copy_from(&base.minimum.residuals.rows(0, rows));
        residuals.rows_mut(rows, count).copy_from(start);
        let normal = derivatives.tr_mul(&derivatives);
        let gradient = derivatives.tr_mul(&residuals);
        let moves = moves(numbers, &normal, &gradient)?;
        let point = start + moves;
        let covariance = Cholesky::new(normal)?.inverse();
        let own = (0..count).filter(|k| numbers.all[*k].is_of(effect));
        let largest = own.map(|k| {
            let number = &numbers.all[k];
            let far = point[k].abs() + crate::walk::outcome::Z95 * covariance[(k, k)].sqrt();
            // Of a number that is 1 without the effect, how far from it; the larger side of a logarithm.
            (number.path.clone(), (number.at(far) - number.file).abs())
        });
        let largest = largest.collect();
        let residuals = residuals.rows(0, rows).clone_owned();
        let own = (0..count).filter(|k| numbers.all[*k].is_of(effect));
        let known = Cholesky::new(base.minimum.derivatives.tr_mul(&base.minimum.derivatives))?;
        let alone = own.filter_map(|k| {
            let slope = derivatives.view((0, k), (rows, 1)).column(0).clone_owned();
            let (moved, deviations) = score(&slope, &residuals, (&base.minimum.derivatives, &known))?;
            let number = &numbers.all[k];
            Some(Alone { path: number.path.clone(), value: number.at((start[k] + moved).clamp(-FAR, FAR)), deviations })
        });
        let alone = alone.collect();
        let far = point.map(|at| at.clamp(-FAR, FAR));
        Some(Self { effect, point: far, derivatives, largest, alone })
    }
}

/// How far one more number moves from a minimum, whose own numbers follow, and how many standard deviations that is; none where its
/// derivatives by the deviations are those of the others.
fn score(
    slope: &DVector<f64>,
    residuals: &DVector<f64>,
    (derivatives, normal): (&DMatrix<f64>, &Cholesky<f64, Dyn>),
) -> Option<(f64, f64)> {
    let towards = derivatives.rows(0, slope.len()).tr_mul(slope);
    let all = slope.norm_squared();
    let information = all - towards.dot(&normal.solve(&towards));
    if information <= 1e-9 * all {
        return None;
    }
    let moved = -slope.dot(residuals) / information;
    Some((moved, moved * information.sqrt()))
}

/// To the most probable point by derivatives alone, with one-sided numbers that would go below 0 left there.
fn moves(numbers: &Numbers, normal: &DMatrix<f64>, gradient: &DVector<f64>) -> Option<DVector<f64>> {
    let count = gradient.len();
    let mut free: Vec<usize> = (0..count).collect();
    loop {
        let pick = DMatrix::from_fn(free.len(), free.len(), |i, j| normal[(free[i], free[j])]);
        let slope = DVector::from_fn(free.len(), |i, _| gradient[free[i]]);
        let step = -Cholesky::new(pick)?.solve(&slope);
        let below = |i: &usize| numbers.all[free[*i]].is_one_sided() && step[*i] < 0.0;
        match (0..free.len()).filter(below).min_by(|a, b| step[*a].total_cmp(&step[*b])) {
            Some(worst) => {
                free.remove(worst);
            }
            None => {
                let mut moves = DVector::zeros(count);
                free.iter().zip(step.iter()).for_each(|(k, step)| moves[*k] = *step);
                return Some(moves);
            }
        }
    }
}
