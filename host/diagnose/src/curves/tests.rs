//! A term that follows one coordinate comes out on that coordinate.

use effects::Laws;
use hal_sim::shaft::{Shaft, ShaftState, Terminals};
use rand::{RngExt, SeedableRng};
use recording::{AngleReading, Drive, Recording};
use robot_file::robot::Robot;

use super::super::screen::Screen;
use super::super::session::Session;
use super::super::{Options, curves, judged, place};
use super::*;

/// The shaft at a moment, as the terms below know it.
struct At {
    angle: f64,
    speed: f64,
    current: f64,
    since_reversal: f64,
    run: usize,
}

/// N·m of friction that show.
const FRICTION: f64 = 6e-5;

/// Six runs of 4 s at 1 kHz of the bench's motor with its numbers a little off, a torque (N·m) and a slip of the sensor (rad/s) of its
/// own, and 1 mrad of noise.
fn runs(torque: impl Fn(&At) -> f64, slip: impl Fn(&At) -> f64) -> Vec<Recording> {
    let shaft = Shaft {
        resistance_ohm: 16.0,
        inductance_h: 150e-6,
        torque_constant: 0.02,
        inertia_kg_m2: 1.6e-6,
        viscous: 4e-6,
        laws: Laws::NONE,
    };
    (0..6).map(|run| one_run(&shaft, run, &torque, &slip)).collect()
}

fn one_run(shaft: &Shaft, run: usize, torque: &impl Fn(&At) -> f64, slip: &impl Fn(&At) -> f64) -> Recording {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(40 + run as u64);
    let stepper = shaft.stepper(2e-4);
    let (mut state, mut slipped, mut turned_at, mut duty) = (ShaftState::default(), 0.0, 0.0, 0.0);
    let (mut out, mut duties, mut angles) = (Recording::default(), Vec::new(), Vec::new());
    for k in 0..4000 {
        let time = f64::from(k) * 1e-3;
        if k % 180 == 0 {
            duty = random.random_range(-0.9..0.9);
        }
        let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
        angles.push(Some(state.angle + slipped + 1e-3 * noise));
        duties.push(duty);
        out.t_s.push(time);
        out.enable.push(true);
        for _ in 0..5 {
            let before = state.speed;
            let ShaftState { angle, speed, current, .. } = state;
            let at = At { angle, speed, current, since_reversal: time - turned_at, run };
            slipped += 2e-4 * slip(&at);
            stepper.advance_under(&mut state, Terminals::Driven { voltage: 5.0 * duty }, torque(&at));
            if before * state.speed <= 0.0 || state.speed.abs() < 4.0 {
                turned_at = time;
            }
        }
    }
    (out.drive, out.angle) = (Drive::Duty(duties), AngleReading::Angle(angles));
    out
}

/// The runs with the bench's file refitted to them, the last two held out.
fn opened(runs: &[Recording]) -> (Session, Fit) {
    let bench = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/bench-linear.toml");
    let robot = Robot::load(bench.as_ref()).unwrap();
    Session::open(&robot, &runs[..4], &runs[4..], &Options::default()).unwrap()
}

/// The coordinate of the curve that promises most about the refitted model.
fn place_of(runs: &[Recording]) -> &'static str {
    let (session, fit) = opened(runs);
    let screened = curves::screen(&session.model, &session.data(), &fit, 1, &Follows::ALL);
    let best = Follows::ALL.into_iter().zip(&screened).filter(|(_, one)| one.is_sure());
    best.max_by(|a, b| a.1.beyond_accident().total_cmp(&b.1.beyond_accident()))
        .map_or("none", |(follows, _)| follows.name())
}

/// The coordinate of the curve that takes away most of what the refitted model leaves, and the one over which the runs predict each
/// other's rest.
fn places_of(runs: &[Recording]) -> [Option<&'static str>; 2] {
    let (mut session, fit) = opened(runs);
    let refitted = judged(&mut session, fit);
    let no_screen = Screen { directions: Vec::new(), motion_chance: 1.0 };
    let follows = place::of(&session, &refitted, session.noise, &no_screen);
    [follows.map(Follows::name), place::predicted(&session, &refitted)]
}

fn along(speed: f64) -> f64 {
    (speed / 5.0).tanh()
}

#[test]
fn friction_that_comes_and_goes_with_the_teeth_follows_the_angle() {
    assert_eq!(place_of(&runs(|at| -FRICTION * along(at.speed) * (3.0 * at.angle).sin(), |_| 0.0)), "angle_rad");
}

#[test]
fn a_torque_that_grows_with_the_cube_of_the_current_follows_the_current() {
    assert_eq!(place_of(&runs(|at| -20.0 * FRICTION * (at.current / 0.3).powi(3), |_| 0.0)), "current_a");
}

#[test]
fn friction_that_fades_after_a_reversal_follows_the_time_since_then() {
    let torque = |at: &At| -6.0 * FRICTION * along(at.speed) * (-at.since_reversal / 0.03).exp();
    assert_eq!(place_of(&runs(torque, |_| 0.0)), "time_since_reversal_s");
}

#[test]
fn friction_of_one_run_follows_the_run() {
    let torque = |at: &At| if at.run == 2 { -3.0 * FRICTION * along(at.speed) } else { 0.0 };
    assert_eq!(place_of(&runs(torque, |_| 0.0)), "run");
}

#[test]
fn a_sensor_that_loses_counts_when_it_is_fast_follows_the_speed() {
    let slip = |at: &At| if at.speed.abs() > 120.0 { -0.02 * at.speed } else { 0.0 };
    assert_eq!(place_of(&runs(|_| 0.0, slip)), "speed_rad_per_s");
}

#[test]
fn a_belt_that_slips_under_a_high_load_follows_the_current() {
    let slip = |at: &At| 0.4 * at.speed.abs() * (at.current - at.current.clamp(-0.12, 0.12));
    assert_eq!(place_of(&runs(|_| 0.0, slip)), "current_a");
}

#[test]
fn a_belt_that_creeps_by_its_load_is_placed_by_a_curve_that_is_fitted() {
    let slip = |at: &At| 0.15 * at.speed.abs() * at.current;
    assert_eq!(places_of(&runs(|_| 0.0, slip))[0], Some("current_a"));
}

#[test]
fn counts_that_are_lost_now_and_then_at_high_speed_are_placed_by_what_runs_say_of_each_other() {
    let slip = |at: &At| if at.speed.abs() > 120.0 && at.angle.rem_euclid(23.0) < 0.3 { 8.0 } else { 0.0 };
    assert_eq!(places_of(&runs(|_| 0.0, slip))[1], Some("speed_rad_per_s"));
}

#[test]
fn nothing_follows_nothing() {
    assert_eq!(place_of(&runs(|_| 0.0, |_| 0.0)), "none");
}
