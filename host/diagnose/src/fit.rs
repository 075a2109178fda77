//! Least squares over all rollouts of the fit runs: the numbers jointly with every segment's start.
//!
//! Levenberg-Marquardt on the numbers. The two unknowns of each segment's start enter no other segment, so they are
//! eliminated from the normal equations (arrow structure) and follow from back substitution. Sensitivities are finite
//! differences of whole runs.

use effects::{Id, Scale};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::covariance;
use super::current::{count_of_currents, current_residuals};
use super::model::Plant;
use super::nominal::FileModel;
use super::normal_equations::{self, SegmentEquations};
use super::numbers::{Free, Number};
use super::probe::{Probe, Shape};
use super::rollout::{self, Rolled, Starts};
use super::track::Track;

/// What is fitted to.
pub struct Data<'a> {
    /// Runs, cut into segments.
    pub tracks: &'a [Track],
    /// Standard deviation of the angle reading, rad.
    pub sigma: f64,
    /// Standard deviation of the current reading, A; `None` where it is not fitted to.
    pub sigma_current: Option<f64>,
}

/// Standard deviations to the ends of a 95 % interval.
pub const WIDE: f64 = 1.96;
/// A number that is no farther from its start than this share of its prior's standard deviation was not moved.
const STAYS: f64 = 0.01;
/// See [`Fit::strayed`].
const AT_ODDS: f64 = 2.0;

/// A fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Effects added to the file's model.
    pub effects: Vec<Id>,
    /// A term over one coordinate that no effect has.
    pub curve: Option<Shape>,
    /// The numbers that were moved, the file's own before those of the added effects, and those before the curve's.
    pub free: Vec<Free>,
    /// How many are the file's own.
    pub of_file: usize,
    /// Their coordinates.
    pub coordinates: Vec<f64>,
    /// Starts of the segments.
    pub starts: Starts,
    /// Sum of squares, in units of sigma², prior included: see [`misfit`].
    pub cost: f64,
    /// Covariance of the coordinates: see [`super::covariance`].
    pub covariance: DMatrix<f64>,
}

impl Fit {
    /// Begins with the file's model and added effects, at one of their starting points.
    #[must_use]
    pub fn begin(model: &FileModel, effects: &[Id], start: usize, starts: Starts) -> Self {
        let free = model.with(effects, start);
        let coordinates: Vec<f64> = free.iter().map(|one| one.coordinate(one.start)).collect();
        let covariance = DMatrix::zeros(free.len(), free.len());
        Self {
            effects: effects.to_vec(),
            curve: None,
            of_file: model.own_numbers(),
            free,
            coordinates,
            starts,
            cost: f64::INFINITY,
            covariance,
        }
    }

    /// Takes over what another fit found for the numbers that both have.
    pub fn take_over(&mut self, other: &Fit) {
        for (i, one) in self.free.iter().enumerate() {
            if let Some(j) = other.free.iter().position(|known| known.number == one.number) {
                self.coordinates[i] = other.coordinates[j];
            }
        }
    }

    /// The same model with the file's own numbers, for others to begin from.
    #[must_use]
    pub fn at_file_numbers(&self) -> Self {
        let mut file = self.clone();
        for (one, at) in file.free.iter().zip(&mut file.coordinates).take(file.of_file) {
            *at = one.coordinate(one.start);
        }
        file
    }

    /// The same fit with those numbers of another that it has not, for others to begin from.
    #[must_use]
    pub fn knowing(&self, other: &Fit) -> Self {
        let mut both = self.clone();
        for (one, coordinate) in other.free.iter().zip(&other.coordinates) {
            if self.free.iter().all(|own| own.number != one.number) {
                both.free.push(*one);
                both.coordinates.push(*coordinate);
            }
        }
        both
    }

    /// The same fit without an effect and the numbers that are its alone, for others to begin from.
    #[must_use]
    pub fn without(&self, model: &FileModel, effect: Id) -> Self {
        let mut rest = self.clone();
        rest.effects.retain(|one| *one != effect);
        let others: Vec<usize> = rest.effects.iter().flat_map(|&other| model.numbers_of(other, self)).collect();
        let own = model.numbers_of(effect, self);
        let stays = |place: usize| !own.contains(&place) || others.contains(&place);
        let kept: Vec<usize> = (0..self.free.len()).filter(|&place| stays(place)).collect();
        rest.free = kept.iter().map(|&place| self.free[place]).collect();
        rest.coordinates = kept.iter().map(|&place| self.coordinates[place]).collect();
        rest
    }

