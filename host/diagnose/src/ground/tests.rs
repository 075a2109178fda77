//! Walks of the simulator, whose truth is known, as their readings alone tell them.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use effects::{Effect, GravityTilt, Id};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use robot_file::robot::Robot;
use simulation::{Drive, Place, Plan, Walk};

use super::body::DrivenBodies;
use super::motion::{ShaftMotion, differentiated, follow, rollouts};
use super::particles::PARTICLES;
use super::*;
use crate::fit::Fit;
use crate::nominal::FileModel;
use crate::numbers::Number;
use crate::rollout;
use crate::search;
use crate::session::Session;
use crate::track::{Cut, Segment};
use common::wrap;
use recording::Recording;

/// Length of a rollout, s, and the mean square noise of the project's potentiometer, rad².
const ROLLOUT_S: f64 = 0.1;
const NOISE: f64 = 3e-5;

/// A run of the default robot.
fn recorded(place: Place, drive: &str, seconds: f64) -> (Robot, Recording) {
    let (robot, recording, _) = simulated(place, drive, seconds);
    (robot, recording)
}

/// The same, and times (s) and angles (rad) of its shaft.
fn simulated(place: Place, drive: &str, seconds: f64) -> (Robot, Recording, [Vec<f64>; 2]) {
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
    let plan = Plan { drive: Drive::parse(drive).unwrap(), seconds, faults: Vec::new() };
    let ran = simulation::simulate(&robot, &robot, place, 3, &plan, &AtomicBool::new(false)).expect("the robot walks");
    let pose = ran.walk.as_ref().map_or_else(Vec::new, Walk::poses_of_rows);
    let recording = Recording { pose, ..simulation::recording(&ran.trace, &robot) };
    let ticks: Vec<f64> = ran.trace.ticks.iter().map(|tick| tick.time_s).collect();
    let angles: Vec<f64> = ran.trace.ticks.iter().map(|tick| tick.truth.angle).collect();
    (robot, recording, [ticks, angles])
}

/// A run: its readings, how its shaft really moved at their times, and the file's own model.
fn run(place: Place, drive: &str, seconds: f64) -> (Robot, Track, Vec<ShaftMotion>, Plant) {
    let (robot, recording, [ticks, angles]) = simulated(place, drive, seconds);
    let track = Track::new(&robot, &recording, 0).unwrap();
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
fn a_run_that_begins_in_the_blind_arc_is_followed_from_rest() {
    let (_, mut track, truth, plant) = run(Place::Bench, "duty:1", 1.0);
    let unread = track.t.iter().take_while(|t| **t < 0.04).count();
    track.angle[..unread].fill(f64::NAN);
    track.weight[..unread].fill(0.0);
    let followed = follow(&plant, &track).motion;
    let off = |k: usize| wrap(followed[k].angle - truth[k].angle).to_degrees().abs();
    let most = (0..unread).map(off).fold(0.0, f64::max);
    // Where it stood at the first reading it would be 50° off, and jump from rest to half of its speed.
    assert!(most < 10.0 && (followed[unread].speed - truth[unread].speed).abs() < 3.0, "{most}°");
}

#[test]
fn models_are_drawn_as_far_apart_as_the_fit_knows_its_numbers() {
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).unwrap();
    let model = FileModel::new(&robot);
    let mut fit = Fit::begin(&model, &[], 0, Vec::new());
    let place = fit.free.iter().position(|one| one.number == Number::OfEffect("cos1")).unwrap();
    fit.covariance[(place, place)] = 0.3f64.powi(2);
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let mut scatter = |share: f64| {
        let drawn = fit.drawn_plants(&model, share, &mut random).take(400);
        let read = |plant: Plant| plant.reading(0.0) - fit.plant(&model).reading(0.0);
        (drawn.map(|plant| read(plant).powi(2)).sum::<f64>() / 400.0).sqrt()
    };
    // In hundredths of a radian, as the sensor's curve is fitted.
    let (whole, half) = (scatter(1.0), scatter(0.5));
    assert!((whole / 3e-3 - 1.0).abs() < 0.15 && (half / whole - 0.5).abs() < 0.1, "{whole} and {half} rad");
}

#[test]
fn after_a_long_gap_nothing_says_where_the_body_is() {
    let (robot, mut track, _, plant) = run(Place::Ground, "freq:6.3", 1.0);
    let gap = track.t.len() / 2;
    track.t[gap..].iter_mut().for_each(|t| *t += 3600.0);
    let track = pulled(&robot, &vec![plant; PARTICLES], track);
    let known = |samples: &[bool]| samples.iter().filter(|unknown| !**unknown).count();
    let (before, after) = track.pull_unknown.split_at(gap);
    assert!(2 * known(before) > gap && known(after) == 0, "{} and {} known", known(before), known(after));
}

/// Rollouts that begin less than 10 ms before the shaft turns back, as where nothing says how a body pulled before; the file's own model; and
/// how fast the shaft was at each start, rad/s.
fn turning_back() -> (Track, Plant, Vec<f64>) {
    let (_, track, truth, plant) = run(Place::Bench, "oscillate:-60..60", 3.0);
    let steps = (ROLLOUT_S / track.usual_step()) as usize;
    let read = |k: usize| (k - 20..k + 20).all(|k| track.weight[k] > 0.0);
    let turns_back = |k: &usize| truth[*k].speed * truth[k + 10].speed < 0.0 && truth[*k].speed.abs() > 8.0 && read(*k);
    let begun: Vec<usize> = (20..track.t.len() - steps).filter(turns_back).collect();
    let segment = |&first: &usize| Segment { first, last: first + steps, linked: false, whole: false };
    let speeds = begun.iter().map(|&k| truth[k].speed).collect();
    (Track { segments: begun.iter().map(segment).collect(), ..track }, plant, speeds)
}

