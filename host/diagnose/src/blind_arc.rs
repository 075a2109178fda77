//! Readings from a potentiometer's blind arc, where the wiper stands on insulation and the code means nothing.
//!
//! Codes beyond the track's ends are recognised by themselves. A floating wiper may also show a code from the middle of the
//! track: random ones, which jump, and ones that drift, which look like a motion. The first are known by their jumps, the
//! second by where a model says that the shaft is.

use std::f64::consts::PI;

use common::wrap;
use robot_file::robot::{Robot, Sensor};

use super::model::Plant;
use super::rollout;
use super::track::{Segment, Track};

/// Angle (rad) on either side of the arc in which a reading is not trusted either: the ends' own tolerance, the wiper's play
/// and the sensor's error.
pub const MARGIN: f64 = 0.1;
/// Fewer readings in a row that follow each other are none.
const SHORTEST: usize = 5;

/// Rounds of fitting a window's start.
const ROUNDS: usize = 4;
/// A reading that is farther than this from a model's, rad, is not explained by it.
const UNEXPLAINED: f64 = 0.1;
/// A model that leaves more than this share of a window's readings unexplained has lost the shaft.
const LOST: f64 = 0.25;
/// What a reading that is dropped counts beside one that is unexplained: a start in the arc drops everything and explains
/// nothing.
const DROPPED: f64 = 0.5;
/// Standard deviations of the reading within which two of them differ by noise.
const NOISE: f64 = 6.0;
/// Starts at rest that are tried in the arc, as shares of its half width.
const AT_REST: [f64; 5] = [-0.9, -0.45, 0.0, 0.45, 0.9];

/// The arc in which readings of a potentiometer mean nothing, on the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlindArc {
    /// Its middle, rad.
    pub middle: f64,
    /// Half of its width, rad.
    pub half_width: f64,
}

impl BlindArc {
    /// As the sensor's calibration found it, else as its nominal electrical angle leaves it, with [`MARGIN`]. `None` for a
    /// sensor without one.
    #[must_use]
    pub fn of(robot: &Robot) -> Option<Self> {
        let Sensor::Potentiometer(sensor) = &robot.sensor else { return None };
        let nominal = PI - 0.5 * sensor.electrical_angle_deg.value.to_radians();
        let [from, to] = sensor.correction.as_ref().map_or([-nominal, nominal], |correction| {
            [correction.blind_from_deg.to_radians(), correction.blind_to_deg.to_radians()]
        });
        Some(Self { middle: 0.5 * (from + to), half_width: 0.5 * (to - from) + MARGIN })
    }

    /// Whether an angle (rad) lies in it.
    #[must_use]
    pub fn contains(&self, angle: f64) -> bool {
        wrap(angle - self.middle).abs() < self.half_width
    }
}