    /// The same fit with a curve of which there is nothing yet.
    #[must_use]
    pub fn with_curve(&self, shape: Shape) -> Self {
        let mut with = self.clone();
        with.curve = Some(shape);
        with.free.extend((0..shape.terms()).map(|term| Free::of_curve(term, shape.of_torques())));
        with.coordinates.resize(with.free.len(), 0.0);
        with
    }

    /// Takes over what another fit found and holds it there.
    pub fn hold(&mut self, other: &Fit) {
        self.take_over(other);
        for (one, coordinate) in self.free.iter_mut().zip(&self.coordinates) {
            if other.free.iter().any(|known| known.number == one.number) {
                let value = one.number(*coordinate);
                (one.low, one.high) = (value, value);
            }
        }
    }

    /// Whether a number of the file is at odds with what it says, by more than [`AT_ODDS`] of the standard deviation of its
    /// prior.
    #[must_use]
    pub fn strayed(&self) -> bool {
        self.free.iter().zip(&self.coordinates).take(self.of_file).any(|(one, at)| one.off_prior(*at).abs() > AT_ODDS)
    }

    /// How many of resistance, torque constant and inertia have run to the end of what a fit tries: five times or a fifth of
    /// what the file says. They say nothing then, and the model is not where it should be.
    #[must_use]
    pub fn at_bounds(&self) -> usize {
        let at_bound = |(one, at): &(&Free, &f64)| {
            let motor = matches!(one.number, Number::Resistance | Number::TorqueConstant | Number::Inertia);
            motor && (**at <= one.coordinate(one.low) + 1e-6 || **at >= one.coordinate(one.high) - 1e-6)
        };
        self.free.iter().zip(&self.coordinates).filter(at_bound).count()
    }

    /// Whether one of the numbers that say how large an effect is has a 95 % interval that does not touch zero, were the scale of
    /// torques known: what is known of it but in ratio is there all the same. An effect without such a number, a spring that is
    /// stiff where it is absent, has a shape that does not touch its last value.
    #[must_use]
    pub fn has_size(&self, model: &FileModel, effect: Id) -> bool {
        let (sizes, shapes) = self.sizes_and_shapes(model, effect);
        if sizes.is_empty() {
            let last = |place: usize| self.free[place].coordinate(self.free[place].high);
            // What a prior holds is away from its last value whatever the data say.
            let apart = |place: usize| {
                self.free[place].prior.is_infinite()
                    && (self.coordinates[place] - last(place)).abs() > WIDE * self.deviation_at_scale(place, &[])
            };
            return shapes.into_iter().any(apart);
        }
        sizes.into_iter().any(|place| self.is_apart_from_zero(place, &[]))
    }

    /// The same where the numbers of the effect's shape are known, too: a high and narrow patch of friction and a low and wide one may
    /// be one to the data, and the interval of its height then reaches beyond zero although no patch at all is ruled out.
    #[must_use]
    pub fn has_size_in_its_shape(&self, model: &FileModel, effect: Id) -> bool {
        let (sizes, shapes) = self.sizes_and_shapes(model, effect);
        sizes.into_iter().any(|place| self.is_apart_from_zero(place, &shapes)) || self.has_size(model, effect)
    }

    /// Places of an effect's numbers: those that say how large it is, and the others. Of an effect that contains one of the file's, what
    /// that has already is no size: of Stribeck friction where the file has Coulomb friction, the sliding level.
    fn sizes_and_shapes(&self, model: &FileModel, effect: Id) -> (Vec<usize>, Vec<usize>) {
        let (sizes, shapes): (Vec<usize>, Vec<usize>) =
            model.numbers_of(effect, self).into_iter().partition(|&place| self.free[place].is_size());
        (sizes.into_iter().filter(|&place| place >= self.of_file).collect(), shapes)
    }

    /// Whether a number's 95 % interval does not touch zero, were the scale of torques and some others known.
    #[must_use]
    pub fn is_apart_from_zero(&self, place: usize, known: &[usize]) -> bool {
        self.coordinates[place].abs() > WIDE * self.deviation_at_scale(place, known)
    }

    /// How many numbers of added effects the fit moved, which are those that count where models of different size are compared: one that
    /// the data say nothing of stays where its prior has it.
    #[must_use]
    pub fn numbers_moved(&self) -> usize {
        let is_moved = |(one, at): &(&Free, &f64)| one.prior.is_infinite() || one.off_prior(**at).abs() > STAYS;
        self.free.iter().zip(&self.coordinates).skip(self.of_file).filter(is_moved).count()
    }

