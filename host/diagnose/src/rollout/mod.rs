//! All rollouts of a set of runs at once, and the starts (angle and speed) that each of them needs.

mod in_order;

use std::f64::consts::TAU;

use rayon::prelude::*;

use effects::States;
use hal_sim::shaft::Stepper;

use crate::model::{Boundary, Hidden, Plant};
use crate::track::{GAP, Segment, Track};
use common::wrap;

/// Angle and speed at the start of every segment, by track.
pub type Starts = Vec<Vec<[f64; 2]>>;

/// The step of a start's angle (rad) and speed (rad/s) from which sensitivities are taken.
const STEP: [f64; 2] = [1e-4, 5e-3];

/// Starts have settled where a round, or of one of them a step, changes the squared error by less than this share.
const SETTLED: f64 = 1e-4;
/// A step promises much if it is this share of the squared error, and it is then tried at these shares of its length too.
const PROMISED: f64 = 0.01;
const SHORTER: [f64; 3] = [0.2, 0.08, 0.03];

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
    /// What each segment ends with.
    pub ends: Vec<Boundary>,
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
        rolled.ends.push(end);
        offset += length;
    }
    rolled.currents.truncate(if with_current { total } else { 0 });
    rolled.readings = rolled.wipers.iter().map(|wiper| plant.reading(*wiper)).collect();
    rolled
}

/// What no sensor sees at each segment's start of some rollouts, as another plant has it than the one they are of.
#[must_use]
pub fn hidden_as_begun(plant: &Plant, base: &Plant, rolled: &Rolled) -> Vec<Hidden> {
    rolled.hidden.iter().map(|hidden| plant.take_over(hidden, base)).collect()
}

/// The same as this plant leaves the segment before, which it begins as those did.
#[must_use]
pub fn hidden_from_one_before(
    plant: &Plant,
    base: &Plant,
    track: &Track,
    starts: &[[f64; 2]],
    rolled: &Rolled,
) -> Vec<Hidden> {
    let begun = hidden_as_begun(plant, base, rolled);
    let ends = rollout(plant, track, starts, Some(&begun), false).ends;
    let at_start = |i: usize| if track.segments[i].linked { ends[i - 1].hidden } else { begun[i] };
    (0..begun.len()).map(at_start).collect()
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
        squared_error(track, segment, wipers.iter().map(|wiper| plant.reading(*wiper)))
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
            let own = offset..offset + segment.last - segment.first;
            offset = own.end;
            squared_error(track, segment, readings[own].iter().copied())
        })
        .collect()
}

/// The same of one segment.
fn squared_error(track: &Track, segment: &Segment, readings: impl Iterator<Item = f64>) -> f64 {
    let left = |(sample, reading)| residual(track, segment, sample, reading).powi(2);
    (segment.first..segment.last).zip(readings).map(left).sum()
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

/// First guess of every start: a parabola through the readings of `window_s` about it, or after it where none lead up to it. One through
/// those after it alone hardly shows the speed of a shaft that turns back there, and from a guess of the other sign, with which friction and
/// play act the other way, no step of a refinement leads to the right one. Where a segment begins with a hole, the shaft is taken to have had
/// the first reading's speed all along: a parabola would go astray there.
#[must_use]
pub fn guess(track: &Track, window_s: f64) -> Vec<[f64; 2]> {
    guesses(track, window_s, true)
}

/// The same by the readings from the start on alone, for segments before which nothing is known.
#[must_use]
pub fn guess_without_past(track: &Track, window_s: f64) -> Vec<[f64; 2]> {
    guesses(track, window_s, false)
}

fn guesses(track: &Track, window_s: f64, with_past: bool) -> Vec<[f64; 2]> {
    let gap = GAP * track.usual_step();
    let guess = |segment: &Segment| {
        let read = |&k: &usize| track.weight[k] > 0.0;
        let Some(first) = (segment.first..segment.last).find(read) else { return [0.0; 2] };
        let t0 = track.t[first];
        let past = if with_past && first == segment.first { 0..first } else { 0..0 };
        let leads_up = |&k: &usize| read(&k) && t0 - track.t[k] <= 0.5 * window_s && track.t[k + 1] - track.t[k] < gap;
        let mut points: Vec<(f64, f64)> =
            past.rev().take_while(leads_up).map(|k| (track.t[k] - t0, track.angle[k])).collect();
        let upto = if points.is_empty() { window_s } else { 0.5 * window_s };
        for k in (first..segment.last).filter(read) {
            if track.t[k] - t0 > upto && points.len() >= 8 {
                break;
            }
            points.push((track.t[k] - t0, track.angle[k]));
        }
        let [angle, speed] = parabola(&points);
        [angle - speed * (t0 - track.t[segment.first]), speed]
    };
    track.segments.iter().map(guess).collect()
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
    if plant.has_play() {
        in_order::refine(plant, track, starts, guesses, rounds);
        let rolled = rollout(plant, track, starts, None, false);
        let errors = squared_errors(track, &rolled.readings);
        return (rolled, errors);
    }
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
        let steps = gauss_newton(plant, track, starts, &rolled);
        let (begun, before): (Vec<[f64; 2]>, f64) = (starts.to_vec(), errors.iter().sum());
        let carried = carried(track, starts, &rolled);
        keep_better(plant, track, starts, &carried, &mut rolled, &mut errors);
        let moved = |share: f64| -> Vec<[f64; 2]> {
            begun.iter().zip(&steps).map(|(start, step)| step.from(*start, share)).collect()
        };
        let whole = moved(1.0);
        keep_better(plant, track, starts, &whole, &mut rolled, &mut errors);
        if *starts != whole {
            keep_better(plant, track, starts, &moved(0.5), &mut rolled, &mut errors);
        }
        let stuck = |i: &usize| starts[*i] == begun[*i] && steps[*i].promised > PROMISED * errors[*i];
        let stuck: Vec<usize> = (0..starts.len()).filter(stuck).collect();
        step_shorter(plant, track, starts, &steps, (&rolled.hidden, &errors), &stuck);
        // The hidden states follow the new starts.
        rolled = rollout(plant, track, starts, None, false);
        errors = squared_errors(track, &rolled.readings);
        let after: f64 = errors.iter().sum();
        if (before - after).abs() <= SETTLED * before {
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
            on_turn(rolled.ends[i - 1].shaft, starts[i])
        })
        .collect()
}

