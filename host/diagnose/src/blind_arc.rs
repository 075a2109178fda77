//! Readings from a potentiometer's blind arc, where the wiper stands on insulation and the code means nothing.
//!
//! Codes beyond the track's ends are recognised by themselves. A floating wiper may also show a code from the middle of the
//! track: random ones, which jump, and ones that drift, which look like a motion. The first are known by their jumps, the
//! second by where the file's model says that the shaft is.

use std::f64::consts::PI;

use common::wrap;
use description::robot::{Robot, Sensor};

use super::model::{Hidden, Plant};
use super::track::Track;

/// Angle (rad) beyond the arc's nominal ends in which a reading is not trusted either: the ends' own tolerance, the wiper's
/// play and the sensor's error.
const MARGIN: f64 = 0.1;
/// Fewer readings in a row that follow each other are none.
const SHORTEST: usize = 5;

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

/// Drops the readings that a track has while the model says that the wiper stands in the blind arc. Where a segment begins
/// there, its start is what the one before leads to, not what the code says. Returns how many were dropped.
pub fn drop_blind(track: &mut Track, plant: &Plant, starts: &[[f64; 2]], half_width: f64) -> usize {
    let in_arc = |angle: f64| wrap(angle).abs() < half_width;
    let mut dropped = 0;
    let mut before: Option<super::model::End> = None;
    for (i, segment) in track.segments.clone().into_iter().enumerate() {
        let carried = before.filter(|_| segment.linked);
        let (start, hidden) = match carried {
            Some(end) if in_arc(end.shaft[0]) => (end.shaft, end.hidden),
            Some(end) => (starts[i], end.hidden),
            None => (starts[i], Hidden::default()),
        };
        let mut wipers = vec![0.0; segment.last - segment.first];
        before = Some(plant.roll(track, &segment, start, hidden, &mut wipers, None));
        for (k, wiper) in (segment.first..segment.last).zip(wipers) {
            if in_arc(wiper) && track.angle[k].is_finite() {
                track.angle[k] = f64::NAN;
                track.weight[k] = 0.0;
                dropped += 1;
            }
        }
    }
    dropped
}