    /// How far the numbers are from where their priors have them, in squares of the priors' deviations.
    #[must_use]
    pub fn off_prior(&self) -> f64 {
        let off = |(one, at): (&Free, &f64)| one.off_prior(*at).powi(2);
        self.free.iter().zip(&self.coordinates).map(off).sum()
    }

    /// The model with the fitted numbers.
    #[must_use]
    pub fn plant(&self, model: &FileModel) -> Plant {
        self.plant_at(model, &self.coordinates)
    }

    /// How far the numbers' coordinates may be off, drawn from what the fit knows of them, again and again.
    pub fn drawn_offsets(&self, random: &mut Pcg64Mcg) -> impl Iterator<Item = DVector<f64>> {
        let spread = self.covariance.clone().symmetric_eigen();
        let deviations = spread.eigenvalues.map(|variance| variance.max(0.0).sqrt());
        std::iter::repeat_with(move || {
            let along = deviations.map(|deviation| deviation * random.sample::<f64, _>(StandardNormal));
            &spread.eigenvectors * along
        })
    }

    /// The model with numbers drawn from what the fit knows of them, so many standard deviations as wide, again and again.
    pub fn drawn_plants(&self, model: &FileModel, share: f64, random: &mut Pcg64Mcg) -> impl Iterator<Item = Plant> {
        self.drawn_offsets(random).map(move |off| {
            let drawn = |((one, at), off): ((&Free, &f64), &f64)| {
                // No number is known less than before the fit.
                let drawn = at + (share * off).clamp(-one.prior, one.prior);
                drawn.clamp(one.coordinate(one.low), one.coordinate(one.high))
            };
            let coordinates: Vec<f64> = self.free.iter().zip(&self.coordinates).zip(&off).map(drawn).collect();
            self.plant_at(model, &coordinates)
        })
    }

    /// The model with its numbers at some coordinates.
    fn plant_at(&self, model: &FileModel, coordinates: &[f64]) -> Plant {
        let plant = model.plant(&self.effects, &self.free, coordinates);
        match self.curve {
            Some(shape) => {
                let terms = coordinates[self.free.len() - shape.terms()..].to_vec();
                plant.with_probe(Probe { shape, terms })
            }
            None => plant,
        }
    }

    /// The value of a number that was moved, SI units and radians.
    #[must_use]
    pub fn value(&self, number: Number) -> Option<f64> {
        let place = self.free.iter().position(|one| one.number == number)?;
        Some(self.free[place].number(self.coordinates[place]))
    }

    /// Standard deviation of the coordinate at `index` in the order of the free ones, in the coordinate's unit.
    #[must_use]
    pub fn deviation(&self, index: usize) -> f64 {
        self.covariance[(index, index)].max(0.0).sqrt()
    }

    /// The same if the resistance and some others were known: the conditional one of a normal distribution. Angle and drive alone show
    /// torques, inertias and currents but for one factor, see [`super::scale_free`], which follows from the resistance.
    fn deviation_at_scale(&self, index: usize, known: &[usize]) -> f64 {
        let scale = self.free.iter().position(|one| one.number == Number::Resistance);
        let open = |&place: &usize| place != index && self.covariance[(place, place)] > 0.0;
        let known: Vec<usize> = known.iter().copied().chain(scale).filter(open).collect();
        let between = DMatrix::from_fn(known.len(), known.len(), |i, j| self.covariance[(known[i], known[j])]);
        let with = DVector::from_fn(known.len(), |i, _| self.covariance[(known[i], index)]);
        let shared = between.cholesky().map_or(0.0, |factor| with.dot(&factor.solve(&with)));
        (self.covariance[(index, index)] - shared).max(0.0).sqrt()
    }
}

/// Normal equations after the starts are eliminated, and what back substitution needs.
struct Reduced {
    /// The data's curvature and the prior's.
    matrix: DMatrix<f64>,
    /// The prior's alone, on the diagonal.
    prior: Vec<f64>,
    /// See [`misfit`].
    misfit: f64,
    gradient: DVector<f64>,
    /// Of each segment, by track.
    segments: Vec<Vec<SegmentEquations>>,
}

