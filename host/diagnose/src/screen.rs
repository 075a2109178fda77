//! A screen before any fit: which effects of the catalogue, at their smallest, would take something away from what the refitted
//! model leaves on the fit runs; and which coordinate what is left follows.
//!
//! The model is linearised about its rollouts. Every effect is a direction in which the readings would move; the starts of the
//! rollouts and the refitted numbers are projected out of it (C. R. Rao's score test with nuisance parameters, 1948). Its statistic
//! is the fall of the sum of squares that the linear model promises, `u' A⁻¹ u` with the efficient score `u` and its curvature
//! `A`. What that is worth without any effect is not read from a table, which would take the noise to be white and normal: the
//! scores of whole blocks of rollouts have their signs changed at random, together for all effects (the wild score bootstrap of
//! P. Kline and A. Santos, "A score based approach to wild bootstrap inference", Journal of Econometric Methods 1, 2012). A block is
//! longer than noise remembers. The chance that any effect of the library looks as good by accident is held by step-down minima of
//! p-values (P. H. Westfall and S. S. Young, "Resampling-based multiple testing", 1993, algorithm 2.8).

use effects::Id;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use super::curves;
use super::fit::{self, Columns, Data, Fit, Followed, Moved};
use super::motion;
use super::nominal::FileModel;
use super::normal_equations;
use super::numbers::Number;
use super::probe::Follows;
use super::rollout::Rolled;
use super::track::Track;

/// Changes of sign.
const RESAMPLES: usize = 4000;
/// Error of a whole family: how often nothing at all raises an alarm.
const FAMILY_ERROR: f64 = 0.005;
/// What promises to lower the sum of squares by less than this share is not worth a name, however sure it is.
const LEAST_PROMISED: f64 = 0.0015;
/// What promises to lower the sum of squares by this share is not noise only because it may be an accident.
const UNDECIDED: f64 = 0.04;
/// Blocks are at least this long, s: longer than the noise of a reading remembers.
const BLOCK_S: f64 = 0.5;
/// Most shapes of an effect that are worth a fit.
const MOST_STARTS: usize = 3;
/// Standard deviations to a one-sided limit of 95 %.
const ONE_SIDED: f64 = 1.645;
/// A share of a direction's curvature that is left below this is not seen beside the numbers.
const UNSEEN: f64 = 1e-6;

/// A direction that is screened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// An effect, with the shape that it has at the first of its starting points of that shape.
    Effect(Id, usize),
    /// A curve over a coordinate.
    Curve(Follows),
}

/// What the screen says of one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Screened {
    /// Which.
    pub direction: Direction,
    /// By how much the linear model promises to lower the sum of squares, as a share of it.
    pub promised: f64,
    /// The same by accident, in the mean: a direction of many terms promises more.
    pub by_accident: f64,
    /// Chance of as much by accident, of this direction alone.
    pub chance: f64,
    /// Chance that any direction of its family, effects or curves, has as much by accident.
    pub family_chance: f64,
    /// Of an effect, the upper 95 % limits of the numbers that say how large it is, in the fit's own coordinates: by name.
    pub limits: Vec<(Number, f64)>,
    /// Of an effect that nothing makes small, the same of how much of it there may be, where its starting point has 1.
    pub dose: Option<f64>,
}

impl Screened {
    /// Whether it is more than an accident and promises something.
    #[must_use]
    pub fn is_sure(&self) -> bool {
        self.family_chance <= FAMILY_ERROR && self.promised >= LEAST_PROMISED
    }

    /// Whether it is more than an accident, or promises so much that it is not to be passed over though it may be one.
    fn counts(&self) -> bool {
        self.is_sure() || self.beyond_accident() >= UNDECIDED
    }

    /// What it promises beyond the mean of accidents.
    #[must_use]
    pub fn beyond_accident(&self) -> f64 {
        (self.promised - self.by_accident).max(0.0)
    }
}

