//! The controller on a small world of its own (not `hal-sim`): every mode does what it says, every stop stops.

use std::f64::consts::TAU;

use control::{Command, Fault, Refusal, State, Stroke};

use crate::common::World;

fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

#[test]
fn holds_a_speed_both_ways_from_any_angle() {
    for start in [-3.0, -0.2, 0.0, 0.25, 1.0, 2.9] {
        for omega in [-44.0f32, 44.0] {
            let mut world = World::new();
            world.angle = start;
            world.run(Command::Speed { omega }, 1000);
            let before = world.angle;
            world.run(Command::Speed { omega }, 1000);
            let mean = world.angle - before;
            assert!((mean / f64::from(omega) - 1.0).abs() < 1e-3, "{mean} rad in 1 s for {omega} from {start}");
        }
    }
}

#[test]
fn the_estimate_stays_right_through_the_arc() {
    let mut world = World::new();
    world.run(Command::Speed { omega: 44.0 }, 500);
    for _ in 0..1000 {
        world.run(Command::Speed { omega: 44.0 }, 1);
        let t = world.controller.telemetry();
        // The telemetry is of the sample before the period that followed.
        let error = wrap(world.angle - 1e-3 * world.speed - f64::from(t.angle)).to_degrees();
        assert!(error.abs() < 2.0, "{error} deg at {} deg, blind {}", t.angle.to_degrees(), t.blind);
    }
}

#[test]
fn swings_between_its_bounds() {
    let mut world = World::new();
    let command = Command::Oscillate { from: -1.745, to: 1.745, style: Stroke::BangBang };
    world.run(command, 500);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let turn = TAU * (world.angle / TAU).round();
    for _ in 0..1000 {
        world.run(command, 1);
        low = low.min(world.angle - turn);
        high = high.max(world.angle - turn);
    }
    assert!((low + 1.745).abs() < 0.07 && (high - 1.745).abs() < 0.07, "{low} … {high}");
}

#[test]
fn goes_to_an_angle_in_the_arc_too() {
    for target in [2.0f32, -2.5, 0.1, -0.1] {
        let mut world = World::new();
        world.run(Command::Position { angle: target }, 2000);
        let error = wrap(world.angle - f64::from(target)).to_degrees();
        assert!(error.abs() < 10.0, "{error} deg from {target}");
    }
}

#[test]
fn a_speed_beyond_the_supply_winds_nothing_up() {
    let mut world = World::new();
    world.run(Command::Speed { omega: 70.0 }, 2000);
    world.run(Command::Speed { omega: 40.0 }, 150);
    let mut fastest: f64 = 0.0;
    let mut slowest = f64::INFINITY;
    for _ in 0..300 {
        world.run(Command::Speed { omega: 40.0 }, 1);
        fastest = fastest.max(world.speed);
        slowest = slowest.min(world.speed);
    }
    assert!(fastest < 42.0 && slowest > 38.0, "{slowest} … {fastest} rad/s");
}

#[test]
fn a_blocked_shaft_ends_in_a_fault_that_only_clearing_leaves() {
    let mut world = World::new();
    world.blocked = true;
    let command = Command::Speed { omega: 44.0 };
    world.run(command, 500);
    let t = world.controller.telemetry();
    assert_eq!((t.state, t.fault), (State::Fault, Some(Fault::Stall)));
    assert!(!world.tick().enable);
    assert_eq!(world.controller.command(command, world.time_us), Err(Refusal::Faulted(Fault::Stall)));
    assert_eq!(world.controller.command(Command::Idle, world.time_us), Err(Refusal::Faulted(Fault::Stall)));
    world.controller.command(Command::ClearFault, world.time_us).unwrap();
    world.tick();
    assert_eq!(world.controller.telemetry().state, State::Idle);
    world.blocked = false;
    world.run(command, 1500);
    assert!((world.speed - 44.0).abs() < 1.0, "{} rad/s", world.speed);
}

#[test]
fn a_command_that_is_not_repeated_grows_too_old() {
    let mut world = World::new();
    world.run(Command::Speed { omega: 44.0 }, 400);
    for _ in 0..550 {
        world.tick();
    }
    assert_eq!(world.controller.telemetry().fault, Some(Fault::CommandTooOld));
    assert!(!world.tick().enable);
}

#[test]
fn coasting_the_estimate_goes_on() {
    let mut world = World::new();
    world.run(Command::Speed { omega: 44.0 }, 600);
    world.run(Command::Coast, 15);
    assert!(!world.tick().enable);
    let t = world.controller.telemetry();
    assert!(t.tracking && (f64::from(t.speed) - world.speed).abs() < 4.0, "{} against {}", t.speed, world.speed);
}