/// When a fit ends.
#[derive(Clone, Copy, Debug)]
pub struct Until {
    /// After this many rounds.
    pub rounds: usize,
    /// Where a round lowers the cost by less than this share of it, or can promise no more.
    pub tolerance: f64,
    /// Where the cost is still above this after [`FIRST_ROUNDS`].
    pub far: f64,
    /// Where the cost would stay above this if it fell by [`HOPED`] times what the linear model promises after the first round.
    pub beaten: f64,
    /// Whether it goes on from there with sensitivities of [`Followed::FromOneBefore`], if these are another thing.
    pub follow_on: bool,
}

impl Until {
    /// After rounds, or where the cost falls by less than a share of it.
    #[must_use]
    pub fn settled(rounds: usize, tolerance: f64) -> Self {
        Self { rounds, tolerance, far: f64::INFINITY, beaten: f64::INFINITY, follow_on: true }
    }

    /// The same, or where what another fit has reached is out of reach: a cost.
    #[must_use]
    pub fn beaten(self, beaten: f64) -> Self {
        Self { beaten, ..self }
    }
}

/// From where sensitivities follow what no sensor sees where teeth between motor and load meet and part. How a touch that comes a hair
/// earlier changes all that follows is no slope that a step could take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Followed {
    /// From each segment's start: a fit finds its way from far.
    WithinSegment,
    /// From the start of the segment before: where a fit ends, with what is known of its numbers.
    FromOneBefore,
}

/// Rounds after which a fit that is far off is given up.
const FIRST_ROUNDS: usize = 3;
/// A fit may find this many times what the linear model promises.
const HOPED: f64 = 4.0;
/// Of the first step, and of the first with other sensitivities.
const FIRST_DAMPING: f64 = 1e-3;
/// Steps that a round tries, each shorter than the one before.
const ATTEMPTS: usize = 6;
/// Sensitivities are kept for a further step where the last one brought this share of what the linear model promised.
const HOLDS_GOOD: f64 = 0.5;

/// Fits from a start.
///
/// Sensitivities cost as many rollouts as there are numbers, a step costs one: they are kept while the linear model holds good
/// (Shamanskii's method: C. T. Kelley, "Iterative methods for linear and nonlinear equations", 1995, section 5.4.2), and made
/// anew before the fit ends. Only rounds that make them count.
pub fn fit(model: &FileModel, data: &Data, start: Fit, until: Until) -> Fit {
    descend(Descent::begin(model, model, data, start), until)
}

/// Fits on with an integrator in small steps from where a fit has ended. Residuals are those of small steps; sensitivities, for which
/// the usual steps are good enough, are not (defect correction: K. Böhmer, P. Hemker, H. Stetter, "The defect correction approach",
/// Computing Supplementum 5, 1984).
#[must_use]
pub fn in_small_steps(model: &FileModel, data: &Data, start: Fit, until: Until) -> Fit {
    descend(Descent::begin(&model.in_small_steps(), model, data, start), until)
}

fn descend(mut descent: Descent, until: Until) -> Fit {
    let mut kept: Option<Vec<Columns>> = None;
    let mut equations = None;
    let mut rounds = 0;
    loop {
        let is_new = kept.is_none();
        if is_new && (rounds == until.rounds || (rounds >= FIRST_ROUNDS && descent.best.cost > until.far)) {
            break;
        }
        rounds += usize::from(is_new);
        let columns = kept.take().unwrap_or_else(|| descent.sensitivities());
        let linear = equations.insert(linearise(descent.data, &descent.best, &descent.rolled, &columns));
        let promised = promise(&descent.best, linear);
        let nothing_left = promised <= until.tolerance * descent.best.cost;
        if !is_new && nothing_left {
            continue;
        }
        if is_new && rounds > 1 && descent.best.cost - HOPED * promised > until.beaten {
            break;
        }
        let fall = descent.step(linear, is_new, nothing_left);
        if fall >= HOLDS_GOOD * promised {
            kept = Some(columns);
        }
        if is_new && fall <= until.tolerance * descent.best.cost && !(until.follow_on && descent.follow_on()) {
            break;
        }
    }
    let mut best = descent.best;
    if let Some(equations) = equations {
        let Reduced { matrix, prior, misfit, segments, .. } = &equations;
        best.covariance = covariance::of(matrix, prior, *misfit, segments.iter().flatten());
    }
    best
}

/// A fit on its way down.
struct Descent<'a> {
    model: &'a FileModel,
    /// What sensitivities are taken from.
    linearised: &'a FileModel,
    data: &'a Data<'a>,
    best: Fit,
    /// Its rollouts.
    rolled: Vec<Rolled>,
    damping: f64,
    followed: Followed,
    /// Over a hole, a rollout may have lost a turn: then other starts may do what the linear model does not promise.
    has_holes: bool,
}

