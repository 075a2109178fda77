//! Bayesian optimisation of (3.1), as thesis section 3.1 does it, by efficient global optimisation: D. R. Jones, M. Schonlau and
//! W. J. Welch, "Efficient Global Optimization of Expensive Black-Box Functions", 1998.
//!
//! The square of (3.1) is a sum over the axes, and the thesis looks at one axis at a time: each has a Gaussian process over the logarithms of
//! its own stiffness and damping, within the file's spreads, and one simulation of six numbers tells all three. Where the axes mix, the
//! others' wrong numbers disturb an axis, so that the search begins anew in smaller and smaller boxes around what it found. Where a run
//! starts is no number of a process: it is fitted for each set of six numbers, as least squares fits it.

use std::array::from_fn;

use egobox_ego::{CorrelationSpec, EgoError, EgorServiceBuilder};
use ndarray::Array2;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::BackboneError;
use super::fit::{Problem, STEPS, Search};
use super::oscillation::Oscillation;
use super::rig::{Hinges, Rig};
use crate::least_squares::Minimum;

/// How much smaller the boxes of a turn are than those of the turn before.
const SHRUNK: f64 = 0.25;
/// The starts are almost linear: after so many steps (3.1) is within 1 % of its least.
const START_STEPS: usize = 2;

/// Logarithms of a stiffness and a damping.
type Pair = [f64; 2];
/// From where to where they are looked for.
type Limits = [[f64; 2]; 2];

/// The six numbers with the least of (3.1) that was found, as a problem with them, and the runs' starts there.
pub(super) fn bayes<'a>(
    rig: &'a Rig<'a>,
    runs: Vec<Oscillation>,
    spreads: [[f64; 2]; 6],
    search: Search,
) -> Result<(Problem<'a>, Minimum), BackboneError> {
    if search.evaluations < Search::FEWEST {
        return Err(BackboneError::TooFew { evaluations: search.evaluations, fewest: Search::FEWEST });
    }
    let mut problem = Problem::of(rig, runs, rig.file());
    let mut random = Pcg64::seed_from_u64(search.seed);
    let wide: [Limits; 3] = from_fn(|axis| [spreads[axis], spreads[axis + 3]].map(|ends| ends.map(f64::ln)));
    for turn in 0..Search::TURNS {
        let tries = search.evaluations * (turn + 1) / Search::TURNS - search.evaluations * turn / Search::TURNS;
        let share = SHRUNK.powi(turn as i32);
        let mut axes: [Axis; 3] = from_fn(|axis| Axis::new(pair(&problem.fixed, axis), share, wide[axis], &mut random));
        for tried in 0..tries {
            let [x, y, z] = from_fn(|axis| axes[axis].next(tried, random.random()));
            let pairs = [x?, y?, z?];
            problem.fixed = from_fn(|k| pairs[k % 3][k / 3].exp());
            let errors = problem.starts(START_STEPS).map(|minimum| problem.errors(&minimum));
            for (axis, one) in axes.iter_mut().enumerate() {
                one.take(pairs[axis], errors.and_then(|errors| errors[axis]));
            }
        }
        problem.fixed = from_fn(|k| axes[k % 3].best()[k / 3].exp());
    }
    let minimum = problem.starts(STEPS).ok_or(BackboneError::Hopeless)?;
    Ok((problem, minimum))
}

fn pair(hinges: &Hinges, axis: usize) -> Pair {
    [hinges[axis].ln(), hinges[axis + 3].ln()]
}

/// A turn of an axis.
struct Axis {
    /// Where the turn looks.
    limits: Limits,
    /// What is tried first: the best so far, and what is drawn.
    first: Vec<Pair>,
    tried: Vec<Pair>,
    /// (3.1) about this axis of what was tried, rad.
    errors: Vec<f64>,
}

impl Axis {
    /// In a box around the best so far that has a share of the widest, and is within it.
    fn new(best: Pair, share: f64, widest: Limits, random: &mut Pcg64) -> Self {
        let limits = from_fn(|number| {
            let [low, high] = widest[number];
            let reach = 0.5 * share * (high - low);
            let middle = best[number].max(low + reach).min(high - reach);
            [middle - reach, middle + reach]
        });
        let mut first = vec![best];
        first.extend(latin_hypercube(limits, Search::DRAWN - 1, random));
        Self { limits, first, tried: Vec::new(), errors: Vec::new() }
    }

    fn next(&self, tried: usize, seed: u64) -> Result<Pair, BackboneError> {
        match self.first.get(tried) {
            Some(&pair) => Ok(pair),
            None if self.tried.is_empty() => Ok(self.first[0]),
            None => suggested(self.limits, &self.tried, &self.errors, seed)
                .map_err(|error| BackboneError::Search(error.to_string())),
        }
    }

    /// What cannot be simulated counts as the worst that can, so that the process keeps away. An axis that no run has is told nothing.
    fn take(&mut self, pair: Pair, error: Option<f64>) {
        if let Some(error) = error.or_else(|| self.errors.iter().copied().reduce(f64::max)) {
            self.tried.push(pair);
            self.errors.push(error);
        }
    }

    fn best(&self) -> Pair {
        let best = (0..self.errors.len()).min_by(|&a, &b| self.errors[a].total_cmp(&self.errors[b]));
        best.map_or(self.first[0], |best| self.tried[best])
    }
}

/// Where the process of what was tried expects most improvement.
fn suggested(limits: Limits, tried: &[Pair], errors: &[f64], seed: u64) -> Result<Pair, EgoError> {
    // A valley in which the phase of an oscillation fits is too sharp for a squared exponential.
    let service = EgorServiceBuilder::optimize()
        .configure(|ego| ego.seed(seed).configure_gp(|gp| gp.correlation_spec(CorrelationSpec::MATERN52)))
        .min_within(&Array2::from(limits.to_vec()))?;
    let errors: Vec<[f64; 1]> = errors.iter().map(|&error| [error]).collect();
    let point = service.suggest(&Array2::from(tried.to_vec()), &Array2::from(errors));
    Ok(from_fn(|number| point[[0, number]]))
}

/// Each number's range is cut into as many parts as there are pairs, and each part has one of them: M. D. McKay, R. J. Beckman and
/// W. J. Conover, "A Comparison of Three Methods for Selecting Values of Input Variables", 1979.
fn latin_hypercube(limits: Limits, pairs: usize, random: &mut Pcg64) -> Vec<Pair> {
    let columns = limits.map(|[low, high]| {
        let mut parts: Vec<f64> = (0..pairs).map(|part| part as f64).collect();
        parts.shuffle(random);
        let share = |part: f64, random: &mut Pcg64| (part + random.random::<f64>()) / pairs as f64;
        parts.into_iter().map(|part| low + (high - low) * share(part, random)).collect::<Vec<_>>()
    });
    (0..pairs).map(|k| [columns[0][k], columns[1][k]]).collect()
}
