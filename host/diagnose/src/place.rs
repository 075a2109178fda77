//! Which coordinate the rest of a model follows: a curve over each is fitted together with the model's numbers, and judged on runs
//! that no fit has seen.
//!
//! A screen ([`super::curves`]) asks the linear model, which says little of a rest that has moved the refitted numbers far, or
//! that moves a rollout far itself. Where no curve says anything, runs say of each other where what is left of them lies.

use rayon::prelude::*;

use super::curves;
use super::fit;
use super::map::{BINS, Bins, NAMES, Point, points_of};
use super::probe::{Follows, Shape};
use super::screen::Screen;
use super::search::Candidate;
use super::selection::leaves_much;
use super::session::Session;

/// Rounds of a fit, which is one to the rollouts of a first look.
const ROUNDS: usize = 6;

/// A curve that takes away this share of the excess on runs that no fit has seen is where the rest lives.
const TAKES: f64 = 0.1;
/// This share is more than a screen's word for another coordinate, where that promises less than the second.
const TAKES_MOST: (f64, f64) = (0.5, 0.3);

/// Coordinates over which one run says nothing of another.
const NOT_PREDICTED: [&str; 2] = ["run", "time_in_rollout_s"];
/// Share of a prediction that is left to chance.
const UNSAID: f64 = 0.05;
/// What is no information, nats.
const LEAST_INFORMATION: f64 = 0.05;

/// The coordinate whose curve takes away most of the rest of a model: by a screen of it, where that is more than an accident, or on
/// held-out runs.
#[must_use]
pub fn of(session: &Session, model: &Candidate, noise: f64, screen: &Screen) -> Option<Follows> {
    let promised = screen.follows();
    if promised.is_some_and(|(_, share)| share >= TAKES_MOST.1) || !leaves_much(noise, model) {
        return promised.map(|(follows, _)| follows);
    }
    let bar = if promised.is_some() { TAKES_MOST.0 } else { TAKES };
    let taken = shares(session, model, noise).first().copied().filter(|(_, share)| *share >= bar);
    taken.or(promised).map(|(follows, _)| follows)
}

/// The share of a model's excess over the noise (mean square, rad²) that a curve over each coordinate takes away, the largest first.
fn shares(session: &Session, model: &Candidate, noise: f64) -> Vec<(Follows, f64)> {
    let spans = curves::spans(&session.model, &session.data());
    let before = model.mean_square();
    let share = |follows: Follows| {
        let fit = session.look_with_curve(&model.fit, Shape { follows, spans }, ROUNDS);
        let after = session.evaluate(&fit).mean_square();
        (follows, (before - after) / (before - noise).max(f64::MIN_POSITIVE))
    };
    // A run that is held out has no term in a curve over the runs that were fitted on.
    let judged = Follows::ALL.into_par_iter().filter(|follows| *follows != Follows::Run);
    let mut shares: Vec<(Follows, f64)> = judged.map(share).collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares
}

/// The coordinate over which the excess of some runs says best where it lies in another, by the information about it that they give
/// (nats, of each run by all others, in proportion to its excess); `None` where none says anything. An event of its own is always
/// confined in time, and not where time says nothing of the next one.
#[must_use]
pub fn predicted(session: &Session, model: &Candidate) -> Option<&'static str> {
    let plant = model.fit.plant(&session.model);
    let rolled = fit::roll_all(&session.model, &session.data(), &model.fit);
    let of_fitted = session.fit.iter().enumerate().map(|(i, track)| {
        let readings = &rolled[i].readings;
        (session.fit_noise, points_of(session, &plant, track, &model.fit.starts[i], [readings, readings]))
    });
    let of_held_out = session.held_out.iter().enumerate().map(|(i, track)| {
        let readings = &model.evaluation.rolled[i].readings;
        (session.noise, points_of(session, &plant, track, &model.evaluation.starts[i], [readings, readings]))
    });
    let runs: Vec<(f64, Vec<Point>)> = of_fitted.chain(of_held_out).collect();
    let known = (0..NAMES.len()).filter(|&axis| !NOT_PREDICTED.contains(&NAMES[axis]));
    let best = known.map(|axis| (axis, information(&runs, axis))).max_by(|a, b| a.1.total_cmp(&b.1));
    best.filter(|best| best.1 > LEAST_INFORMATION).map(|(axis, _)| NAMES[axis])
}

/// What the excess of the other runs over a coordinate says about where that of a run lies.
fn information(runs: &[(f64, Vec<Point>)], axis: usize) -> f64 {
    let mut values: Vec<f64> = runs.iter().flat_map(|run| &run.1).map(|point| point.coordinates[axis]).collect();
    let range = Bins::over(&mut values);
    // Of each run and bin: excess and samples.
    let of_run = |(noise, points): &(f64, Vec<Point>)| {
        let mut bins = [(0.0, 0.0); BINS];
        for point in points {
            if let Some(bin) = range.of(point.coordinates[axis]) {
                bins[bin].0 += point.after.powi(2) - noise;
                bins[bin].1 += 1.0;
            }
        }
        bins.map(|(excess, samples)| (excess.max(0.0), samples))
    };
    let by_run: Vec<[(f64, f64); BINS]> = runs.iter().map(of_run).collect();
    let sum = |bins: &[(f64, f64); BINS]| bins.iter().fold((0.0, 0.0), |sum, bin| (sum.0 + bin.0, sum.1 + bin.1));
    let all: f64 = by_run.iter().map(|bins| sum(bins).0).sum();
    let said = by_run.iter().enumerate().map(|(own, bins)| {
        let mut others = [(0.0, 0.0); BINS];
        for (_, bins) in by_run.iter().enumerate().filter(|(run, _)| *run != own) {
            for (total, bin) in others.iter_mut().zip(bins) {
                *total = (total.0 + bin.0, total.1 + bin.1);
            }
        }
        let (total, here) = (sum(&others), sum(bins));
        if total.0 <= 0.0 || here.0 <= 0.0 {
            return 0.0;
        }
        // How much more than usual the others have here.
        let density = |(excess, samples): (f64, f64)| {
            if samples > 0.0 { (1.0 - UNSAID) * (excess / total.0) / (samples / total.1) + UNSAID } else { UNSAID }
        };
        let expected: f64 = others.iter().zip(bins).map(|(other, bin)| density(*other) * bin.1 / here.1).sum();
        let gained = others.iter().zip(bins).map(|(other, bin)| bin.0 / here.0 * (density(*other) / expected).ln());
        here.0 * gained.sum::<f64>()
    });
    said.sum::<f64>() / all.max(f64::MIN_POSITIVE)
}
