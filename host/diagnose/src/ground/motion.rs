//! How the shaft moves through a whole run, as a model of it follows the readings.

use std::f64::consts::TAU;

use super::super::model::{Hidden, Plant};
use super::super::rollout::{self, Rolled};
use super::super::track::{GAP, Segment, Track};
use common::wrap;

/// Length of the rollouts that the motion is put together from, s: so short that what the body is wrongly taken to do hardly leads them
/// astray, and so long that their starts hardly scatter.
const ROLLOUT_S: f64 = 0.05;
/// Readings whose parabola is the first guess of a rollout's start, s.
const GUESS_S: f64 = 0.02;
/// Fewer readings in a row are no rollout, and fewer samples no hole.
const FEWEST: usize = 10;
/// Times that the starts are refined.
const REFINED: usize = 3;

/// The shaft at a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShaftMotion {
    /// Angle, rad, not wrapped.
    pub angle: f64,
    /// Speed, rad/s.
    pub speed: f64,
    /// Acceleration, rad/s².
    pub acceleration: f64,
}

/// A run as a model follows it: rollouts from starts that suit the readings, end to end.
pub struct Followed {
    /// The shaft at each sample.
    pub motion: Vec<ShaftMotion>,
    /// What the sensor shows at each sample, rad; NaN before the first rollout and after the last one.
    pub readings: Vec<f64>,
}

/// Follows a whole run.
pub fn follow(plant: &Plant, track: &Track) -> Followed {
    let whole = Track { segments: rollouts(track), ..track.clone() };
    let mut starts = rollout::guess(&whole, GUESS_S);
    let at_rest = begun_at_rest(&whole, &starts);
    let (rolled, _) = rollout::refine(plant, &whole, &mut starts, &[at_rest], REFINED);
    let mut readings = vec![f64::NAN; whole.t.len()];
    let mut place = 0;
    for segment in &whole.segments {
        let length = segment.last - segment.first;
        readings[segment.first..segment.last].copy_from_slice(&rolled.readings[place..place + length]);
        place += length;
    }
    let mut angles = shaft_angles(plant, &whole, &starts, &rolled);
    level_joints(&mut angles, &whole);
    stand_at_the_ends(&mut angles);
    Followed { motion: differentiated(&whole.t, &angles), readings }
}

/// Where the shaft is at each sample of rollouts: the sensor shows it late where it has play, and bent. rad, not wrapped; NaN outside of
/// them.
fn shaft_angles(plant: &Plant, track: &Track, starts: &[[f64; 2]], rolled: &Rolled) -> Vec<f64> {
    let begun = track.segments.iter().zip(starts).zip(&rolled.hidden);
    let starts: Vec<[f64; 2]> =
        begun.map(|((segment, start), hidden)| rollout::shaft_at_start(plant, segment, *start, hidden)).collect();
    let at_the_wiper = |hidden: &Hidden| Hidden { wiper_behind: 0.0, held_behind: 0.0, ..*hidden };
    let hidden: Vec<Hidden> = rolled.hidden.iter().map(at_the_wiper).collect();
    let shaft = rollout::rollout(&plant.with_ideal_sensor(), track, &starts, Some(&hidden), false);
    let mut angles = vec![f64::NAN; track.t.len()];
    let mut place = 0;
    let mut reached: Option<f64> = None;
    for (segment, end) in track.segments.iter().zip(&shaft.ends) {
        let length = segment.last - segment.first;
        let from = shaft.wipers[place];
        // Readings tell an angle but for whole turns.
        let turns = reached.map_or(0.0, |reached| TAU * ((reached - from) / TAU).round());
        for (angle, wiper) in angles[segment.first..segment.last].iter_mut().zip(&shaft.wipers[place..]) {
            *angle = wiper + turns;
        }
        reached = Some(end.shaft[0] + turns);
        place += length;
    }
    angles
}

/// The starts, but that the run begins at rest near its first reading: nothing is seen of a speed in a hole before it.
fn begun_at_rest(track: &Track, starts: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let first = track.angle.iter().zip(&track.weight).find(|(_, weight)| **weight > 0.0);
    let mut rested = starts.to_vec();
    if let (Some(start), Some((&angle, _))) = (rested.first_mut(), first) {
        *start = [angle, 0.0];
    }
    rested
}

/// Rollouts from the run's beginning on, each to where the next one begins: at a reading, and through whatever the sensor does not show
/// before it, for one that began there would not know where. The first one goes on until enough readings tell where it began.
pub fn rollouts(track: &Track) -> Vec<Segment> {
    let read = |k: usize| track.weight[k] > 0.0;
    let (end, usual) = (track.t.len(), track.usual_step());
    let length = ROLLOUT_S.max(FEWEST as f64 * usual);
    let cut_before = |k: usize| k > 0 && track.t[k] - track.t[k - 1] >= GAP * usual;
    let mut segments: Vec<Segment> = Vec::new();
    let mut first = 0;
    while first < end {
        let linked = !segments.is_empty() && !cut_before(first);
        let long = |k: usize| track.t[k] - track.t[first] >= length - 0.5 * usual;
        let mut readings = usize::from(read(first));
        let mut ends = |k: usize| {
            let enough = linked || readings >= FEWEST && 2 * readings >= k - first;
            readings += usize::from(read(k));
            cut_before(k) || enough && long(k) && read(k)
        };
        let last = (first + 1..end).find(|&k| ends(k)).unwrap_or(end);
        let readings = (first..last).filter(|&k| read(k)).count();
        match segments.last_mut() {
            Some(before) if readings < FEWEST && linked => (before.last, before.whole) = (last, false),
            _ => segments.push(Segment { first, last, linked, whole: readings == last - first }),
        }
        first = last;
    }
    segments
}

/// Leads each rollout's end to where the next one begins, from its last reading on: they are off by what their starts are uncertain.
fn level_joints(angles: &mut [f64], track: &Track) {
    for pair in track.segments.windows(2).filter(|pair| pair[1].linked && pair[1].first >= 2) {
        let (first, last) = (pair[0].first, pair[1].first);
        // Where the rollout would be at the next one's first sample, at its last speed.
        let led_to = 2.0 * angles[last - 1] - angles[last - 2];
        let off = wrap(angles[last] - led_to);
        let seen =
            (first..last).rfind(|&k| track.weight[k] > 0.0).filter(|&seen| last - seen > FEWEST).unwrap_or(first);
        for (i, angle) in angles[seen..last].iter_mut().enumerate() {
            *angle += off * i as f64 / (last - seen) as f64;
        }
    }
}

/// Before the first rollout and after the last one the shaft stands.
fn stand_at_the_ends(angles: &mut [f64]) {
    let known = |angle: &f64| angle.is_finite();
    let (Some(first), Some(last)) = (angles.iter().position(known), angles.iter().rposition(known)) else {
        angles.fill(0.0);
        return;
    };
    let [begins, ends] = [angles[first], angles[last]];
    angles[..first].fill(begins);
    angles[last..].fill(ends);
}

/// Speeds and accelerations by differences over the two neighbours.
pub fn differentiated(t: &[f64], angles: &[f64]) -> Vec<ShaftMotion> {
    let slope = |values: &[f64], k: usize| {
        let (from, to) = (k.saturating_sub(1), (k + 1).min(t.len() - 1));
        (values[to] - values[from]) / (t[to] - t[from])
    };
    let speeds: Vec<f64> = (0..t.len()).map(|k| slope(angles, k)).collect();
    let at = |k: usize| ShaftMotion { angle: angles[k], speed: speeds[k], acceleration: slope(&speeds, k) };
    (0..t.len()).map(at).collect()
}
