//! All rollouts of a set of runs at once, and the starts (angle and speed) that each of them needs.

use std::f64::consts::TAU;

use rayon::prelude::*;

use effects::States;
use hal_sim::shaft::Stepper;

use super::model::{Boundary, Hidden, Plant};
use super::track::{Segment, Track};
use common::wrap;

/// Angle and speed at the start of every segment, by track.
pub type Starts = Vec<Vec<[f64; 2]>>;

/// The step of a start's angle (rad) and speed (rad/s) from which sensitivities are taken.
const STEP: [f64; 2] = [1e-4, 5e-3];

/// One track's rollouts, segments end to end.
#[derive(Clone, Debug, Default)]
pub struct Rolled {
    /// Reading at each sample of each segment, rad.
    pub readings: Vec<f64>,
    /// Where the wiper stands at each sample of each segment, rad.
    pub wipers: Vec<f64>,
    /// Mean current from each sample to the next; empty where not asked.
    pub currents: Vec<f64>,
    /// What no sensor sees at each segment's start.
    pub hidden: Vec<Hidden>,
    /// Angle and speed at each segment's end.
    pub ends: Vec<[f64; 2]>,
}

/// Rolls out every segment of a track. With `frozen`, segments start from those hidden states; else each from where the
/// one before ended.
#[must_use]
pub fn rollout(
    plant: &Plant,
    track: &Track,
    starts: &[[f64; 2]],
    frozen: Option<&[Hidden]>,
    with_current: bool,
) -> Rolled {
    let total: usize = track.segments.iter().map(|segment| segment.last - segment.first).sum();
    let mut rolled = Rolled {
        readings: Vec::new(),
        wipers: vec![0.0; total],
        currents: if with_current { vec![0.0; total + 1] } else { Vec::new() },
        hidden: Vec::with_capacity(track.segments.len()),
        ends: Vec::with_capacity(track.segments.len()),
    };
    let mut offset = 0;
    let mut carried = Hidden::default();
    let mut stepper = plant.stepper(track);
    for (i, segment) in track.segments.iter().enumerate() {
        let length = segment.last - segment.first;
        let hidden = match frozen {
            Some(frozen) => frozen[i],
            None if segment.linked => carried,
            None => beginning(plant, track, segment, starts[i], &carried.states, &mut stepper),
        };
        rolled.hidden.push(hidden);
        let currents = if with_current { Some(&mut rolled.currents[offset..=offset + length]) } else { None };
        let wipers = &mut rolled.wipers[offset..offset + length];
        let shaft = shaft_at_start(plant, segment, starts[i], &hidden);
        let end = plant.rollout(track, segment, Boundary { hidden, shaft }, &mut stepper, wipers, currents);
        carried = end.hidden;
        rolled.ends.push(end.shaft);
        offset += length;
    }
    rolled.currents.truncate(if with_current { total } else { 0 });
    rolled.readings = rolled.wipers.iter().map(|wiper| plant.reading(*wiper)).collect();
    rolled
}

/// Angle and speed of the shaft at a segment's start. Where a run begins, a start's angle is what the sensor shows there, for how far
/// the shaft is ahead nothing says yet.
pub fn shaft_at_start(plant: &Plant, segment: &Segment, start: [f64; 2], hidden: &Hidden) -> [f64; 2] {
    let ahead = if segment.linked { 0.0 } else { plant.ahead(hidden) };
    [start[0] + ahead, start[1]]
}

/// What no sensor sees where a run begins: of all that it may be, what suits the first segment best.
fn beginning(
    plant: &Plant,
    track: &Track,
    segment: &Segment,
    start: [f64; 2],
    before: &States,
    stepper: &mut Stepper,
) -> Hidden {
    let span = track.t[(segment.first + 1).min(track.t.len() - 1)] - track.t[segment.first];
    let hidden = |dragging: &f64| plant.hidden_at_start(*dragging, start[1], span, before);
    let draggings = plant.beginnings(start[1]);
    if let [only] = draggings.as_slice() {
        return hidden(only);
    }
    let mut wipers = vec![0.0; segment.last - segment.first];
    let mut error = |hidden: &Hidden| -> f64 {
        let shaft = shaft_at_start(plant, segment, start, hidden);
        plant.rollout(track, segment, Boundary { hidden: *hidden, shaft }, stepper, &mut wipers, None);
        let left = wipers.iter().enumerate().map(|(i, wiper)| {
            let reading = plant.reading(*wiper);
            residual(track, segment, segment.first + i, reading).powi(2)
        });
        left.sum()
    };
    let tried = draggings.iter().map(hidden).map(|hidden| (error(&hidden), hidden));
    tried.min_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(Hidden::default, |(_, hidden)| hidden)
}

/// Weighted squared error of each segment of a track.
#[must_use]
pub fn squared_errors(track: &Track, readings: &[f64]) -> Vec<f64> {
    let mut offset = 0;
    track
        .segments
        .iter()
        .map(|segment| {
            let length = segment.last - segment.first;
            let sum =
                (0..length).map(|i| residual(track, segment, segment.first + i, readings[offset + i]).powi(2)).sum();
            offset += length;
            sum
        })
        .collect()
}

