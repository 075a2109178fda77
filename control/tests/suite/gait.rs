//! The controller plays a gait: its speeds and oscillations, its end, and everything that stops it as it stops any other drive.

use control::gait::{Name, Sequencer};
use control::{Command, Controller, Fault, Field, Gait, Motion, Refusal, State, Stroke};
use proptest::prelude::*;

use crate::common::{World, parameters};

fn name() -> Name {
    Name::new("test").expect("a name")
}

fn gait(speeds: &[f32], steps: &[u8], interval_ms: u16, repeats: bool) -> Gait {
    Gait::new(name(), speeds, &[], steps, interval_ms, repeats).expect("sound")
}

/// A world whose robot has the gait and plays it.
fn playing(gait: &Gait) -> World {
    let mut world = World::new();
    assert_eq!(world.controller.keep_gait(gait), Ok(()));
    assert_eq!(world.controller.command(play(gait), world.time_us), Ok(()));
    world
}

fn play(gait: &Gait) -> Command {
    Command::Gait { id: gait.id() }
}

#[test]
fn the_reference_is_each_steps_speed_for_exactly_its_ticks_and_then_the_shaft_turns_out() {
    let (speeds, steps) = ([44.0, -44.0, 30.0], [0, 1, 1, 2, 0]);
    let gait = gait(&speeds, &steps, 40, false);
    let mut world = playing(&gait);
    for (tick, index) in steps.iter().flat_map(|index| [*index; 40]).enumerate() {
        world.controller.heartbeat(world.time_us);
        let enabled = world.tick().enable;
        let telemetry = world.controller.telemetry();
        assert_eq!((telemetry.state, enabled), (State::Gait, true), "tick {tick}");
        assert_eq!(telemetry.reference_speed, speeds[usize::from(index)], "tick {tick}");
    }
    let speed = world.speed;
    assert!(speed.abs() > 20.0, "it turned: {speed}");
    for _ in 0..20 {
        world.controller.heartbeat(world.time_us);
        assert!(!world.tick().enable);
        assert_eq!(world.controller.state(), State::Coast);
    }
    // Again from its beginning.
    assert_eq!(world.controller.command(play(&gait), world.time_us), Ok(()));
    world.tick();
    assert_eq!(world.controller.telemetry().reference_speed, 44.0);
}

#[test]
fn a_step_of_a_second_is_held_as_a_commanded_speed_is() {
    let gait = gait(&[44.0, -30.0], &[0, 1], 1000, true);
    let mut world = playing(&gait);
    let mut commanded = World::new();
    for tick in 0..6000 {
        let omega = if tick / 1000 % 2 == 0 { 44.0 } else { -30.0 };
        world.controller.heartbeat(world.time_us);
        let _ = commanded.controller.command(Command::Speed { omega }, commanded.time_us);
        assert_eq!(world.tick(), commanded.tick(), "tick {tick}");
    }
    assert!((world.speed + 30.0).abs() < 2.0, "{}", world.speed);
}

/// Every actuation is that of the commands, given when the steps begin: what the robot swings between is not begun anew within a step.
#[test]
fn an_oscillation_in_a_gait_is_the_commanded_one() {
    let [first, second] = [[-1.0, 1.5], [0.5, 3.0]];
    let gait = Gait::new(name(), &[-44.0], &[first, second], &[1, 1, 2, 0], 500, true).expect("sound");
    let mut world = playing(&gait);
    let mut commanded = World::new();
    let mut turned_back = 0;
    let mut before = 0.0;
    for tick in 0..6000 {
        let oscillate = |[from, to]: [f32; 2]| Command::Oscillate { from, to, style: Stroke::BangBang };
        let command = match tick / 500 % 4 {
            0 | 1 => oscillate(first),
            2 => oscillate(second),
            _ => Command::Speed { omega: -44.0 },
        };
        world.controller.heartbeat(world.time_us);
        let _ = commanded.controller.command(command, commanded.time_us);
        assert_eq!(world.tick(), commanded.tick(), "tick {tick}");
        assert_eq!(world.controller.state(), State::Gait);
        turned_back += u32::from(before * world.speed < 0.0);
        before = world.speed;
    }
    assert!(turned_back > 20, "it swung: {turned_back} times");
}

#[test]
fn missed_ticks_take_their_share_of_the_gait() {
    let gait = gait(&[44.0, -44.0], &[0, 1, 0], 20, false);
    let mut world = playing(&gait);
    world.controller.heartbeat(0);
    world.tick();
    // One that has just run and 15 that did not: the next is number 16 of 20.
    world.pass(15);
    world.tick();
    assert_eq!(world.controller.telemetry().reference_speed, 44.0);
    for _ in 0..3 {
        world.tick();
    }
    assert_eq!(world.controller.telemetry().reference_speed, 44.0);
    world.tick();
    assert_eq!(world.controller.telemetry().reference_speed, -44.0);
}

#[test]
fn silence_in_the_middle_slows_down_and_then_cuts_the_bridge() {
    let gait = gait(&[44.0, -44.0], &[0, 1], 200, true);
    let mut world = playing(&gait);
    let mut on = 0;
    for _ in 0..2000 {
        on += u32::from(world.tick().enable);
    }
    let fault = world.controller.telemetry().fault;
    assert_eq!((world.controller.state(), fault), (State::Fault, Some(Fault::CommandTooOld)));
    assert!((500..=551).contains(&on), "driven for {on} ms");
    assert_eq!(
        world.controller.command(play(&gait), world.time_us),
        Err(Refusal::Faulted(Fault::CommandTooOld)),
        "not without a person's clear"
    );
    assert_eq!(world.controller.command(Command::ClearFault, world.time_us), Ok(()));
    assert!(!world.tick().enable, "and then not by itself");
}

