//! Two potentiometers half a turn apart: what one shows when it fails, and that the robot goes on with the other.

use std::f64::consts::PI;

use crate::common::{World, parameters};
use control::{AdcCode, Command, Controller, Fault, Parameters, Sample, SecondSensor, Sensor, State};

const DRIVE: Command = Command::Speed { omega: 44.0 };
/// How far the second one is mounted from where the parameters have it, rad.
const AMISS: f64 = 0.04;

fn two() -> Parameters {
    let one = parameters();
    let second =
        SecondSensor { map: one.sensor, offset: -std::f32::consts::PI, tolerance: 0.06, delay: 0.0, noise: 1.0 };
    Parameters { second: Some(second), ..one }
}

fn world() -> World {
    let mut world = World::new();
    world.controller = Controller::new(&two()).expect("valid");
    world
}

/// What a sensor shows: its code, or something else.
type Line = fn(u16, u32) -> u16;
const HEALTHY: Line = |code, _| code;
/// Frozen, shorted to either end, floating anywhere, and slipped on the shaft by 60°.
const BROKEN: [Line; 5] = [
    |_, _| 1700,
    |_, _| 0,
    |_, _| 4095,
    |_, tick| (tick.wrapping_mul(1_664_525).wrapping_add(1_013_904_223) >> 20) as u16,
    |code, _| (code + 745) % 4096,
];

/// A tick with both lines as they are.
fn tick(world: &mut World, lines: [Line; 2], number: u32) {
    let _ = world.controller.command(DRIVE, world.time_us);
    world.angle -= PI - AMISS;
    let second = world.code();
    world.angle += PI - AMISS;
    world.tick_with(|sample| Sample {
        angle: AdcCode(lines[0](sample.angle.0, number)),
        second: Some(AdcCode(lines[1](second, number))),
        ..sample
    });
}

fn run(world: &mut World, lines: [Line; 2], ticks: u32) {
    (0..ticks).for_each(|number| tick(world, lines, number));
}

/// Of the estimate against the angle at its sample, rad: the shaft has turned on for a tick since.
fn error(world: &World) -> f64 {
    let apart = f64::from(world.controller.telemetry().angle) - (world.angle - 1e-3 * world.speed);
    (apart - 2.0 * PI * (apart / (2.0 * PI)).round()).abs()
}

#[test]
fn two_healthy_sensors_are_never_blind() {
    let mut world = world();
    run(&mut world, [HEALTHY; 2], 600);
    for number in 0..1000 {
        tick(&mut world, [HEALTHY; 2], number);
        let telemetry = world.controller.telemetry();
        assert!(telemetry.tracking && telemetry.accepted && !telemetry.blind, "{number}: {telemetry:?}");
        assert_eq!(telemetry.failed_sensor, None);
        assert!(error(&world) < 0.03, "{number}: {}", error(&world));
    }
}

#[test]
fn one_that_breaks_is_found_and_the_robot_goes_on_with_the_other() {
    for (index, broken) in BROKEN.into_iter().enumerate() {
        for (which, lines) in [(Sensor::First, [broken, HEALTHY]), (Sensor::Second, [HEALTHY, broken])] {
            // At every phase of a turn, which takes 143 ticks.
            for phase in 0..13 {
                let what = format!("{which:?} broken in way {index} at phase {phase}");
                let mut world = world();
                run(&mut world, [HEALTHY; 2], 600 + 11 * phase);
                assert_eq!(world.controller.telemetry().failed_sensor, None, "{what}");
                run(&mut world, lines, 400);
                assert_eq!(world.controller.telemetry().failed_sensor, Some(which), "{what}");
                let mut blind = 0;
                for number in 0..1000 {
                    tick(&mut world, lines, number);
                    let telemetry = world.controller.telemetry();
                    assert_eq!((telemetry.state, telemetry.failed_sensor), (State::Speed, Some(which)), "{what}");
                    assert!(telemetry.tracking && error(&world) < 0.15, "{what}: {}", error(&world));
                    blind += u32::from(telemetry.blind);
                }
                // Its blind arc is back.
                assert!((100..300).contains(&blind), "{what}: blind in {blind} ticks");
                assert!((world.speed - 44.0).abs() < 2.0, "{what}: {}", world.speed);
            }
        }
    }
}

#[test]
fn both_broken_end_with_the_bridge_off_within_the_bounds() {
    let limits = two().supervisor;
    // Frozen and shorted: what leaves no reading that fits.
    for one in &BROKEN[..3] {
        for two in &BROKEN[..3] {
            for phase in 0..5 {
                for between in [0, 40, 90, 300] {
                    let mut world = world();
                    run(&mut world, [HEALTHY; 2], 600 + 29 * phase);
                    run(&mut world, [*one, HEALTHY], between);
                    let mut ticks = 0;
                    while world.controller.telemetry().state != State::Fault && ticks < 3000 {
                        tick(&mut world, [*one, *two], ticks);
                        ticks += 1;
                    }
                    let bound = match world.controller.telemetry().fault {
                        Some(Fault::SensorShorted) => limits.sensor_shorted.bound,
                        Some(Fault::SensorFrozen) => limits.sensor_frozen.bound,
                        Some(Fault::SensorOpen) => limits.sensor_open.bound,
                        Some(Fault::Stall) => limits.stall.bound,
                        Some(Fault::Runaway) => limits.runaway.bound,
                        other => panic!("{other:?}"),
                    };
                    assert!(ticks <= (1e3 * bound) as u32, "{ticks} ms: {:?}", world.controller.telemetry().fault);
                }
            }
        }
    }
}

#[test]
fn without_an_angle_neither_of_two_that_contradict_each_other_is_believed() {
    for lines in [[HEALTHY, BROKEN[4]], [BROKEN[4], HEALTHY]] {
        let mut world = world();
        for number in 0..1200 {
            tick(&mut world, lines, number);
            assert!(!world.controller.telemetry().tracking, "{number}");
        }
        assert_eq!(world.controller.telemetry().fault, Some(Fault::SensorOpen));
    }
}

#[test]
fn two_that_drift_apart_are_both_given_up_and_the_healthy_one_is_never_called_failed() {
    const DRIFTING: Line = |code, tick| ((u32::from(code) + tick * 2 / 5) % 4096) as u16;
    for (lines, healthy) in [([HEALTHY, DRIFTING], Sensor::First), ([DRIFTING, HEALTHY], Sensor::Second)] {
        let mut world = world();
        run(&mut world, [HEALTHY; 2], 700);
        run(&mut world, lines, 2500);
        let telemetry = world.controller.telemetry();
        assert_ne!(telemetry.failed_sensor, Some(healthy));
        assert!(telemetry.state == State::Fault || telemetry.failed_sensor.is_some(), "{telemetry:?}");
    }
}

#[test]
fn a_second_code_means_nothing_to_a_robot_with_one_sensor() {
    let (mut with, mut without) = (World::new(), World::new());
    for number in 0..1500 {
        for world in [&mut with, &mut without] {
            let _ = world.controller.command(DRIVE, world.time_us);
        }
        with.tick_with(|sample| Sample { second: Some(AdcCode((number * 37 % 4096) as u16)), ..sample });
        without.tick();
        assert_eq!(with.controller.telemetry(), without.controller.telemetry());
    }
}
