//! `Command::Duty`: the bridge gets exactly what was commanded, the estimator watches, and every fault still cuts it.

use std::f64::consts::TAU;

use control::parameters::AngleSource;
use control::{AdcCode, Command, Controller, Fault, Sample, State, Stroke};

use crate::common::{World, parameters};

const FULL: Command = Command::Duty { duty: 1.0 };

/// Ticks under a repeated command, with the samples changed on their way, until the bridge is off; at most 2 s.
fn ticks_driven(world: &mut World, command: Command, change: impl Fn(Sample) -> Sample) -> usize {
    for tick in 0..2000 {
        let _ = world.controller.command(command, world.time_us);
        if !world.tick_with(&change).enable {
            return tick;
        }
    }
    2000
}

#[test]
fn the_bridge_gets_the_duty_and_the_estimate_follows() {
    for thesis in [false, true] {
        for duty in [-1.0f32, 0.83] {
            let mut p = parameters();
            if thesis {
                p.position.source = AngleSource::MovingAverage;
            }
            let mut world = World::new();
            world.controller = Controller::new(&p).unwrap();
            let command = Command::Duty { duty };
            for _ in 0..1000 {
                world.controller.command(command, world.time_us).unwrap();
                let actuation = world.tick();
                assert_eq!((actuation.duty, actuation.enable), (duty, true));
            }
            let t = world.controller.telemetry();
            assert_eq!((t.state, t.fault, t.tracking, t.actuation.duty), (State::Duty, None, true, duty));
            let error = (world.angle - 1e-3 * world.speed - f64::from(t.angle) + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
            assert!(error.abs() < 0.035, "{error} rad");
            assert!((f64::from(t.speed) - world.speed).abs() < 1.0, "{} of {} rad/s", t.speed, world.speed);
        }
    }
}

#[test]
fn it_goes_over_into_every_other_state_and_back() {
    let others = [
        Command::Speed { omega: 44.0 },
        Command::Oscillate { from: -1.7, to: 1.7, style: Stroke::BangBang },
        Command::Position { angle: 2.0 },
        Command::Coast,
        Command::Idle,
    ];
    for other in others {
        let mut world = World::new();
        world.run(FULL, 500);
        world.run(other, 500);
        assert_ne!(world.controller.telemetry().state, State::Duty, "{other:?}");
        world.run(FULL, 500);
        let t = world.controller.telemetry();
        assert_eq!((t.state, t.actuation.duty, t.fault), (State::Duty, 1.0, None), "{other:?}");
    }
}

#[test]
fn a_bad_duty_changes_nothing() {
    let mut world = World::new();
    world.run(FULL, 300);
    for duty in [f32::NAN, 2.0] {
        assert!(world.controller.command(Command::Duty { duty }, world.time_us).is_err());
        assert_eq!(world.tick().duty, 1.0);
    }
}

#[test]
fn every_fault_cuts_the_bridge_within_its_bound() {
    type Change = fn(Sample) -> Sample;
    let limits = parameters().supervisor;
    let changes: [(&str, Change, &[Fault], f32); 5] = [
        (
            "shorted",
            |s| Sample { angle: AdcCode(0), ..s },
            &[Fault::SensorShorted, Fault::SensorOpen],
            limits.sensor_shorted.bound,
        ),
        ("frozen", |s| Sample { angle: AdcCode(2000), ..s }, &[Fault::SensorFrozen], limits.sensor_frozen.bound),
        (
            "empty",
            |s| Sample { second: None, battery: AdcCode(1500), ..s },
            &[Fault::SupplyLow],
            limits.supply_low.bound,
        ),
        ("stuck clock", |s| Sample { time_us: 300_000, ..s }, &[Fault::ClockFault], limits.clock.bound),
        (
            "open",
            |s| Sample { angle: AdcCode(100 + (s.time_us / 1000 * 1237 % 3900) as u16), ..s },
            &[Fault::SensorOpen],
            limits.sensor_open.bound,
        ),
    ];
    // A shorted wiper fits no motion either: whichever is due first.
    for (name, change, faults, bound) in changes {
        for command in [FULL, Command::Duty { duty: -1.0 }] {
            let mut world = World::new();
            world.run(command, 300);
            assert!(world.controller.telemetry().tracking);
            let ticks = ticks_driven(&mut world, command, change);
            assert!((ticks as f32) <= 1e3 * bound, "{name}: driven for {ticks} ms");
            let fault = world.controller.telemetry().fault;
            assert!(fault.is_some_and(|fault| faults.contains(&fault)), "{name}: {fault:?}");
        }
    }
}

#[test]
fn a_blocked_shaft_a_swapped_motor_and_a_lost_link_cut_it_too() {
    let mut world = World::new();
    world.run(FULL, 300);
    world.blocked = true;
    assert!(ticks_driven(&mut world, FULL, |s| s) <= 500);
    assert_eq!(world.controller.telemetry().fault, Some(Fault::Stall));

    let mut world = World::new();
    world.reversed = true;
    assert!(ticks_driven(&mut world, FULL, |s| s) <= 500);
    assert_eq!(world.controller.telemetry().fault, Some(Fault::Runaway));

    let mut world = World::new();
    world.run(FULL, 300);
    let driven = (0..1000).filter(|_| world.tick().enable).count();
    assert!(driven <= 550, "driven for {driven} ms");
    assert_eq!(world.controller.telemetry().fault, Some(Fault::CommandTooOld));
}
