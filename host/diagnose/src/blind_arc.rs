//! Readings from a potentiometer's blind arc, where the wiper stands on insulation and the code means nothing.
//!
//! Codes beyond the track's ends are recognised by themselves. A floating wiper may also show a code from the middle of the
//! track: random ones, which jump, and ones that drift, which look like a motion. The first are known by their jumps, the
//! second by where the file's model says that the shaft is.

use std::f64::consts::PI;

use common::wrap;
use robot_file::robot::{Robot, Sensor};

use super::model::Plant;
use super::rollout;
use super::track::{Segment, Track};

/// Angle (rad) beyond the arc's nominal ends in which a reading is not trusted either: the ends' own tolerance, the wiper's
/// play and the sensor's error.
const MARGIN: f64 = 0.1;
/// Fewer readings in a row that follow each other are none.
const SHORTEST: usize = 5;

/// Rounds of fitting a segment's start.
const ROUNDS: usize = 4;
/// A model that is this far off, rad RMS, has lost the shaft.
const LOST: f64 = 0.2;

/// Half of the arc around shaft angle 0 in which readings of a robot's sensor mean nothing, rad.
#[must_use]
pub fn half_width(robot: &Robot) -> Option<f64> {
    let Sensor::Potentiometer(sensor) = &robot.sensor else { return None };
    let nominal = PI - 0.5 * sensor.electrical_angle_deg.value.to_radians();
    Some(nominal + MARGIN)
}

/// Drops readings that no shaft can have: stretches of fewer than five in which each is within reach of the one before, at
/// the motor's speed without load (rad/s).
pub fn drop_jumps(readings: &mut [Option<f64>], times: &[f64], no_load: f64) {
    let follows = |readings: &[Option<f64>], i: usize| match (readings[i - 1], readings[i]) {
        (Some(before), Some(now)) => wrap(now - before).abs() <= no_load * (times[i] - times[i - 1]),
        _ => false,
    };
    let mut first = 0;
    while first < readings.len() {
        let mut last = first + 1;
        while last < readings.len() && follows(readings, last) {
            last += 1;
        }
        if last - first < SHORTEST {
            readings[first..last].fill(None);
        }
        first = last;
    }
}

/// Drops the readings that a track has while the model says that the wiper stands in the blind arc. The model follows the
/// run window by window (s): each begins where the one before ends, loses what it reads in the arc, and is fitted to the
/// rest. Where the model has lost the shaft it begins anew at the readings.
pub fn drop_blind(track: &mut Track, plant: &Plant, window_s: f64, half_width: f64) {
    let segments = std::mem::take(&mut track.segments);
    let mut before: Option<[f64; 2]> = None;
    for window in track.windows(window_s) {
        // On its own, and its turns not counted: the model may be a turn off.
        track.segments = vec![Segment { linked: false, ..window }];
        let mut start = before.filter(|_| window.linked).map_or_else(|| begin(track, plant, window_s), |end| vec![end]);
        drop_in_arc(track, plant, &start, half_width);
        let (rolled, errors) = rollout::refine(plant, track, &mut start, &[], ROUNDS);
        let readings: f64 = track.weight[window.first..window.last].iter().sum();
        let lost = readings > 0.0 && errors[0] > LOST * LOST * readings;
        before = if lost { None } else { rolled.ends.first().copied() };
    }
    track.segments = segments;
}

/// Angle and speed at the beginning of the track's only segment, from its readings.
fn begin(track: &Track, plant: &Plant, window_s: f64) -> Vec<[f64; 2]> {
    let mut start = rollout::guess(track, 0.25 * window_s);
    let _ = rollout::refine(plant, track, &mut start, &[rollout::guess(track, window_s)], ROUNDS);
    start
}

/// Drops what the track's only segment reads in the arc, as the model goes from a start.
fn drop_in_arc(track: &mut Track, plant: &Plant, start: &[[f64; 2]], half_width: f64) {
    let segment = track.segments[0];
    let rolled = rollout::rollout(plant, track, start, None, false);
    for (k, wiper) in (segment.first..segment.last).zip(&rolled.wipers) {
        if wrap(*wiper).abs() < half_width && track.angle[k].is_finite() {
            track.angle[k] = f64::NAN;
            track.weight[k] = 0.0;
        }
    }
}