/// An effect that may be worth a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Which.
    pub effect: Id,
    /// Its starting points that are worth a fit, the most promising first.
    pub starts: Vec<usize>,
    /// By how much the linear model promises to lower the sum of squares at the best of them, as a share of it.
    pub promised: f64,
}

/// What a screen says.
#[derive(Clone, Debug, PartialEq)]
pub struct Screen {
    /// Effects, then curves.
    pub directions: Vec<Screened>,
    /// Chance that noise which does not know of the motion looks as dependent on it as what is left.
    pub motion_chance: f64,
}

impl Screen {
    /// Screens effects against what a fit leaves.
    #[must_use]
    pub fn of_effects(model: &FileModel, data: &Data, fit: &Fit, effects: &[Id], seed: u64) -> Self {
        let rolled = fit::roll_all(model, data, fit);
        let groups = effect_groups(model, fit, effects);
        let scores = Scores::new(data, fit, &rolled, &columns(model, data, fit, &rolled, &groups));
        let signs = scores.signs(seed);
        let directions = family(groups.par_iter().map(|group| scores.test(group, &signs)).collect());
        Self { directions, motion_chance: motion::chance(data.tracks, &rolled, seed) }
    }

    /// Screens curves too, as a family of their own in place of the one that is there: they have many terms, and are of use where
    /// no effect is enough.
    pub fn add_curves(&mut self, model: &FileModel, data: &Data, fit: &Fit, seed: u64, which: &[Follows]) {
        self.directions.retain(|one| matches!(one.direction, Direction::Effect(..)));
        self.directions.extend(curves::screen(model, data, fit, seed, which));
    }

    /// Whether anything that was screened is more than an accident and worth a fit.
    #[must_use]
    pub fn alarm(&self) -> bool {
        self.directions.iter().any(Screened::is_sure) || self.motion_chance <= FAMILY_ERROR
    }

    /// Whether what was screened is noise: no alarm, and nothing that promises much more than an accident either, as it may where
    /// there is too little to be sure of anything.
    #[must_use]
    pub fn is_noise(&self) -> bool {
        !self.alarm() && self.directions.iter().all(|one| !one.counts())
    }

    /// Share of the sum of squares that the direction which promises most would take away, less what accidents promise there.
    #[must_use]
    pub fn seen(&self) -> f64 {
        self.directions.iter().filter(|one| one.counts()).map(Screened::beyond_accident).fold(0.0, f64::max)
    }

