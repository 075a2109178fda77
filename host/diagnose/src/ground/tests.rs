//! Walks of the simulator, whose truth is known, as their readings alone tell them.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use effects::{Effect, GravityTilt};
use robot_file::robot::Robot;
use simulation::{Drive, Place, Plan, Walk};

use super::body::Shaken;
use super::motion::{ShaftMotion, differentiated, follow};
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

#[test]
fn how_a_body_pulls_is_found_or_said_to_be_unknown() {
    let unknown =
        |track: &Track| track.unknown.iter().filter(|unknown| **unknown).count() as f64 / track.t.len() as f64;
    let (robot, track, truth, plant) = run(Place::Ground, "freq:6.3", 2.0);
    let mut tracks = [track];
    pull(&robot, &plant, &mut tracks, ROLLOUT_S, NOISE, 1).unwrap();
    pull(&robot, &plant, &mut tracks, ROLLOUT_S, NOISE, 2).unwrap();
    let [steady] = tracks;
    let pose = steady.first_pose.unwrap();
    let mut body = Shaken::new(&robot, &steady.t, pose, truth[0].angle, 1).unwrap();
    let real = body.advance(steady.t.len() - 1, &[truth]).swap_remove(0);
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let off = squares(&mut real.iter().zip(&steady.load_torque).map(|(real, found)| real - found));
    let off = (off / squares(&mut real.iter().copied())).sqrt();
    assert!(off < 0.4 && unknown(&steady) < 0.05, "{off} of the torque, {} unknown", unknown(&steady));

    let (robot, track, _, plant) = run(Place::Ground, "oscillate:-100..100", 4.0);
    let mut tracks = [track];
    pull(&robot, &plant, &mut tracks, ROLLOUT_S, NOISE, 1).unwrap();
    let [jumping] = tracks;
    assert!(unknown(&jumping) > 0.05, "{} unknown", unknown(&jumping));
    let mut known = jumping.clone();
    known.unknown = Vec::new();
    let cut = Cut { horizon_s: ROLLOUT_S, most_segments: usize::MAX };
    known.cut(cut);
    let mut left = jumping;
    left.cut(cut);
    assert!(left.segments.len() < known.segments.len(), "{} rollouts of {}", left.segments.len(), known.segments.len());
}