impl<'a> Descent<'a> {
    fn begin(model: &'a FileModel, linearised: &'a FileModel, data: &'a Data, mut best: Fit) -> Self {
        let rolled = roll_all(model, data, &best);
        best.cost = cost(data, &best, &rolled);
        let has_holes = data.tracks.iter().any(|track| track.segments.iter().any(|segment| !segment.whole));
        Self {
            model,
            linearised,
            data,
            best,
            rolled,
            damping: FIRST_DAMPING,
            followed: Followed::WithinSegment,
            has_holes,
        }
    }

    fn sensitivities(&self) -> Vec<Columns> {
        if std::ptr::eq(self.model, self.linearised) {
            return columns_of(self.model, self.data, &self.best, &self.rolled, self.followed, Vec::new());
        }
        let rolled = roll_all(self.linearised, self.data, &self.best);
        columns_of(self.linearised, self.data, &self.best, &rolled, self.followed, Vec::new())
    }

    /// Takes sensitivities from farther back from now on, if that is another thing; whether it is.
    fn follow_on(&mut self) -> bool {
        let more = self.followed == Followed::WithinSegment && self.best.plant(self.model).has_play();
        if more {
            (self.followed, self.damping) = (Followed::FromOneBefore, FIRST_DAMPING);
        }
        more
    }

    /// Tries steps of a linear model, each more damped than the one before, until one lowers the cost; by how much it did. Of an
    /// old model only one step is tried. Where it promises nothing, a step may still find more than it knows of, but only where
    /// there are holes.
    fn step(&mut self, equations: &Reduced, is_new: bool, nothing_left: bool) -> f64 {
        if nothing_left && !self.has_holes {
            return 0.0;
        }
        let attempts = if nothing_left || !is_new { 1 } else { ATTEMPTS };
        for attempt in 0..attempts {
            let (trial, rolled) = self.trial(equations, is_new && attempt % 2 == 0);
            if trial.cost < self.best.cost {
                let fall = self.best.cost - trial.cost;
                (self.best, self.rolled) = (trial, rolled);
                self.damping = (self.damping * 0.1).max(1e-7);
                return fall;
            }
            self.damping *= if is_new { 10.0 } else { 1.0 };
        }
        0.0
    }

    /// A step and its rollouts. The starts that went with the old numbers, or a linear step from them, may not suit the new ones:
    /// where they do not, they are refined if that is asked for.
    fn trial(&self, equations: &Reduced, refine: bool) -> (Fit, Vec<Rolled>) {
        let (model, data) = (self.model, self.data);
        let mut trial = step(&self.best, equations, self.damping);
        let mut rolled = roll_all(model, data, &trial);
        trial.cost = cost(data, &trial, &rolled);
        if trial.cost >= self.best.cost && refine {
            let guess = [self.best.starts.clone()];
            let refined = rollout::refine_all(&trial.plant(model), data.tracks, &mut trial.starts, &guess, 1);
            rolled = if data.sigma_current.is_some() {
                roll_all(model, data, &trial)
            } else {
                refined.into_iter().map(|(rolled, _)| rolled).collect()
            };
            trial.cost = cost(data, &trial, &rolled);
        }
        (trial, rolled)
    }
}

/// The rollouts of a fit's model from its starts.
pub fn roll_all(model: &FileModel, data: &Data, fit: &Fit) -> Vec<Rolled> {
    let plant = fit.plant(model);
    data.tracks
        .par_iter()
        .zip(&fit.starts)
        .map(|(track, starts)| rollout::rollout(&plant, track, starts, None, with_current(data, track)))
        .collect()
}

pub(super) fn with_current(data: &Data, track: &Track) -> bool {
    data.sigma_current.is_some() && !track.current.is_empty()
}

/// The cost of a fit as it stands.
#[must_use]
pub fn cost_of(model: &FileModel, data: &Data, fit: &Fit) -> f64 {
    cost(data, fit, &roll_all(model, data, fit))
}

fn cost(data: &Data, fit: &Fit, rolled: &[Rolled]) -> f64 {
    let squares = squares(data, rolled);
    let cost = squares + misfit(data, squares) * fit.off_prior();
    if cost.is_finite() { cost } else { f64::INFINITY }
}

