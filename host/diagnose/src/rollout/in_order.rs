//! Starts that are refined one after the other.
//!
//! Where a motor and its load meet and part, a hair at the start of one segment decides how their teeth stand at the start of the next. Starts
//! that are all refined at once then never settle; in order, each is refined with what the ones before it leave behind for good.

use super::{SETTLED, SHORTER, STEP, Step, beginning, on_turn, shaft_at_start, squared_error, step_of};
use crate::model::{Boundary, Hidden, Plant};
use crate::track::{Segment, Track};
use hal_sim::shaft::Stepper;

/// Fewest steps that a start may take.
const FEWEST_STEPS: usize = 3;

/// Refines every start by Gauss-Newton with the plant's numbers fixed, from the best of several guesses.
pub(super) fn refine(plant: &Plant, track: &Track, starts: &mut [[f64; 2]], guesses: &[Vec<[f64; 2]>], rounds: usize) {
    let mut stepper = plant.stepper(track);
    let mut end = Boundary::default();
    for (i, segment) in track.segments.iter().enumerate() {
        let mut candidates: Vec<[f64; 2]> = guesses.iter().map(|guess| guess[i]).collect();
        candidates.push(if segment.linked { on_turn(end.shaft, starts[i]) } else { [track.angle[segment.first], 0.0] });
        let mut one = OneSegment { plant, track, segment, stepper: &mut stepper };
        let mut best = one.begun(starts[i], &end.hidden);
        for start in candidates {
            let tried = one.begun(start, &end.hidden);
            if tried.error < best.error {
                best = tried;
            }
        }
        let best = one.descend(best, rounds.max(FEWEST_STEPS));
        (starts[i], end) = (best.start, best.end);
    }
}

/// A start of a segment, what no sensor sees there, and where they lead.
struct Tried {
    start: [f64; 2],
    hidden: Hidden,
    readings: Vec<f64>,
    end: Boundary,
    error: f64,
}

struct OneSegment<'a> {
    plant: &'a Plant,
    track: &'a Track,
    segment: &'a Segment,
    stepper: &'a mut Stepper,
}

impl OneSegment<'_> {
    /// From a start after what the segment before has left.
    fn begun(&mut self, start: [f64; 2], left: &Hidden) -> Tried {
        let hidden = if self.segment.linked {
            *left
        } else {
            beginning(self.plant, self.track, self.segment, start, &left.states, self.stepper)
        };
        self.tried(start, hidden)
    }

    fn tried(&mut self, start: [f64; 2], hidden: Hidden) -> Tried {
        let Self { plant, track, segment, .. } = *self;
        let mut readings = vec![0.0; segment.last - segment.first];
        let shaft = shaft_at_start(plant, segment, start, &hidden);
        let end = plant.rollout(track, segment, Boundary { hidden, shaft }, self.stepper, &mut readings, None);
        for reading in &mut readings {
            *reading = plant.reading(*reading);
        }
        let error = squared_error(track, segment, readings.iter().copied());
        Tried { start, hidden, readings, end, error }
    }

    fn descend(&mut self, mut best: Tried, steps: usize) -> Tried {
        for _ in 0..steps {
            let before = best.error;
            let step = self.gauss_newton(&best);
            if step.promised <= SETTLED * before {
                break;
            }
            let shares = [1.0, 0.5].into_iter().chain(SHORTER);
            let mut trials = shares.map(|share| self.tried(step.from(best.start, share), best.hidden));
            let Some(lower) = trials.find(|trial| trial.error < before) else { break };
            best = lower;
            if before - best.error <= SETTLED * before {
                break;
            }
        }
        best
    }

    fn gauss_newton(&mut self, at: &Tried) -> Step {
        let [angle, speed] = [0, 1].map(|axis| {
            let mut moved = at.start;
            moved[axis] += STEP[axis];
            let moved = self.tried(moved, at.hidden).readings;
            moved.iter().zip(&at.readings).map(|(moved, at)| (moved - at) / STEP[axis]).collect::<Vec<f64>>()
        });
        step_of(self.track, self.segment, &at.readings, [&angle, &speed])
    }
}