#[test]
fn a_rollout_that_begins_where_the_shaft_turns_back_is_followed() {
    let (track, plant, speeds) = turning_back();
    let mut starts = rollout::guess(&track, 0.25 * ROLLOUT_S);
    let _ = rollout::refine(&plant, &track, &mut starts, &[], 6);
    // A start on the other side of rest is off by 8 rad/s at least.
    let far = starts.iter().zip(&speeds).filter(|(start, speed)| (start[1] - **speed).abs() > 8.0).count();
    assert!(speeds.len() > 5 && far == 0, "{far} of {} starts", speeds.len());
}

#[test]
fn a_start_is_refined_from_afar_where_the_shaft_turns_back() {
    let (track, plant, _) = turning_back();
    let refined = |off: [f64; 2]| {
        let near = rollout::guess(&track, 0.25 * ROLLOUT_S);
        let mut starts: Vec<[f64; 2]> = near.iter().map(|start| [start[0] + off[0], start[1] + off[1]]).collect();
        rollout::refine(&plant, &track, &mut starts, &[], 12).1
    };
    let near = refined([0.0, 0.0]);
    let afar = [[0.1, 10.0], [-0.1, 10.0], [0.1, -10.0], [-0.1, -10.0]].map(refined);
    let stuck = afar.iter().flat_map(|one| one.iter().zip(&near)).filter(|(afar, near)| **afar > 1.5 * **near).count();
    // By whole and half steps alone 12 of 32 do not arrive. Nearly at rest, what no sensor sees there decides.
    assert!(near.len() >= 8 && stuck <= 6, "{stuck} of {} starts", 4 * near.len());
}

#[test]
fn walks_of_which_hardly_anything_is_known_are_refused() {
    // After a tenth of a second nothing says where the body is.
    let broken_off = |drive: &str| {
        let (robot, mut recording) = recorded(Place::Ground, drive, 0.6);
        recording.t_s.iter_mut().skip(100).for_each(|t| *t += 3600.0);
        (robot, recording)
    };
    let (robot, runs): (Vec<Robot>, Vec<Recording>) =
        ["freq:6.3", "freq:-6.6", "freq:6.8"].map(broken_off).into_iter().unzip();
    let refused = crate::misfit(&robot[0], &runs[..2], &runs[2..], &crate::Options::default()).unwrap_err();
    assert!(refused.to_string().contains("how the walking body pulls"), "{refused}");
}

/// Three short runs, ready to be diagnosed with a file that does not have gravity's pull at the eccentric.
fn opened(place: Place) -> (Robot, Session) {
    let (robots, runs): (Vec<Robot>, Vec<Recording>) =
        ["freq:6.3", "freq:-6.6", "freq:6.8"].map(|drive| recorded(place, drive, 1.0)).into_iter().unzip();
    let mut robot = robots[0].clone();
    robot.effects.remove(GravityTilt::SPEC.name);
    let (session, _) = Session::open(&robot, &runs[..2], &runs[2..], &crate::Options::default()).unwrap();
    (robot, session)
}

#[test]
fn gravity_is_tried_on_a_bench_and_not_on_the_ground_where_the_body_has_it() {
    let gravity = Id::of(GravityTilt::SPEC.name).unwrap();
    let (robot, bench) = opened(Place::Bench);
    assert!(search::candidates(&bench, &robot, &[]).unwrap().contains(&gravity));
    let (robot, ground) = opened(Place::Ground);
    assert!(!search::candidates(&ground, &robot, &[]).unwrap().contains(&gravity));
    let asked = search::candidates(&ground, &robot, &[gravity]).unwrap_err();
    assert!(asked.to_string().contains("gravity pulls through the body"), "{asked}");
}

#[test]
fn what_a_body_may_leave_asks_for_no_effect() {
    let floors = |session: &Session, floors: f64| session.is_to_be_explained(floors.powi(2) * session.noise);
    let (_, ground) = opened(Place::Ground);
    assert!(!floors(&ground, 1.04) && floors(&ground, 1.06));
    let (_, bench) = opened(Place::Bench);
    assert!(floors(&bench, 1.04));
}

/// The run after two rounds of finding how the body pulls, by models of the shaft.
fn pulled(robot: &Robot, plants: &[Plant], track: Track) -> Track {
    let mut track = track;
    for round in 0..2 {
        update_pull(robot, plants, std::iter::once((&mut track, NOISE)), ROLLOUT_S, round).unwrap();
    }
    track
}

/// Models of the file's shaft whose sensor's curve is known to a third of a degree.
fn with_uncertain_curve(robot: &Robot) -> Vec<Plant> {
    let model = FileModel::new(robot);
    let mut fit = Fit::begin(&model, &[], 0, Vec::new());
    for (place, one) in fit.free.iter().enumerate() {
        if ["cos1", "sin1", "cos2", "sin2"].iter().any(|term| one.number == Number::OfEffect(term)) {
            fit.covariance[(place, place)] = 0.1;
        }
    }
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let drawn = fit.drawn_plants(&model, 1.0, &mut random).take(PARTICLES - 1);
    std::iter::once(fit.plant(&model)).chain(drawn).collect()
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
    let steady = pulled(&robot, &vec![plant; PARTICLES], track);
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
    let [steady, swinging] = ["freq:6.3", "oscillate:-100..100"].map(|drive| {
        let (robot, track, ..) = run(Place::Ground, drive, 4.0);
        left(&pulled(&robot, &with_uncertain_curve(&robot), track))
    });
    assert!(swinging > 0.1 && swinging < steady - 0.2, "{swinging} and {steady} left");
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