/// Sum of squares of what rollouts leave, in units of sigma².
#[must_use]
pub fn squares(data: &Data, rolled: &[Rolled]) -> f64 {
    let mut sum = 0.0;
    for (track, rolled) in data.tracks.iter().zip(rolled) {
        sum += rollout::squared_errors(track, &rolled.readings).iter().sum::<f64>() / data.sigma.powi(2);
        if let (Some(sigma), false) = (data.sigma_current, rolled.currents.is_empty()) {
            sum += current_residuals(track, rolled).map(|(_, r)| (r / sigma).powi(2)).sum::<f64>();
        }
    }
    sum
}

/// A plant with one number moved, and by how much; `None` for a number that is held.
pub type Moved = Option<(Plant, f64)>;

/// How the readings and currents of a track change with each of its starts' two unknowns and with each number.
pub type Columns = Vec<(Vec<f64>, Vec<f64>)>;

/// How far the two ways of [`tie_scale`] may be apart, in RMS of the column: a finite difference is no better.
const SAME_COLUMN: f64 = 0.02;

/// The [`Columns`] of every track: the starts' two, those of a fit's numbers, and of further plants.
pub fn columns_of(
    model: &FileModel,
    data: &Data,
    fit: &Fit,
    rolled: &[Rolled],
    followed: Followed,
    further: impl IntoIterator<Item = Moved>,
) -> Vec<Columns> {
    let moved: Vec<Moved> = moved(model, fit).into_iter().chain(further).collect();
    let mut columns = sensitivities(data, &fit.plant(model), &fit.starts, rolled, followed, &moved);
    tie_scale(data, fit, &mut columns);
    columns
}

/// Makes the column of the resistance of those of the numbers that it scales. Angle and drive do not show the scale of torques: a
/// resistance that grows with all torques and inertias falling as it does changes nothing. The finite differences of the columns add
/// up to that but for their own errors, which many readings would make a knowledge of the scale that nobody has. Where something in the
/// model does show it, a current that was read, a winding that warms, the columns do not add up and stay.
fn tie_scale(data: &Data, fit: &Fit, columns: &mut [Columns]) {
    let Some(place) = fit.free.iter().position(|one| one.number == Number::Resistance) else { return };
    let along: Vec<f64> = fit.free.iter().zip(&fit.coordinates).map(|(one, at)| one.along_scale(*at)).collect();
    let is_held = fit.free.iter().zip(&along).any(|(one, along)| one.held() && *along != 0.0);
    if is_held || fit.free[place].held() || data.tracks.iter().any(|track| with_current(data, track)) {
        return;
    }
    let tied = |columns: &Columns| -> Vec<f64> {
        let mut sum = vec![0.0; columns[2 + place].0.len()];
        for (number, along) in along.iter().enumerate().filter(|(number, along)| *number != place && **along != 0.0) {
            for (sum, value) in sum.iter_mut().zip(&columns[2 + number].0) {
                *sum -= along * value;
            }
        }
        sum
    };
    let tied: Vec<Vec<f64>> = columns.par_iter().map(tied).collect();
    let (mut apart, mut all) = (0.0, 0.0);
    for (tied, columns) in tied.iter().zip(columns.iter()) {
        for (tied, own) in tied.iter().zip(&columns[2 + place].0) {
            apart += (tied - own).powi(2);
            all += own.powi(2);
        }
    }
    if apart <= SAME_COLUMN * SAME_COLUMN * all {
        for (tied, columns) in tied.into_iter().zip(columns) {
            columns[2 + place].0 = tied;
        }
    }
}

/// The [`Columns`] of every track: the starts' two, then those of some plants.
pub fn sensitivities(
    data: &Data,
    base: &Plant,
    starts: &Starts,
    rolled: &[Rolled],
    followed: Followed,
    moved: &[Moved],
) -> Vec<Columns> {
    let width = moved.len() + 2;
    let tasks: Vec<(usize, usize)> =
        (0..data.tracks.len()).flat_map(|track| (0..width).map(move |column| (track, column))).collect();
    let mut columns: Vec<(Vec<f64>, Vec<f64>)> = tasks
        .par_iter()
        .map(|&(index, column)| {
            let (track, starts, rolled) = (&data.tracks[index], &starts[index], &rolled[index]);
            if column < 2 {
                return (rollout::start_column(base, track, starts, rolled, column), Vec::new());
            }
            number_column(data, base, track, starts, rolled, followed, &moved[column - 2])
        })
        .collect();
    let mut tracks = Vec::with_capacity(data.tracks.len());
    while !columns.is_empty() {
        let rest = columns.split_off(width);
        tracks.push(std::mem::replace(&mut columns, rest));
    }
    tracks
}