#[test]
fn a_blocked_shaft_and_a_low_cell_end_it_in_the_middle() {
    let gait = gait(&[44.0, -44.0], &[0, 1], 200, true);
    let mut world = playing(&gait);
    let beat = |world: &mut World, ticks: u32| {
        for _ in 0..ticks {
            world.controller.heartbeat(world.time_us);
            world.tick();
        }
    };
    beat(&mut world, 700);
    assert_eq!(world.controller.state(), State::Gait);
    world.blocked = true;
    beat(&mut world, 600);
    assert_eq!(world.controller.state(), State::Fault);

    let mut world = playing(&gait);
    beat(&mut world, 700);
    for _ in 0..100 {
        world.controller.heartbeat(world.time_us);
        world.tick_with(|sample| control::Sample { battery: control::AdcCode(1900), ..sample });
    }
    assert_eq!(world.controller.telemetry().fault, Some(Fault::SupplyLow));
    assert!(!world.tick().enable);
}

#[test]
fn stop_and_every_other_command_end_it() {
    let gait = gait(&[44.0], &[0; 100], 40, true);
    for (command, state) in [
        (Command::Idle, State::Idle),
        (Command::Coast, State::Coast),
        (Command::Speed { omega: 30.0 }, State::Speed),
        (Command::Position { angle: 0.5 }, State::Position),
    ] {
        let mut world = playing(&gait);
        for _ in 0..300 {
            world.controller.heartbeat(world.time_us);
            world.tick();
        }
        assert_eq!(world.controller.command(command, world.time_us), Ok(()));
        world.tick();
        assert_eq!(world.controller.state(), state);
        assert_eq!(world.controller.telemetry().actuation.enable, state.is_driving());
    }
}

#[test]
fn only_the_gait_that_is_meant_is_played() {
    let (one, other) = (gait(&[44.0], &[0], 40, true), gait(&[-44.0], &[0], 40, true));
    let mut controller = Controller::new(&parameters()).expect("valid");
    assert_eq!(controller.command(play(&one), 0), Err(Refusal::NoGait));
    assert_eq!(controller.keep_gait(&one), Ok(()));
    assert_eq!(controller.gait(), Some(one.label()));
    assert_eq!(controller.command(play(&other), 0), Err(Refusal::NoGait));
    assert_eq!(controller.command(play(&one), 0), Ok(()));
    assert_eq!(controller.keep_gait(&other), Err(Refusal::Driving));
    assert_eq!(controller.command(Command::Idle, 0), Ok(()));
    let fast = gait(&[76.0], &[0], 40, true);
    let refused = Refusal::OutOfRange { name: Field::GaitSpeed, value: 76.0, low: 6.0, high: 75.0 };
    assert_eq!(controller.keep_gait(&fast), Err(refused));
    assert_eq!(controller.gait(), Some(one.label()), "the one before is kept");
}

/// What was stored under wider limits is not played under narrower ones.
#[test]
fn changed_parameters_are_looked_at_again() {
    let gait = gait(&[44.0], &[0], 40, true);
    let mut controller = Controller::new(&parameters()).expect("valid");
    assert_eq!(controller.keep_gait(&gait), Ok(()));
    let mut narrow = parameters();
    narrow.limits.speed = 40.0;
    controller.retune(&narrow, &parameters()).expect("valid");
    assert!(matches!(controller.command(play(&gait), 0), Err(Refusal::OutOfRange { name: Field::GaitSpeed, .. })));
    let mut slow = parameters();
    slow.tick = 1.2e-3;
    controller.retune(&slow, &parameters()).expect("valid");
    assert!(matches!(controller.command(play(&gait), 0), Err(Refusal::UnevenInterval { .. })));
}

/// What a message on the air may hold: a good gait with some of its bytes changed.
fn received() -> impl Strategy<Value = Gait> {
    let (speeds, oscillations) = ([44.0, -44.0, 7.0], [[-1.0, 1.0], [0.5, 2.0]]);
    let good = Gait::new(name(), &speeds, &oscillations, &[0, 1, 2, 3, 4], 40, false).expect("sound");
    let mut buffer = [0; 300];
    let bytes = postcard::to_slice(&good, &mut buffer).expect("it fits").to_vec();
    prop::collection::vec((0..bytes.len(), any::<u8>()), 0..6).prop_filter_map("a message", move |changes| {
        let mut bytes = bytes.clone();
        changes.into_iter().for_each(|(at, byte)| bytes[at] = byte);
        postcard::from_bytes(&bytes).ok()
    })
}

proptest! {
    #[test]
    fn any_bytes_make_a_gait_that_is_refused_or_played_within_the_limits(
        bytes in prop::collection::vec(any::<u8>(), 0..260)
    ) {
        if let Ok(gait) = postcard::from_bytes::<Gait>(&bytes) {
            let _ = (gait.check_form(), gait.label(), gait.name().as_str().len(), gait.steps().count());
        }
    }

    #[test]
    fn what_was_received_is_refused_or_played_within_the_limits(gait in received()) {
        let p = parameters();
        if let Ok(per_step) = gait.check(&p.limits, p.tick) {
            let mut sequencer = Sequencer::new(per_step);
            let whole = per_step.get() * u32::try_from(gait.steps().count()).expect("few");
            for tick in 0..whole.min(5000) {
                let motion = sequencer.advance(&gait, 1);
                let within = |motion: Motion| motion.command().check(&p.limits).is_ok();
                prop_assert!(motion.is_some_and(within), "tick {}: {:?}", tick, motion);
            }
        } else {
            let mut controller = Controller::new(&p).expect("valid");
            prop_assert!(controller.keep_gait(&gait).is_err());
            prop_assert_eq!(controller.gait(), None);
        }
    }
}