    /// The curve that promises most, of those that [`Self::seen`] counts, and what it promises beyond accidents.
    #[must_use]
    pub fn strongest_curve(&self) -> Option<(Follows, f64)> {
        let of_curve = |one: &Screened| match one.direction {
            Direction::Curve(follows) if one.counts() => Some((follows, one.beyond_accident())),
            _ => None,
        };
        self.directions.iter().filter_map(of_curve).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Effects that are more than an accident, the most promising first.
    #[must_use]
    pub fn effects(&self) -> Vec<Id> {
        let mut sure: Vec<(Id, f64)> = Vec::new();
        for one in self.directions.iter().filter(|one| one.is_sure()) {
            if let Direction::Effect(id, _) = one.direction {
                sure.push((id, one.promised));
            }
        }
        sure.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut effects: Vec<Id> = Vec::new();
        for (id, _) in sure {
            if !effects.contains(&id) {
                effects.push(id);
            }
        }
        effects
    }

    /// Every effect that was screened, the most promising first.
    #[must_use]
    pub fn proposals(&self, model: &FileModel) -> Vec<Proposal> {
        let promised = self.directions.iter().map(|one| (one.direction, one.promised));
        in_order(model, promised)
    }

    /// The coordinate that what is left follows best, where that is more than an accident: the curve that promises most beyond what
    /// one of as many terms promises by accident, and how much that is.
    #[must_use]
    pub fn follows(&self) -> Option<(Follows, f64)> {
        let curves = self.directions.iter().filter_map(|one| match one.direction {
            Direction::Curve(follows) if one.family_chance <= FAMILY_ERROR => Some((follows, one.beyond_accident())),
            _ => None,
        });
        curves.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The proposals of a screen that asks for no chances.
#[must_use]
pub fn propose(model: &FileModel, data: &Data, fit: &Fit, effects: &[Id]) -> Vec<Proposal> {
    let rolled = fit::roll_all(model, data, fit);
    let groups = effect_groups(model, fit, effects);
    let scores = Scores::new(data, fit, &rolled, &columns(model, data, fit, &rolled, &groups));
    in_order(model, groups.iter().map(|group| (group.direction, scores.promised(group))))
}

/// Effects by the most that one of their shapes promises.
fn in_order(model: &FileModel, promised: impl Iterator<Item = (Direction, f64)>) -> Vec<Proposal> {
    let mut proposals: Vec<Proposal> = Vec::new();
    let of_effect = |(direction, promised)| match direction {
        Direction::Effect(id, start) => Some((id, start, promised)),
        Direction::Curve(_) => None,
    };
    let mut by_promise: Vec<(Id, usize, f64)> = promised.filter_map(of_effect).collect();
    by_promise.sort_by(|a, b| b.2.total_cmp(&a.2));
    for (effect, start, promised) in by_promise {
        // Of a shape, all sizes.
        let starts = || shapes(model, effect).into_iter().find(|shape| shape[0] == start).unwrap_or_default();
        match proposals.iter_mut().find(|known| known.effect == effect) {
            Some(known) if known.starts.len() < MOST_STARTS => known.starts.extend(starts()),
            Some(_) => {}
            None => proposals.push(Proposal { effect, starts: starts(), promised }),
        }
    }
    proposals
}

/// A direction with its columns.
pub(super) struct Group {
    pub(super) direction: Direction,
    /// Places among all columns, after the fit's numbers.
    pub(super) columns: std::ops::Range<usize>,
    pub(super) moved: Vec<Moved>,
    /// Of an effect: which numbers, and whether they may be negative.
    pub(super) sizes: Vec<(Number, bool)>,
}

/// Collects groups, their columns after a fit's numbers.
struct Groups {
    next: usize,
    groups: Vec<Group>,
}

impl Groups {
    fn add(&mut self, direction: Direction, moved: Vec<Moved>, sizes: Vec<(Number, bool)>) {
        let columns = self.next..self.next + moved.len();
        self.next = columns.end;
        self.groups.push(Group { direction, columns, moved, sizes });
    }
}

fn effect_groups(model: &FileModel, fit: &Fit, effects: &[Id]) -> Vec<Group> {
    let mut groups = Groups { next: fit.free.len(), groups: Vec::new() };
    for &effect in effects {
        for shape in shapes(model, effect) {
            let (moved, sizes) = effect_columns(model, fit, effect, shape[0]);
            groups.add(Direction::Effect(effect, shape[0]), moved, sizes);
        }
    }
    groups.groups
}

/// The starting points of an effect by shape: those that differ in size only are of one.
fn shapes(model: &FileModel, effect: Id) -> Vec<Vec<usize>> {
    let shape = |start: usize| -> Vec<f64> {
        let free = model.with(&[effect], start);
        free.iter().filter(|one| !one.is_size()).map(|one| one.start).collect()
    };
    let mut shapes: Vec<Vec<usize>> = Vec::new();
    for start in 0..model.starts(&[effect]) {
        match shapes.iter_mut().find(|known| shape(known[0]) == shape(start)) {
            Some(known) => known.push(start),
            None => shapes.push(vec![start]),
        }
    }
    shapes
}

/// The plants with each number that says how large an effect is at one of its units, the others at rest.
fn effect_columns(model: &FileModel, fit: &Fit, effect: Id, start: usize) -> (Vec<Moved>, Vec<(Number, bool)>) {
    let mut absent = Fit::begin(model, &[effect], start, Vec::new());
    absent.take_over(fit);
    let new = |place: &usize| fit.free.iter().all(|one| one.number != absent.free[*place].number);
    let sizes: Vec<usize> = (0..absent.free.len()).filter(new).filter(|&place| absent.free[place].is_size()).collect();
    if sizes.is_empty() {
        // Nothing that makes it small: all of it, as it is at its starting point.
        return (vec![Some((absent.plant(model), 1.0))], Vec::new());
    }
    for &place in &sizes {
        absent.coordinates[place] = 0.0;
    }
    let moved = sizes.iter().map(|&place| {
        let mut coordinates = absent.coordinates.clone();
        coordinates[place] = 1.0;
        Some((model.plant(&absent.effects, &absent.free, &coordinates), 1.0))
    });
    (moved.collect(), sizes.iter().map(|&place| (absent.free[place].number, absent.free[place].low < 0.0)).collect())
}

/// How the readings change with the starts, the fit's numbers and each group's columns.
fn columns(model: &FileModel, data: &Data, fit: &Fit, rolled: &[Rolled], groups: &[Group]) -> Vec<Columns> {
    fit::columns_of(
        model,
        data,
        fit,
        rolled,
        Followed::WithinSegment,
        groups.iter().flat_map(|group| group.moved.clone()),
    )
}

/// Scores of every block of rollouts, and their curvature, the starts eliminated.
pub(super) struct Scores {
    /// Numbers of the fit.
    numbers: usize,
    matrix: DMatrix<f64>,
    /// Efficient scores of the blocks: the numbers' share is taken out.
    blocks: Vec<DVector<f64>>,
    /// Their sum, the prior's pull on the numbers included.
    total: DVector<f64>,
    /// Of what is left, in units of the noise's.
    squares: f64,
}

impl Scores {
    /// From the columns of the fit's numbers and of the groups after them.
    pub(super) fn new(data: &Data, fit: &Fit, rolled: &[Rolled], columns: &[Columns]) -> Self {
        let numbers = fit.free.len();
        // The starts' two are eliminated.
        let size = columns.first().map_or(numbers, |all| all.len() - 2);
        let mut matrix = DMatrix::zeros(size, size);
        let mut blocks = Vec::new();
        for (track, equations) in data.tracks.iter().zip(normal_equations::of_tracks(data, rolled, columns)) {
            matrix += equations.matrix;
            blocks.extend(
                equations.gradients.chunks(block_rollouts(track)).map(|block| block.iter().sum::<DVector<f64>>()),
            );
        }
        let mut total: DVector<f64> = blocks.iter().sum();
        // Of these rollouts: the fit may have been made to others, or to another noise.
        let squares = fit::squares(data, rolled);
        for (i, (curvature, pull)) in fit::prior_equations(data, squares, fit).into_iter().enumerate() {
            matrix[(i, i)] += curvature;
            total[i] += pull;
        }
        let mut scores = Self { numbers, matrix, blocks, total, squares };
        scores.take_numbers_out();
        scores
    }

    /// Makes scores and curvature those of what the numbers cannot do.
    fn take_numbers_out(&mut self) {
        let (n, size) = (self.numbers, self.matrix.nrows());
        let mut own = self.matrix.view((0, 0), (n, n)).into_owned();
        for i in 0..n {
            own[(i, i)] = own[(i, i)] * (1.0 + 1e-9) + 1e-12;
        }
        let Some(factor) = own.cholesky() else { return };
        let coupling = self.matrix.view((0, n), (n, size - n)).into_owned();
        let carried = factor.solve(&coupling);
        let left = self.matrix.view((n, n), (size - n, size - n)) - coupling.transpose() * &carried;
        let seen = |i: usize| left[(i, i)] > UNSEEN * self.matrix[(n + i, n + i)];
        let seen: Vec<bool> = (0..size - n).map(seen).collect();
        let efficient = |score: &DVector<f64>| {
            let mut own = score.rows(n, size - n) - carried.transpose() * score.rows(0, n);
            for (value, seen) in own.iter_mut().zip(&seen) {
                *value *= f64::from(*seen);
            }
            own
        };
        for score in self.blocks.iter_mut().chain([&mut self.total]) {
            *score = efficient(score);
        }
        self.matrix = left;
        for i in (0..size - n).filter(|&i| !seen[i]) {
            self.matrix[(i, i)] = 1.0;
        }
    }

    /// Signs of the blocks, one a block and resample: the same for every group that is to be compared.
    pub(super) fn signs(&self, seed: u64) -> Vec<f64> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed ^ 0x5c_0e_e0);
        (0..RESAMPLES * self.blocks.len()).map(|_| if random.random_bool(0.5) { 1.0 } else { -1.0 }).collect()
    }

    /// What a direction promises, and what it promises with the signs of the blocks changed.
    pub(super) fn test(&self, group: &Group, signs: &[f64]) -> Tested {
        let (found, accidental) = self.statistics(group, signs);
        let chances = chances(found, &accidental);
        let limits = self.limits(group);
        let as_a_whole = matches!(group.direction, Direction::Effect(..)) && group.sizes.is_empty();
        let squares = self.squares.max(f64::MIN_POSITIVE);
        let screened = Screened {
            direction: group.direction,
            promised: found / squares,
            by_accident: accidental.iter().sum::<f64>() / (accidental.len().max(1) as f64 * squares),
            chance: chances[0],
            family_chance: 1.0,
            limits: group.sizes.iter().zip(&limits).map(|((number, _), limit)| (*number, *limit)).collect(),
            dose: limits.first().copied().filter(|_| as_a_whole),
        };
        Tested { screened, chances }
    }

    /// Upper 95 % limits of the coordinates of a group's columns, from where one step of the linear model puts them and the
    /// scatter of the blocks' scores; infinite where nothing is seen of them.
    fn limits(&self, group: &Group) -> Vec<f64> {
        let (first, size) = (group.columns.start - self.numbers, group.columns.len());
        let own = |score: &DVector<f64>| score.rows(first, size).into_owned();
        let Some(factor) = self.matrix.view((first, first), (size, size)).into_owned().cholesky() else {
            return vec![f64::INFINITY; size];
        };
        let step = factor.solve(&own(&self.total));
        let steps: Vec<DVector<f64>> = self.blocks.iter().map(|block| factor.solve(&own(block))).collect();
        let limit = |i: usize| {
            let deviation = steps.iter().map(|step| step[i] * step[i]).sum::<f64>().sqrt();
            let signed = group.sizes.get(i).is_some_and(|(_, signed)| *signed);
            let from = if signed { step[i].abs() } else { step[i].max(0.0) };
            if deviation > 0.0 { from + ONE_SIDED * deviation } else { f64::INFINITY }
        };
        (0..size).map(limit).collect()
    }

    /// By how much a group promises to lower the sum of squares, as a share of it.
    fn promised(&self, group: &Group) -> f64 {
        self.whiten(group).map_or(0.0, |whiten| whiten(&self.total).norm_squared())
            / self.squares.max(f64::MIN_POSITIVE)
    }

    /// What takes a score to a group's own, in units of its deviation; `None` where the group's columns say the same.
    fn whiten(&self, group: &Group) -> Option<impl Fn(&DVector<f64>) -> DVector<f64> + use<>> {
        let (first, size) = (group.columns.start - self.numbers, group.columns.len());
        let mut matrix = self.matrix.view((first, first), (size, size)).into_owned();
        for i in 0..size {
            matrix[(i, i)] = matrix[(i, i)] * (1.0 + 1e-6) + f64::MIN_POSITIVE;
        }
        let factor = matrix.cholesky()?;
        Some(move |score: &DVector<f64>| {
            let own = score.rows(first, size).into_owned();
            factor.l_dirty().solve_lower_triangular(&own).unwrap_or_else(|| DVector::zeros(size))
        })
    }

    /// The statistic of a group, and its values with signs of the blocks changed.
    fn statistics(&self, group: &Group, signs: &[f64]) -> (f64, Vec<f64>) {
        let Some(whiten) = self.whiten(group) else { return (0.0, vec![0.0; RESAMPLES]) };
        let size = group.columns.len();
        let mut own = DMatrix::zeros(size, self.blocks.len());
        for (mut column, block) in own.column_iter_mut().zip(&self.blocks) {
            column.copy_from(&whiten(block));
        }
        let changed = own * DMatrix::from_column_slice(self.blocks.len(), RESAMPLES, signs);
        (whiten(&self.total).norm_squared(), changed.column_iter().map(|sum| sum.norm_squared()).collect())
    }
}

/// A direction that was tested by itself.
pub(super) struct Tested {
    screened: Screened,
    /// Its chance, then those of the resamples.
    chances: Vec<f64>,
}

/// Directions as a family: how often chance makes any of them look as likely.
pub(super) fn family(tested: Vec<Tested>) -> Vec<Screened> {
    let (screened, chances): (Vec<Screened>, Vec<Vec<f64>>) =
        tested.into_iter().map(|one| (one.screened, one.chances)).unzip();
    let families = step_down(&chances);
    screened.into_iter().zip(families).map(|(one, family_chance)| Screened { family_chance, ..one }).collect()
}

/// Rollouts that make a block of at least [`BLOCK_S`].
pub(super) fn block_rollouts(track: &Track) -> usize {
    let longest = track.segments.iter().map(|one| track.t[one.last - 1] - track.t[one.first]).fold(0.0, f64::max);
    (BLOCK_S / longest.max(1e-6)).ceil().clamp(1.0, 100.0) as usize
}

/// The chance of a value by accident, and after it that of each of the accidental ones among themselves.
fn chances(found: f64, accidental: &[f64]) -> Vec<f64> {
    let mut sorted = accidental.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let beyond = |value: f64| (sorted.len() - sorted.partition_point(|one| *one < value)) as f64;
    let of_found = (1.0 + beyond(found)) / (n + 1.0);
    std::iter::once(of_found).chain(accidental.iter().map(|value| beyond(*value) / n)).collect()
}

/// Westfall and Young's step-down minima of p-values: the chance, for each direction, that this or one that looks less likely by
/// accident is reached by accident anywhere. Each row: a direction's own chance, then those of the resamples.
fn step_down(chances: &[Vec<f64>]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..chances.len()).collect();
    order.sort_by(|&a, &b| chances[a][0].total_cmp(&chances[b][0]));
    let mut family = vec![1.0; chances.len()];
    let resamples = chances.first().map_or(0, |row| row.len() - 1);
    let mut least = vec![f64::INFINITY; resamples];
    for &i in order.iter().rev() {
        for (least, chance) in least.iter_mut().zip(&chances[i][1..]) {
            *least = least.min(*chance);
        }
        let as_small = least.iter().filter(|least| **least <= chances[i][0]).count();
        family[i] = (1.0 + as_small as f64) / (resamples as f64 + 1.0);
    }
    let mut highest: f64 = 0.0;
    for &i in &order {
        highest = highest.max(family[i]);
        family[i] = highest;
    }
    family
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a family without anything in it: independent uniform chances.
    fn family(directions: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        (0..directions).map(|_| (0..2001).map(|_| random.random_range(0.0..1.0)).collect()).collect()
    }

    #[test]
    fn the_family_is_alarmed_as_often_as_it_says() {
        let alarms = (0..400).filter(|&seed| step_down(&family(12, seed)).iter().any(|chance| *chance <= 0.1)).count();
        // 40 expected, standard deviation 6.
        assert!((22..=58).contains(&alarms), "{alarms} of 400");
    }

    #[test]
    fn a_second_direction_pays_for_those_that_are_left_only() {
        let mut rows = family(10, 3);
        (rows[4][0], rows[7][0]) = (1e-4, 6e-3);
        let chances = step_down(&rows);
        // Among ten, and among nine: 1 − (1 − p)ⁿ.
        assert!(chances[4] < 5e-3 && (chances[7] - 0.053).abs() < 0.02, "{chances:?}");
    }
}