/// Measured minus simulated, rad; 0 where there is no usable reading.
#[inline]
#[must_use]
pub fn residual(track: &Track, segment: &Segment, sample: usize, reading: f64) -> f64 {
    if track.weight[sample] <= 0.0 {
        return 0.0;
    }
    let left = track.angle[sample] - reading;
    if segment.whole { left } else { wrap(left) }
}

/// First guess of every start: a parabola through the readings of the first `window_s`. Where a segment begins with a hole,
/// the shaft is taken to have had the first reading's speed all along: a parabola would go astray there.
#[must_use]
pub fn guess(track: &Track, window_s: f64) -> Vec<[f64; 2]> {
    track
        .segments
        .iter()
        .map(|segment| {
            let read = |&k: &usize| track.weight[k] > 0.0;
            let Some(first) = (segment.first..segment.last).find(read) else { return [0.0; 2] };
            let t0 = track.t[first];
            let mut points = Vec::new();
            for k in (first..segment.last).filter(read) {
                if track.t[k] - t0 > window_s && points.len() >= 8 {
                    break;
                }
                points.push((track.t[k] - t0, track.angle[k]));
            }
            let [angle, speed] = parabola(&points);
            [angle - speed * (t0 - track.t[segment.first]), speed]
        })
        .collect()
}

/// Value and slope at 0 of the parabola through points.
fn parabola(points: &[(f64, f64)]) -> [f64; 2] {
    let scale = points.last().map_or(1.0, |last| last.0.max(1e-6));
    let mut normal = nalgebra::Matrix3::<f64>::identity() * 1e-9;
    let mut right = nalgebra::Vector3::zeros();
    let offset = points.first().map_or(0.0, |first| first.1);
    for &(t, y) in points {
        let row = nalgebra::Vector3::new(1.0, t / scale, (t / scale).powi(2));
        normal += row * row.transpose();
        right += row * (y - offset);
    }
    normal.cholesky().map_or([offset, 0.0], |factor| {
        let found = factor.solve(&right);
        [offset + found[0], found[1] / scale]
    })
}

/// Refines every start on its own segment by Gauss-Newton with the plant's numbers fixed, from the best of several
/// guesses. Returns the rollouts and the squared error of each segment.
pub fn refine(
    plant: &Plant,
    track: &Track,
    starts: &mut [[f64; 2]],
    guesses: &[Vec<[f64; 2]>],
    rounds: usize,
) -> (Rolled, Vec<f64>) {
    let mut rolled = rollout(plant, track, starts, None, false);
    let mut errors = squared_errors(track, &rolled.readings);
    for guess in guesses {
        keep_better(plant, track, starts, guess, &mut rolled, &mut errors);
    }
    if begin_at_rest(plant, track, starts, &errors) {
        rolled = rollout(plant, track, starts, None, false);
        errors = squared_errors(track, &rolled.readings);
    }
    for _ in 0..rounds {
        let proposal = gauss_newton(plant, track, starts, &rolled);
        let before: f64 = errors.iter().sum();
        let carried = carried(track, starts, &rolled);
        keep_better(plant, track, starts, &carried, &mut rolled, &mut errors);
        keep_better(plant, track, starts, &proposal, &mut rolled, &mut errors);
        let half: Vec<[f64; 2]> =
            starts.iter().zip(&proposal).map(|(a, b)| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]).collect();
        if starts.iter().zip(&proposal).any(|(a, b)| a != b) {
            keep_better(plant, track, starts, &half, &mut rolled, &mut errors);
        }
        // The hidden states follow the new starts.
        rolled = rollout(plant, track, starts, None, false);
        errors = squared_errors(track, &rolled.readings);
        let after: f64 = errors.iter().sum();
        if (before - after).abs() <= 1e-4 * before {
            break;
        }
    }
    (rolled, errors)
}

/// Lets runs begin at rest where that suits their first segment better; whether any does. A play hides from the first readings that
/// the shaft was at rest, and from a speed no step leads back to what may be at rest.
fn begin_at_rest(plant: &Plant, track: &Track, starts: &mut [[f64; 2]], errors: &[f64]) -> bool {
    if plant.beginnings(0.0).len() == 1 {
        return false;
    }
    let begins = |i: &usize| !track.segments[*i].linked && track.weight[track.segments[*i].first] > 0.0;
    let begun: Vec<usize> = (0..track.segments.len()).filter(begins).collect();
    let alone = Track { segments: begun.iter().map(|&i| track.segments[i]).collect(), ..track.clone() };
    let rest: Vec<[f64; 2]> = alone.segments.iter().map(|segment| [track.angle[segment.first], 0.0]).collect();
    let tried = squared_errors(&alone, &rollout(plant, &alone, &rest, None, false).readings);
    let mut any = false;
    for ((&i, rest), error) in begun.iter().zip(rest).zip(tried) {
        if error < errors[i] {
            starts[i] = rest;
            any = true;
        }
    }
    any
}