/// An angle and a speed, on the turn of others.
fn on_turn([angle, speed]: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [angle + TAU * ((other[0] - angle) / TAU).round(), speed]
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

/// A step of one start.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Of the angle (rad) and the speed (rad/s).
    by: [f64; 2],
    /// What a linear model promises that it takes from the squared error, rad².
    promised: f64,
}

impl Step {
    /// Where a share of it leads.
    fn from(&self, start: [f64; 2], share: f64) -> [f64; 2] {
        [start[0] + share * self.by[0], start[1] + share * self.by[1]]
    }
}

/// One Gauss-Newton step of every start.
fn gauss_newton(plant: &Plant, track: &Track, starts: &[[f64; 2]], rolled: &Rolled) -> Vec<Step> {
    let [angle, speed] = start_sensitivity(plant, track, starts, rolled);
    let mut offset = 0;
    let step = |segment: &Segment| {
        let own = offset..offset + segment.last - segment.first;
        offset = own.end;
        step_of(track, segment, &rolled.readings[own.clone()], [&angle[own.clone()], &speed[own]])
    };
    track.segments.iter().map(step).collect()
}

/// The Gauss-Newton step of a segment's start, by its readings and their sensitivities to it.
fn step_of(track: &Track, segment: &Segment, readings: &[f64], [angle, speed]: [&[f64]; 2]) -> Step {
    let mut normal = Normal2::default();
    for (i, sample) in (segment.first..segment.last).enumerate() {
        if track.weight[sample] > 0.0 {
            normal.add(angle[i], speed[i], residual(track, segment, sample, readings[i]));
        }
    }
    let by = normal.solve(normal.gradient);
    Step { by, promised: by[0] * normal.gradient[0] + by[1] * normal.gradient[1] }
}

/// Takes shorter steps of those starts for which a step promises much and neither the whole of it nor half of it brings anything: where a
/// shaft turns back, what one more rad/s at the start does is soon another thing.
fn step_shorter(
    plant: &Plant,
    track: &Track,
    starts: &mut [[f64; 2]],
    steps: &[Step],
    (hidden, errors): (&[Hidden], &[f64]),
    stuck: &[usize],
) {
    if stuck.is_empty() {
        return;
    }
    let alone = Track { segments: stuck.iter().map(|&i| track.segments[i]).collect(), ..track.clone() };
    let hidden: Vec<Hidden> = stuck.iter().map(|&i| hidden[i]).collect();
    let from: Vec<[f64; 2]> = stuck.iter().map(|&i| starts[i]).collect();
    let mut least: Vec<f64> = stuck.iter().map(|&i| errors[i]).collect();
    for share in SHORTER {
        let moved: Vec<[f64; 2]> = stuck.iter().zip(&from).map(|(&i, start)| steps[i].from(*start, share)).collect();
        let tried = squared_errors(&alone, &rollout(plant, &alone, &moved, Some(&hidden), false).readings);
        for (((&i, moved), error), least) in stuck.iter().zip(&moved).zip(tried).zip(&mut least) {
            if error < *least {
                (starts[i], *least) = (*moved, error);
            }
        }
    }
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