fn number_column(
    data: &Data,
    base: &Plant,
    track: &Track,
    starts: &[[f64; 2]],
    rolled: &Rolled,
    followed: Followed,
    moved: &Moved,
) -> (Vec<f64>, Vec<f64>) {
    let Some((plant, delta)) = moved else {
        return (vec![0.0; rolled.readings.len()], vec![0.0; rolled.currents.len()]);
    };
    if plant.moves_like(base) {
        return (reading_column(base, plant, rolled, *delta), vec![0.0; rolled.currents.len()]);
    }
    let hidden = plant.has_play().then(|| match followed {
        Followed::WithinSegment => rollout::hidden_as_begun(plant, base, rolled),
        Followed::FromOneBefore => rollout::hidden_from_one_before(plant, base, track, starts, rolled),
    });
    let mut out = rollout::rollout(plant, track, starts, hidden.as_deref(), with_current(data, track));
    for (value, base) in out.readings.iter_mut().zip(&rolled.readings) {
        *value = (*value - base) / delta;
    }
    for (value, base) in out.currents.iter_mut().zip(&rolled.currents) {
        *value = (*value - base) / delta;
    }
    (out.readings, out.currents)
}

/// The plants with each of a fit's numbers moved by its finite difference.
fn moved(model: &FileModel, fit: &Fit) -> Vec<Moved> {
    (0..fit.free.len())
        .map(|i| {
            if fit.free[i].held() {
                return None;
            }
            let delta = fit.free[i].difference(fit.coordinates[i]);
            let mut coordinates = fit.coordinates.clone();
            coordinates[i] += delta;
            Some((fit.plant_at(model, &coordinates), delta))
        })
        .collect()
}

fn linearise(data: &Data, fit: &Fit, rolled: &[Rolled], columns: &[Columns]) -> Reduced {
    let size = fit.free.len();
    let squares = squares(data, rolled);
    let weight = prior_weight(data, squares, fit);
    let of_track = |(index, columns): (usize, &Columns)| {
        normal_equations::of_segments(data, &data.tracks[index], &rolled[index], columns).collect()
    };
    let segments: Vec<Vec<SegmentEquations>> = columns.par_iter().enumerate().map(of_track).collect();
    let mut reduced = Reduced {
        matrix: DMatrix::zeros(size, size),
        prior: fit.free.iter().map(|one| weight * one.prior.powi(-2)).collect(),
        misfit: misfit(data, squares),
        gradient: DVector::zeros(size),
        segments,
    };
    // Track by track: in another order sums differ in their last digits, and where a fit has several valleys these decide.
    for track in &reduced.segments {
        reduced.matrix += track.iter().fold(DMatrix::zeros(size, size), |sum, segment| sum + &segment.matrix);
        for segment in track {
            reduced.gradient += &segment.gradient;
        }
    }
    for (i, one) in fit.free.iter().enumerate() {
        let precision = reduced.prior[i];
        reduced.matrix[(i, i)] += precision;
        reduced.gradient[i] -= precision * (fit.coordinates[i] - one.coordinate(one.start));
    }
    reduced
}

/// The column of a number that changes the readings and not the motion.
fn reading_column(base: &Plant, moved: &Plant, rolled: &Rolled, delta: f64) -> Vec<f64> {
    rolled.wipers.iter().map(|wiper| (moved.reading(*wiper) - base.reading(*wiper)) / delta).collect()
}

/// The change of the numbers that a damped linear model asks for, and the gradient that it follows; `None` where the equations
/// leave it open. Numbers that stand at a bound and are pulled beyond it stay there: they leave the equations.
fn change(fit: &Fit, equations: &Reduced, damping: f64) -> (Option<DVector<f64>>, DVector<f64>) {
    let size = fit.free.len();
    let mut matrix = equations.matrix.clone();
    for i in 0..size {
        matrix[(i, i)] += damping * matrix[(i, i)] + 1e-9;
    }
    let held = |i: usize| {
        let (one, at, pull) = (&fit.free[i], fit.coordinates[i], equations.gradient[i]);
        one.held() || (at <= lower(one) && pull < 0.0) || (at >= one.coordinate(one.high) && pull > 0.0)
    };
    let mut gradient = equations.gradient.clone();
    for i in (0..size).filter(|&i| held(i)) {
        for j in 0..size {
            matrix[(i, j)] = 0.0;
            matrix[(j, i)] = 0.0;
        }
        matrix[(i, i)] = 1.0;
        gradient[i] = 0.0;
    }
    (matrix.cholesky().map(|factor| factor.solve(&gradient)), gradient)
}