/// Each start as the segment before leads to it, on the turn of its own readings. Where a segment has holes, its readings alone may
/// leave several; and where a shaft comes to rest or breaks away, a hair decides which, so that a start from where it only seemed to be
/// has no way down to the right one.
fn carried(track: &Track, starts: &[[f64; 2]], rolled: &Rolled) -> Vec<[f64; 2]> {
    (0..starts.len())
        .map(|i| {
            if i == 0 || !track.segments[i].linked {
                return starts[i];
            }
            let [angle, speed] = rolled.ends[i - 1];
            let turns = ((starts[i][0] - angle) / TAU).round();
            [angle + TAU * turns, speed]
        })
        .collect()
}

/// Takes over the starts that fit their segment better.
fn keep_better(
    plant: &Plant,
    track: &Track,
    starts: &mut [[f64; 2]],
    other: &[[f64; 2]],
    rolled: &mut Rolled,
    errors: &mut [f64],
) {
    let trial = rollout(plant, track, other, Some(&rolled.hidden), false);
    let trial_errors = squared_errors(track, &trial.readings);
    let mut offset = 0;
    for (i, segment) in track.segments.iter().enumerate() {
        let length = segment.last - segment.first;
        if trial_errors[i] < errors[i] {
            starts[i] = other[i];
            errors[i] = trial_errors[i];
            rolled.readings[offset..offset + length].copy_from_slice(&trial.readings[offset..offset + length]);
            rolled.wipers[offset..offset + length].copy_from_slice(&trial.wipers[offset..offset + length]);
        }
        offset += length;
    }
}

/// Sensitivity of the readings to each segment's starting angle and speed.
#[must_use]
pub fn start_sensitivity(plant: &Plant, track: &Track, starts: &[[f64; 2]], rolled: &Rolled) -> [Vec<f64>; 2] {
    [0, 1].map(|axis| start_column(plant, track, starts, rolled, axis))
}

/// One column of [`start_sensitivity`].
#[must_use]
pub fn start_column(plant: &Plant, track: &Track, starts: &[[f64; 2]], rolled: &Rolled, axis: usize) -> Vec<f64> {
    let moved: Vec<[f64; 2]> = starts
        .iter()
        .map(|start| {
            let mut moved = *start;
            moved[axis] += STEP[axis];
            moved
        })
        .collect();
    let mut column = rollout(plant, track, &moved, Some(&rolled.hidden), false).readings;
    for (value, base) in column.iter_mut().zip(&rolled.readings) {
        *value = (*value - base) / STEP[axis];
    }
    column
}

/// One Gauss-Newton step of every start.
fn gauss_newton(plant: &Plant, track: &Track, starts: &[[f64; 2]], rolled: &Rolled) -> Vec<[f64; 2]> {
    let [angle, speed] = start_sensitivity(plant, track, starts, rolled);
    let mut offset = 0;
    track
        .segments
        .iter()
        .zip(starts)
        .map(|(segment, start)| {
            let mut normal = Normal2::default();
            for i in 0..segment.last - segment.first {
                let k = segment.first + i;
                if track.weight[k] > 0.0 {
                    let r = residual(track, segment, k, rolled.readings[offset + i]);
                    normal.add(angle[offset + i], speed[offset + i], r);
                }
            }
            offset += segment.last - segment.first;
            let step = normal.solve(normal.gradient);
            [start[0] + step[0], start[1] + step[1]]
        })
        .collect()
}

/// Normal equations of two unknowns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Normal2 {
    /// Sum of squares of the first column.
    pub aa: f64,
    /// Sum of products.
    pub ab: f64,
    /// Sum of squares of the second.
    pub bb: f64,
    /// Right-hand side.
    pub gradient: [f64; 2],
}

impl Normal2 {
    /// Adds a row.
    #[inline]
    pub fn add(&mut self, a: f64, b: f64, r: f64) {
        self.aa += a * a;
        self.ab += a * b;
        self.bb += b * b;
        self.gradient[0] += a * r;
        self.gradient[1] += b * r;
    }

    /// Solves for a right-hand side; slightly regularised, so that a segment that says nothing stays where it is.
    #[inline]
    #[must_use]
    pub fn solve(&self, right: [f64; 2]) -> [f64; 2] {
        let aa = self.aa * (1.0 + 1e-9) + 1e-12;
        let bb = self.bb * (1.0 + 1e-9) + 1e-12;
        let determinant = aa * bb - self.ab * self.ab;
        if determinant <= 1e-12 * aa * bb {
            return [right[0] / aa, 0.0];
        }
        [(bb * right[0] - self.ab * right[1]) / determinant, (aa * right[1] - self.ab * right[0]) / determinant]
    }
}

/// [`refine`] on every track, in parallel.
#[must_use]
pub fn refine_all(
    plant: &Plant,
    tracks: &[Track],
    starts: &mut Starts,
    guesses: &[Starts],
    rounds: usize,
) -> Vec<(Rolled, Vec<f64>)> {
    starts
        .par_iter_mut()
        .enumerate()
        .map(|(i, starts)| {
            let guesses: Vec<_> = guesses.iter().map(|guess| guess[i].clone()).collect();
            refine(plant, &tracks[i], starts, &guesses, rounds)
        })
        .collect()
}