/// Drops readings that no shaft can have: stretches of fewer than five in which each is within reach of the one before, at
/// the motor's speed without load (rad/s), with a reading's standard deviation (rad) counted.
pub fn drop_jumps(readings: &mut [Option<f64>], times: &[f64], no_load: f64, deviation: f64) {
    let follows = |readings: &[Option<f64>], i: usize| match (readings[i - 1], readings[i]) {
        (Some(before), Some(now)) => {
            wrap(now - before).abs() <= no_load * (times[i] - times[i - 1]) + NOISE * deviation
        }
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
/// rest. Where the model has lost the shaft, and at the beginning, it begins anew: at the readings, or at rest in the arc,
/// whichever explains more. Returns the readings that are left unexplained, those dropped counted by half.
pub fn drop_blind(track: &mut Track, plant: &Plant, window_s: f64, arc: BlindArc) -> f64 {
    let segments = std::mem::take(&mut track.segments);
    let mut before: Option<[f64; 2]> = None;
    let mut unexplained = 0.0;
    for window in track.windows(window_s) {
        // On its own, and its turns not counted: the model may be a turn off.
        track.segments = vec![Segment { linked: false, ..window }];
        let carried = before.filter(|_| window.linked).map(|end| follow(track, plant, end, arc));
        let followed = match carried {
            Some(followed) if !followed.lost() => followed,
            carried => carried
                .into_iter()
                .chain(anew(track, plant, window_s, arc))
                .min_by(|a, b| a.cost().total_cmp(&b.cost()))
                .unwrap_or_default(),
        };
        unexplained += followed.cost();
        track.dropped += followed.dropped.len();
        for &k in &followed.dropped {
            track.angle[k] = f64::NAN;
            track.weight[k] = 0.0;
        }
        before = followed.end.filter(|_| !followed.lost());
    }
    track.segments = segments;
    unexplained
}

/// How the model follows a window from one start.
#[derive(Default)]
struct Followed {
    /// Samples that it reads in the arc.
    dropped: Vec<usize>,
    /// Readings that are left, and how many of them it does not explain.
    left: usize,
    unexplained: usize,
    /// Angle (rad) and speed (rad/s) at the window's end.
    end: Option<[f64; 2]>,
}

impl Followed {
    fn lost(&self) -> bool {
        self.unexplained as f64 > LOST * self.left as f64
    }

    fn cost(&self) -> f64 {
        self.unexplained as f64 + DROPPED * self.dropped.len() as f64
    }
}

/// Follows the track's only segment from every start that needs no past.
fn anew(track: &mut Track, plant: &Plant, window_s: f64, arc: BlindArc) -> Vec<Followed> {
    let mut readings = rollout::guess_without_past(track, 0.25 * window_s);
    let _ = rollout::refine(plant, track, &mut readings, &[rollout::guess_without_past(track, window_s)], ROUNDS);
    let at_rest = AT_REST.map(|share| [arc.middle + share * arc.half_width, 0.0]);
    readings.into_iter().chain(at_rest).map(|start| follow(track, plant, start, arc)).collect()
}

/// Follows the track's only segment from a start; the track is left as it was.
fn follow(track: &mut Track, plant: &Plant, start: [f64; 2], arc: BlindArc) -> Followed {
    let segment = track.segments[0];
    let samples = segment.first..segment.last;
    let weights = track.weight[samples.clone()].to_vec();
    let mut start = vec![start];
    let dropped = in_arc(track, plant, &start, arc);
    for &k in &dropped {
        track.weight[k] = 0.0;
    }
    let (rolled, _) = rollout::refine(plant, track, &mut start, &[], ROUNDS);
    let left = samples.clone().filter(|&k| track.weight[k] > 0.0).count();
    let residual = |k: usize| rollout::residual(track, &segment, k, rolled.readings[k - segment.first]);
    let unexplained = samples.clone().filter(|&k| residual(k).abs() > UNEXPLAINED).count();
    track.weight[samples].copy_from_slice(&weights);
    Followed { dropped, left, unexplained, end: rolled.ends.first().map(|end| end.shaft) }
}

/// Samples that the track's only segment reads in the arc, as the model goes from a start.
fn in_arc(track: &Track, plant: &Plant, start: &[[f64; 2]], arc: BlindArc) -> Vec<usize> {
    let segment = track.segments[0];
    let rolled = rollout::rollout(plant, track, start, None, false);
    let samples = (segment.first..segment.last).zip(&rolled.wipers);
    samples.filter(|(k, wiper)| track.weight[*k] > 0.0 && arc.contains(**wiper)).map(|(k, _)| k).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use robot_file::robot::Correction;

    use super::*;

    fn bench() -> Robot {
        Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap()
    }

    #[test]
    fn the_arc_is_where_the_calibration_found_it() {
        let mut robot = bench();
        let nominal = BlindArc::of(&robot).unwrap();
        let Sensor::Potentiometer(sensor) = &mut robot.sensor else { panic!("the bench has a potentiometer") };
        let missing = (360.0 - sensor.electrical_angle_deg.value).to_radians();
        assert_eq!(nominal.middle, 0.0);
        assert!((nominal.half_width - (0.5 * missing + MARGIN)).abs() < 1e-12);
        sensor.correction = Some(Correction {
            zero_deg: 0.0,
            deg_per_code: 0.1,
            cos_deg: Vec::new(),
            sin_deg: Vec::new(),
            blind_from_deg: -20.0,
            blind_to_deg: 40.0,
            residual_deg: 0.1,
            source: "test".to_owned(),
        });
        let found = BlindArc::of(&robot).unwrap();
        let inside = |degrees: f64| found.contains(degrees.to_radians());
        let margin = MARGIN.to_degrees();
        assert!(inside(39.0 + margin) && !inside(41.0 + margin) && inside(-19.0 - margin) && !inside(-21.0 - margin));
        robot.sensor = Sensor::Ideal;
        assert_eq!(BlindArc::of(&robot), None);
    }

    #[test]
    fn jumps_are_dropped_and_noise_is_not() {
        // At rest, with codes that a wiper on insulation shows in the middle.
        let times: Vec<f64> = (0..40).map(|i| 1e-3 * f64::from(i)).collect();
        let noisy: Vec<Option<f64>> = (0..40).map(|i| Some(if i % 2 == 0 { 0.02 } else { -0.02 })).collect();
        let mut readings = noisy.clone();
        for (i, jump) in [(20, 2.0), (21, -1.0), (22, 3.0)] {
            readings[i] = Some(jump);
        }
        // A shaft of 1 rad/s moves 1 mrad a sample: only the noise explains what follows.
        drop_jumps(&mut readings, &times, 1.0, 0.01);
        let dropped: Vec<usize> = (0..40).filter(|&i| readings[i].is_none()).collect();
        assert_eq!(dropped, [20, 21, 22]);
        let mut readings = noisy;
        drop_jumps(&mut readings, &times, 1.0, 1e-6);
        assert!(readings.iter().all(Option::is_none));
    }
}
