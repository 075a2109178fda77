//! Walks of the simulator, whose truth is known, as their readings alone tell them.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use effects::{Effect, GravityTilt};
use robot_file::robot::Robot;
use simulation::{Drive, Place, Plan, Walk};

use super::body::DrivenBodies;
use super::motion::{ShaftMotion, differentiated, follow, rollouts};
use super::*;
use crate::fit::Fit;
use crate::nominal::FileModel;
use crate::track::Cut;
use common::wrap;
use recording::Recording;

/// Length of a rollout, s, and the mean square noise of the project's potentiometer, rad².
const ROLLOUT_S: f64 = 0.1;
const NOISE: f64 = 3e-5;

/// A run: its readings, how its shaft really moved at their times, and the file's own model.
fn run(place: Place, drive: &str, seconds: f64) -> (Robot, Track, Vec<ShaftMotion>, Plant) {
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
    let plan = Plan { drive: Drive::parse(drive).unwrap(), seconds, faults: Vec::new() };
    let ran = simulation::simulate(&robot, &robot, place, 3, &plan, &AtomicBool::new(false)).expect("the robot walks");
    let pose = ran.walk.as_ref().map_or_else(Vec::new, Walk::poses_of_rows);
    let recording = Recording { pose, ..simulation::recording(&ran.trace, &robot) };
    let track = Track::new(&robot, &recording, 0).unwrap();
    let ticks: Vec<f64> = ran.trace.ticks.iter().map(|tick| tick.time_s).collect();
    let angles: Vec<f64> = ran.trace.ticks.iter().map(|tick| tick.truth.angle).collect();
    let mut truth = differentiated(&ticks, &angles);
    for (motion, late) in truth.iter_mut().zip(track.t.iter().zip(&ticks).map(|(read, tick)| read - tick)) {
        motion.angle += motion.speed * late;
        motion.speed += motion.acceleration * late;
    }
    let mut level = robot.clone();
    if place == Place::Ground {
        level.effects.remove(GravityTilt::SPEC.name);
    }
    let model = FileModel::new(&level);
    let plant = Fit::begin(&model, &[], 0, Vec::new()).plant(&model);
    (robot, track, truth, plant)
}

#[test]
fn the_shaft_is_followed_and_not_the_wiper() {
    let (_, track, truth, plant) = run(Place::Bench, "oscillate:-60..60", 2.0);
    let followed = follow(&plant, &track).motion;
    let usual = |turning: f64| {
        let turns = truth.iter().zip(&followed).filter(|(truth, _)| truth.speed * turning > 20.0);
        let mut off: Vec<f64> = turns.map(|(truth, followed)| wrap(followed.angle - truth.angle)).collect();
        common::median(&mut off).unwrap().to_degrees()
    };
    // The wiper hangs back by half of the potentiometer's play of 1°, either way.
    let play = usual(1.0) - usual(-1.0);
    assert!(play.abs() < 0.4, "{play}°");
}

/// The run after so many rounds of finding how the body pulls.
fn pulled((robot, track, plant): (&Robot, Track, &Plant), rounds: u64) -> Track {
    let mut track = track;
    for round in 0..rounds {
        update_pull(robot, plant, std::iter::once((&mut track, NOISE)), ROLLOUT_S, round).unwrap();
    }
    track
}

/// Share of a run's rollouts that are left.
fn left(track: &Track) -> f64 {
    let cut = |pull_unknown: Vec<bool>| {
        let mut cut = Track { pull_unknown, ..track.clone() };
        cut.cut(Cut { horizon_s: ROLLOUT_S, most_segments: usize::MAX });
        cut.segments.len() as f64
    };
    cut(track.pull_unknown.clone()) / cut(Vec::new())
}

#[test]
fn how_a_body_pulls_is_found_where_its_gait_repeats() {
    let (robot, track, truth, plant) = run(Place::Ground, "freq:6.3", 2.0);
    let steady = pulled((&robot, track, &plant), 2);
    let mut body = DrivenBodies::new(&robot, &steady.t, steady.first_pose.unwrap(), 1).unwrap();
    let real = body.advance(steady.t.len() - 1, &[truth]).swap_remove(0);
    let size = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    let off = size(&mut real.iter().zip(&steady.load_torque).map(|(real, found)| real - found));
    // The sensor's curve is not fitted here, and half a degree moves the torque by a fifth.
    let off = off / size(&mut real.iter().copied());
    assert!(off < 0.4 && left(&steady) == 1.0, "{off} of the torque, {} left", left(&steady));
}

#[test]
fn where_a_gait_does_not_repeat_rollouts_are_left_out() {
    let (robot, track, _, plant) = run(Place::Ground, "oscillate:-100..100", 4.0);
    let jumping = pulled((&robot, track, &plant), 1);
    assert!(left(&jumping) < 1.0, "{} left", left(&jumping));
}

#[test]
fn slow_readings_are_followed_in_pieces_too() {
    let (_, track, truth, plant) = run(Place::Bench, "freq:6", 3.0);
    let every = |values: &[f64]| values.iter().step_by(10).copied().collect::<Vec<f64>>();
    let slow = Track {
        t: every(&track.t),
        angle: every(&track.angle),
        weight: every(&track.weight),
        drive: every(&track.drive),
        drive_integral: every(&track.drive_integral),
        since_reversal: every(&track.since_reversal),
        enable: track.enable.iter().step_by(10).copied().collect(),
        supply_v: every(&track.supply_v),
        ..track
    };
    // Of 3 s: 0.1 s each, and on through the blind arc.
    assert!(rollouts(&slow).len() > 10, "{} rollouts", rollouts(&slow).len());
    let followed = follow(&plant, &slow).motion;
    let off = |(k, followed): (usize, &ShaftMotion)| wrap(followed.angle - truth[10 * k].angle).abs();
    let mut off: Vec<f64> = followed.iter().enumerate().map(off).collect();
    let usual = common::median(&mut off).unwrap();
    assert!(usual < 0.05, "{usual} rad");
}
