//! What must be in order before the bridge is switched on, and that no failsafe is set away.

use control::parameters::table::{find, keeps_failsafe};
use control::{AdcCode, Command, Controller, Refusal, Sample, State, Unready};

use crate::common::{World, parameters};

const DRIVE: Command = Command::Speed { omega: 44.0 };

/// A robot that has started, been cleared, and looked at changed samples for so many ticks: what it says to a command.
fn answer(mut world: World, ticks: u32, change: impl Fn(Sample) -> Sample) -> Result<(), Refusal> {
    world.controller.command(Command::ClearFault, 0).unwrap();
    for _ in 0..ticks {
        world.tick_with(&change);
    }
    world.controller.command(DRIVE, world.time_us)
}

fn started() -> World {
    let mut world = World::new();
    world.controller = Controller::restarted(&parameters(), &parameters()).unwrap();
    world
}

#[test]
fn a_robot_in_order_drives_once_it_has_looked() {
    assert_eq!(answer(started(), 10, |sample| sample), Err(Refusal::NotReady(Unready::Checking)));
    assert_eq!(answer(started(), 100, |sample| sample), Ok(()));
}

#[test]
fn what_is_not_in_order_is_named() {
    let refused = |change: fn(Sample) -> Sample| match answer(started(), 100, change) {
        Err(Refusal::NotReady(unready)) => unready,
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(|s| Sample { angle: AdcCode(2000), ..s }), Unready::SensorStill);
    let jumping = refused(|s| Sample { angle: AdcCode(2000 + (s.time_us / 1000 % 2 * 200) as u16), ..s });
    assert!(matches!(jumping, Unready::SensorNoisy(counts) if (150.0..=200.0).contains(&counts)), "{jumping:?}");
    assert!(matches!(refused(|s| Sample { battery: AdcCode(1500), ..s }), Unready::SupplyLow(_)));
    assert!(matches!(refused(|s| Sample { battery: AdcCode(3500), ..s }), Unready::SupplyHigh(_)));
}

#[test]
fn a_saved_failsafe_that_is_weaker_than_the_factorys_does_not_drive() {
    let mut weak = parameters();
    weak.supervisor.stall.persistence = 0.25;
    let mut world = World::new();
    world.controller = Controller::restarted(&weak, &parameters()).unwrap();
    let index = find("controller.supervisor.stall_persistence_s").unwrap();
    assert_eq!(answer(world, 100, |sample| sample), Err(Refusal::NotReady(Unready::WeakFailsafe(index))));
}

#[test]
fn a_failsafe_may_be_made_stricter_and_not_weaker() {
    let factory = parameters();
    let index = |key: &str| find(&format!("controller.supervisor.{key}")).unwrap();
    for (key, stricter, weaker) in
        [("stall_persistence_s", 0.1, 0.25), ("command_age_s", 0.3, 0.6), ("supply_v", 3.4, 3.0)]
    {
        assert_eq!(keeps_failsafe(index(key), stricter, &factory), Ok(()), "{key}");
        let refused = keeps_failsafe(index(key), weaker, &factory);
        assert!(matches!(refused, Err(Refusal::WeakensFailsafe { .. })), "{key}: {refused:?}");
    }
    // What was possible once: a blocked shaft for 10 s, a silence of 2 s.
    for (key, value) in [("stall_persistence_s", 10.0), ("command_bound_s", 2.0)] {
        assert!(factory.with(index(key), value).is_err(), "{key}");
    }
}

#[test]
fn a_starved_loop_begins_no_drive() {
    let mut world = World::new();
    for _ in 0..100 {
        world.tick();
        world.pass(1);
    }
    let refused = world.controller.command(DRIVE, world.time_us);
    assert!(matches!(refused, Err(Refusal::NotReady(Unready::LoopStarved(_)))), "{refused:?}");
    assert_eq!(world.controller.state(), State::Idle);
}