/// By how much the linear model promises that numbers and starts can lower the cost; without an end where its equations leave
/// the numbers open. Of the whole step: what a bound cuts off may be all that there is to gain.
fn promise(fit: &Fit, equations: &Reduced) -> f64 {
    let (Some(change), gradient) = change(fit, equations, 0.0) else { return f64::INFINITY };
    let of_starts = equations.segments.iter().flatten().map(|SegmentEquations { start, .. }| {
        let alone = start.solve(start.gradient);
        start.gradient[0] * alone[0] + start.gradient[1] * alone[1]
    });
    change.dot(&(2.0 * &gradient - &equations.matrix * &change)) + of_starts.sum::<f64>()
}

/// One damped step of numbers and starts.
fn step(fit: &Fit, equations: &Reduced, damping: f64) -> Fit {
    let size = fit.free.len();
    let change = change(fit, equations, damping).0.unwrap_or_else(|| DVector::zeros(size));
    let mut trial = fit.clone();
    // No number moves by more than a factor e, or eight of its units, at once.
    let most = |one: &Free| if one.scale == Scale::Log { 1.0 } else { 8.0 };
    let steps: Vec<f64> = fit.free.iter().zip(&change).map(|(one, step)| step.clamp(-most(one), most(one))).collect();
    let resistance = fit.free.iter().position(|one| one.number == Number::Resistance).map_or(0.0, |place| {
        let one = &fit.free[place];
        let to = (fit.coordinates[place] + steps[place]).clamp(lower(one), one.coordinate(one.high));
        to - fit.coordinates[place]
    });
    let mut moved = vec![0.0; size];
    for i in 0..size {
        let one = &fit.free[i];
        let to = one.stepped(fit.coordinates[i], steps[i], resistance);
        trial.coordinates[i] = to.clamp(lower(one), one.coordinate(one.high));
        // What the step's own curve adds goes with the scale, which the readings do not show.
        let clamped = trial.coordinates[i] - to;
        moved[i] = steps[i] + clamped;
    }
    for (starts, segments) in trial.starts.iter_mut().zip(&equations.segments) {
        for (start, own) in starts.iter_mut().zip(segments) {
            let mut right = own.start.gradient;
            for (coupling, moved) in own.coupling.iter().zip(&moved) {
                right[0] -= coupling[0] * moved;
                right[1] -= coupling[1] * moved;
            }
            let step = own.start.solve(right);
            start[0] += step[0];
            start[1] += step[1];
        }
    }
    trial
}

fn lower(one: &Free) -> f64 {
    one.coordinate(one.low)
}

/// Mean square error over the noise's, never below 1, of a sum of squares in units of sigma². Where the model misses the data by
/// more than their noise, they say as much less beside the prior: the cost `S + (S/n)·P` of `n` residuals is, for a prior that is
/// small beside them, `n ln S + P`, the likelihood of an error of unknown size. A wrong model would otherwise drive the numbers to
/// where no motor has them, for next to nothing.
#[must_use]
pub fn misfit(data: &Data, squares: f64) -> f64 {
    (squares / residuals(data)).max(1.0)
}

/// Weight of the priors beside the squares in the normal equations: that with which both have the minimum of the cost. `d(S +
/// (S/n)·P) = (1 + P/n)·dS + (S/n)·dP`.
#[must_use]
pub fn prior_weight(data: &Data, squares: f64, fit: &Fit) -> f64 {
    let residuals = residuals(data);
    if squares > residuals { squares / (residuals + fit.off_prior()) } else { 1.0 }
}

/// The prior's share of the normal equations, per number: curvature, and pull towards what the file says.
#[must_use]
pub fn prior_equations(data: &Data, squares: f64, fit: &Fit) -> Vec<(f64, f64)> {
    let weight = prior_weight(data, squares, fit);
    let numbers = fit.free.iter().zip(&fit.coordinates);
    let equation = |(one, at): (&Free, &f64)| {
        let curvature = weight * one.prior.powi(-2);
        (curvature, curvature * (one.coordinate(one.start) - at))
    };
    numbers.map(equation).collect()
}

/// How many residuals a fit is made to, without those that its starts take.
pub fn residuals(data: &Data) -> f64 {
    let angles: f64 = data.tracks.iter().map(Track::readings).sum();
    let currents = data.tracks.iter().filter(|track| with_current(data, track));
    (angles + currents.map(|track| count_of_currents(track) as f64).sum::<f64>()).max(1.0)
}
