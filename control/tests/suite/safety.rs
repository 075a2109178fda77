//! What must end with the bridge off whatever clock, sensor and shaft do, on the small world.

use std::f64::consts::PI;

use control::parameters::{AngleSource, ParameterError, Parameters};
use control::{AdcCode, Command, Controller, Fault, Refusal, Sample, State, Stroke};
use proptest::prelude::*;

use crate::common::{World, parameters};

const HOLD: Command = Command::Speed { omega: 44.0 };

/// A name, and the time of every tick, µs.
type NamedClock = (&'static str, fn(u64) -> u64);

/// Ticks a world whose samples carry the times of `clock`, and counts those until the bridge is off for good.
fn ticks_driven(world: &mut World, most: u64, clock: impl Fn(u64) -> u64, command: Option<Command>) -> u64 {
    let mut last_on = 0;
    for tick in 0..most {
        world.time_us = clock(tick);
        if let Some(command) = command {
            let _ = world.controller.command(command, world.time_us);
        }
        if world.tick().enable {
            last_on = tick + 1;
        }
    }
    last_on
}

#[test]
fn a_command_grows_old_over_a_wrapped_clock() {
    let wrap = 1u64 << 32;
    let mut world = World::new();
    world.time_us = wrap - 400_000;
    world.run(HOLD, 300);
    let start = world.time_us;
    let on = ticks_driven(&mut world, 2000, |tick| (start + 1000 * tick) % wrap, None);
    assert!((490..=551).contains(&on), "driven for {on} ms");
    assert_eq!(world.controller.telemetry().fault, Some(Fault::CommandTooOld));
}

#[test]
fn commands_go_on_over_a_wrapped_clock() {
    let wrap = 1u64 << 32;
    let mut world = World::new();
    let start = wrap - 400_000;
    let on = ticks_driven(&mut world, 2000, |tick| (start + 1000 * tick) % wrap, Some(HOLD));
    assert_eq!((on, world.controller.telemetry().fault), (2000, None));
}

#[test]
fn after_a_restart_nothing_drives_until_the_fault_is_cleared() {
    let mut world = World::new();
    world.controller = Controller::restarted(&parameters(), &parameters()).unwrap();
    assert_eq!(ticks_driven(&mut world, 1000, |tick| 1000 * tick, Some(HOLD)), 0);
    let refused = Err(Refusal::Faulted(Fault::Restarted));
    for command in [HOLD, Command::Idle, Command::Coast, Command::Duty { duty: 1.0 }] {
        assert_eq!(world.controller.command(command, world.time_us), refused);
    }
    assert_eq!(world.controller.telemetry().fault, Some(Fault::Restarted));
    world.controller.command(Command::ClearFault, world.time_us).unwrap();
    assert_eq!(ticks_driven(&mut world, 100, |tick| 1_000_000 + 1000 * tick, None), 0, "only ready");
    assert_eq!(ticks_driven(&mut world, 100, |tick| 1_100_000 + 1000 * tick, Some(HOLD)), 100);
}

#[test]
fn a_command_from_the_future_grows_old_too() {
    for stamp in [u64::MAX, 1 << 40] {
        let mut world = World::new();
        world.run(HOLD, 300);
        world.controller.command(HOLD, stamp).unwrap();
        let start = world.time_us;
        let on = ticks_driven(&mut world, 1000, |tick| start + 1000 * tick, None);
        assert!((490..=551).contains(&on), "driven for {on} ms");
    }
}

#[test]
fn a_command_that_was_held_up_arrives_old() {
    let mut world = World::new();
    world.run(Command::Idle, 2000);
    world.controller.command(HOLD, 1_000_000).unwrap();
    let start = world.time_us;
    ticks_driven(&mut world, 2, |tick| start + 1000 * tick, None);
    assert_eq!(world.controller.telemetry().fault, Some(Fault::CommandTooOld));
}

#[test]
fn clearing_no_fault_does_not_refresh_a_command() {
    let mut world = World::new();
    world.run(HOLD, 300);
    let mut ticks = 0;
    while world.controller.telemetry().state != State::Fault {
        assert!(ticks <= 551, "still driven");
        world.controller.command(Command::ClearFault, world.time_us).unwrap();
        world.tick();
        ticks += 1;
    }
    assert_eq!(world.controller.telemetry().fault, Some(Fault::CommandTooOld));
}

#[test]
fn a_clock_that_stands_still_leaps_or_goes_back_is_a_fault() {
    let clocks: [NamedClock; 5] = [
        ("stuck", |_| 300_000),
        ("25 ms late", |tick| 300_000 + 25_000 * tick),
        ("backwards", |tick| 300_000 - tick),
        ("a microsecond a tick", |tick| 300_000 + tick),
        ("to and fro", |tick| 300_000 + 50_000 * (tick % 2)),
    ];
    for (name, clock) in clocks {
        for blocked in [false, true] {
            let mut world = World::new();
            world.run(HOLD, 300);
            world.blocked = blocked;
            let on = ticks_driven(&mut world, 3000, clock, Some(HOLD));
            assert!(on <= 100, "{name}, blocked {blocked}: driven for {on} ticks");
            assert_eq!(world.controller.telemetry().fault, Some(Fault::ClockFault), "{name}");
        }
    }
}

#[test]
fn one_leap_of_the_clock_is_borne() {
    let mut world = World::new();
    world.run(HOLD, 600);
    let start = world.time_us;
    let on = ticks_driven(&mut world, 2000, |tick| start + 1000 * tick + 30_000, Some(HOLD));
    assert_eq!((on, world.controller.telemetry().fault), (2000, None));
    assert!(world.controller.telemetry().tracking);
}

#[test]
fn a_clock_fault_is_not_cleared_while_the_clock_is_ill() {
    let mut world = World::new();
    world.run(HOLD, 300);
    ticks_driven(&mut world, 200, |_| 300_000, Some(HOLD));
    assert!(world.controller.command(Command::ClearFault, 300_000).is_err());
    world.time_us = 301_000;
    world.tick();
    assert!(world.controller.command(Command::ClearFault, 301_000).is_ok());
}

#[test]
fn a_shaft_that_is_blocked_from_rest_is_found_wherever_the_wiper_lies() {
    for step in 0..36 {
        for command in [HOLD, Command::Speed { omega: -7.0 }, Command::Position { angle: 1.0 }] {
            let mut world = World::new();
            world.angle = f64::from(step) * PI / 18.0;
            world.blocked = true;
            let on = ticks_driven(&mut world, 2000, |tick| 1000 * tick, Some(command));
            assert!(on <= 800, "{step}, {command:?}: driven for {on} ms");
        }
    }
}

/// Readings that drift at 7 rad/s against the drive: below what an acquisition trusts, above what counts as stalled.
#[test]
fn a_reading_that_drifts_slowly_against_the_drive_is_a_fault() {
    let mut controller = Controller::new(&parameters()).unwrap();
    let mut faulted = None;
    for tick in 0..1000u64 {
        controller.command(HOLD, 1000 * tick).ok();
        let code = 3500.0 - 7.0 * 1e-3 * tick as f64 * 4095.0 / 5.76;
        let dither = if tick % 2 == 0 { 3.0 } else { -3.0 };
        let code = AdcCode(if code > 100.0 { (code + dither) as u16 } else { 100 });
        controller.tick(&Sample { time_us: 1000 * tick, angle: code, second: None, battery: AdcCode(2400) });
        if faulted.is_none() {
            faulted = controller.telemetry().fault.map(|fault| (fault, tick));
        }
    }
    let (fault, tick) = faulted.unwrap();
    assert!(fault == Fault::Runaway && tick < 200, "{fault:?} after {tick} ms");
}

#[test]
fn a_runaway_is_not_cleared_in_the_arc_while_the_shaft_spins() {
    let mut parameters = parameters();
    parameters.limits.speed = 30.0;
    parameters.limits.least_speed = 5.0;
    let mut world = World::new();
    world.controller = Controller::new(&parameters).unwrap();
    world.run(Command::Speed { omega: 29.0 }, 1500);
    assert!(world.controller.telemetry().tracking);
    // Something else turns the shaft three times as fast; the bridge stays off.
    let mut in_arc = 0;
    let mut angle = world.angle;
    for _ in 0..500 {
        angle += 90.0e-3;
        (world.angle, world.speed) = (angle, 0.0);
        world.tick();
        let t = world.controller.telemetry();
        if t.fault == Some(Fault::Runaway) && t.blind && t.speed > 80.0 {
            in_arc += 1;
            assert!(world.controller.command(Command::ClearFault, world.time_us).is_err());
        }
    }
    assert!(in_arc > 20, "only {in_arc} ticks in the arc");
}

#[test]
fn the_search_begins_anew_after_every_stop() {
    // A search that begins gently: only its impatience drives fully.
    let slow = Command::Speed { omega: 7.0 };
    let duty_of_first_tick = |world: &mut World| {
        world.controller.command(slow, world.time_us).unwrap();
        world.tick().duty
    };
    let mut gentle = parameters();
    gentle.acquisition.speed = 7.0;
    gentle.speed.speed_gain = 0.01;
    let mut world = World::new();
    world.controller = Controller::new(&gentle).unwrap();
    world.blocked = true;
    let first = duty_of_first_tick(&mut world);
    world.run(slow, 150);
    assert!(world.controller.telemetry().actuation.duty > 0.999);
    world.run(Command::Idle, 100);
    let again = duty_of_first_tick(&mut world);
    assert!(first < 0.999 && (first - again).abs() < 1e-6, "{first} and {again}");
}

#[test]
fn the_thesis_averages_once() {
    // P on a mean of 4: after 4 samples at a new angle the old one is forgotten.
    let mut p = parameters();
    p.position.source = AngleSource::MovingAverage;
    let mut controller = Controller::new(&p).unwrap();
    let duty = |controller: &mut Controller, tick: u64, code: u16| {
        controller.command(Command::Position { angle: 2.0 }, 1000 * tick).unwrap();
        controller
            .tick(&Sample { time_us: 1000 * tick, angle: AdcCode(code), second: None, battery: AdcCode(2400) })
            .duty
    };
    for tick in 0..20 {
        duty(&mut controller, tick, 1100);
    }
    let settled = duty(&mut controller, 20, 1100);
    for tick in 21..25 {
        duty(&mut controller, tick, 1180);
    }
    let after = duty(&mut controller, 25, 1180);
    let last = (26..40).map(|tick| duty(&mut controller, tick, 1180)).last().unwrap();
    assert!((settled - last).abs() > 0.05 && (after - last).abs() < 1e-6, "{settled}, {after}, {last}");
}

fn refused(change: impl Fn(&mut Parameters)) -> Option<ParameterError> {
    let mut parameters = parameters();
    change(&mut parameters);
    Controller::new(&parameters).err()
}

#[test]
fn limits_that_contradict_each_other_are_refused() {
    assert_eq!(refused(|_| {}), None);
    let runaway = refused(|p| p.supervisor.runaway.limit = p.limits.speed).unwrap();
    assert!(runaway.to_string().contains("controller.supervisor.runaway_rad_per_s"), "{runaway}");
    let old = refused(|p| p.supervisor.command_old.bound = 0.4).unwrap();
    assert!(old.to_string().contains("controller.supervisor.command_bound_s"), "{old}");
    for index in 0..3 {
        let knots = refused(|p| p.sensor.knots[index].code = 5000.0).unwrap();
        assert!(knots.to_string().contains("sensor.knots"), "{knots}");
    }
    assert!(refused(|p| p.sensor.knots[1].code = 0.0).is_some());
}

/// The numbers that a robot file can move, each by name of its group.
fn numbers(p: &mut Parameters) -> [&mut f32; 24] {
    [
        &mut p.motor.resistance,
        &mut p.motor.torque_constant,
        &mut p.motor.inertia,
        &mut p.motor.viscous,
        &mut p.motor.drag,
        &mut p.motor.drag_limit,
        &mut p.transition.angle_speed,
        &mut p.transition.speed_speed,
        &mut p.transition.speed_voltage,
        &mut p.transition.speed_torque,
        &mut p.transition.current_voltage,
        &mut p.bridge.rail,
        &mut p.bridge.drop,
        &mut p.bridge.fade_current,
        &mut p.estimator.speed.reading,
        &mut p.estimator.speed.drag,
        &mut p.estimator.blind_reading,
        &mut p.estimator.gate,
        &mut p.speed.angle_gain,
        &mut p.speed.speed_gain,
        &mut p.speed.current_gain,
        &mut p.position.derivative,
        &mut p.position.integral,
        &mut p.oscillator.proportional,
    ]
}

fn any_command() -> impl Strategy<Value = Command> {
    let swing = |(from, to, bang)| Command::Oscillate {
        from,
        to,
        style: if bang { Stroke::BangBang } else { Stroke::Proportional },
    };
    prop_oneof![
        Just(Command::Idle),
        Just(Command::Coast),
        Just(Command::ClearFault),
        (-75.0f32..75.0).prop_map(|omega| Command::Speed { omega }),
        (-3.1f32..3.1).prop_map(|angle| Command::Position { angle }),
        (-1.0f32..1.0).prop_map(|duty| Command::Duty { duty }),
        (-6.0f32..0.0, 0.5f32..6.0, any::<bool>()).prop_map(swing),
    ]
}

fn any_elapsed() -> impl Strategy<Value = u64> {
    prop_oneof![30 => 900u64..1100, 1 => 0u64..30_000, 1 => any::<u64>()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_accepted_parameters_keep_the_bridge_in_bounds(
        changes in prop::collection::vec((0usize..24, prop_oneof![0.5f32..2.0, Just(1e-3), Just(1e3), Just(1e6)]), 0..4),
        thesis in any::<bool>(),
        steps in prop::collection::vec((any_elapsed(), 0u16..4200, prop::option::weighted(0.05, any_command())), 1..600)
    ) {
        let mut p = parameters();
        for (index, factor) in changes {
            *numbers(&mut p)[index] *= factor;
        }
        if thesis {
            p.position.source = AngleSource::MovingAverage;
        }
        if let Ok(mut controller) = Controller::new(&p) {
            let mut time_us = 0u64;
            for (elapsed, code, command) in steps {
                time_us = time_us.wrapping_add(elapsed);
                if let Some(command) = command {
                    let _ = controller.command(command, time_us);
                }
                let sample = Sample { time_us, angle: AdcCode(code), second: None, battery: AdcCode(2400) };
                let actuation = controller.tick(&sample);
                let t = controller.telemetry();
                prop_assert!(actuation.duty.is_finite() && actuation.duty.abs() <= 1.0, "{actuation:?} {p:?}");
                prop_assert!(t.state.is_driving() || !actuation.enable, "{t:?}");
                prop_assert!(t.speed.is_finite() && t.angle.is_finite() && t.drag.is_finite(), "{t:?} {p:?}");
            }
        }
    }
}

#[test]
fn what_is_no_number_turns_the_bridge_off() {
    // Gains that are accepted one by one and overflow together.
    let mut p = parameters();
    p.speed.speed_gain = 1e4;
    p.transition.speed_voltage = 1e6;
    p.transition.speed_torque = 1e9;
    p.transition.current_voltage = 1e6;
    p.transition.current_torque = -1e9;
    p.motor.drag_limit = 1e4;
    p.motor.drag = 1e3;
    p.bridge.rail = 100.0;
    let mut controller = Controller::new(&p).unwrap();
    for tick in 0..400u64 {
        controller.command(HOLD, 1000 * tick).ok();
        let code = AdcCode(((tick * 31) % 4000) as u16);
        let actuation =
            controller.tick(&Sample { time_us: 1000 * tick, angle: code, second: None, battery: AdcCode(2400) });
        let t = controller.telemetry();
        assert!(t.speed.is_finite() && t.drag.is_finite() && actuation.duty.is_finite(), "{t:?}");
    }
}
