//! A controller that goes on with other parameters decides as one that was made with them.

use control::{AdcCode, Command, Controller, Parameters, Sample, Telemetry};

use crate::common::{World, parameters};

/// Drives a world for half a second; everything that the controller said.
fn driven(controller: Controller) -> Vec<Telemetry> {
    let mut world = World::new();
    world.controller = controller;
    world.controller.command(Command::Speed { omega: 44.0 }, 0).unwrap();
    let said = |world: &mut World| {
        world.tick();
        world.controller.telemetry()
    };
    (0..500).map(|_| said(&mut world)).collect()
}

#[test]
fn other_numbers_of_the_motor_reach_everything_that_is_derived_from_them() {
    let usual = parameters();
    let mut other: Parameters = usual;
    other.motor.resistance *= 1.3;
    other.motor.torque_constant *= 0.9;
    let mut retuned = Controller::new(&usual).unwrap();
    retuned.retune(&other, &usual).unwrap();
    let (expected, found) = (driven(Controller::new(&other).unwrap()), driven(retuned));
    assert!(expected.iter().any(|said| said.tracking), "it drives");
    assert_ne!(expected, driven(Controller::new(&usual).unwrap()), "the numbers matter");
    assert_eq!(found, expected);
}

/// A reading corrects the current by −K/R of what it corrects the speed by: of two readings at one instant the differences
/// show K/R, A per rad/s, of a controller that tracks.
fn current_per_speed(controller: Controller, time_us: u64, code: u16) -> f32 {
    let after = |code: u16| {
        let mut controller = controller;
        controller.tick(&Sample { time_us, angle: AdcCode(code), second: None, battery: AdcCode(2400) });
        controller.telemetry()
    };
    let (low, high) = (after(code - 60), after(code + 60));
    assert!(low.tracking && high.tracking && low.speed != high.speed, "both are taken for true");
    -(high.current - low.current) / (high.speed - low.speed)
}

#[test]
fn a_controller_that_tracks_goes_on_with_the_new_numbers() {
    let usual = parameters();
    let mut other = usual;
    other.motor.resistance *= 1.3;
    other.motor.torque_constant *= 0.9;
    let mut world = World::new();
    // As soon as it tracks: little is known of the speed, and a reading says much about it.
    while !world.controller.telemetry().tracking || !(400..3700).contains(&world.code()) {
        assert!(world.time_us < 1_000_000, "it finds the angle");
        world.run(Command::Speed { omega: 44.0 }, 1);
    }
    let code = world.code();
    let ratio = |of: &Parameters| of.motor.torque_constant / of.motor.resistance;
    let mut retuned = world.controller;
    for parameters in [usual, other] {
        retuned.retune(&parameters, &usual).unwrap();
        let (found, expected) = (current_per_speed(retuned, world.time_us, code), ratio(&parameters));
        assert!((found / expected - 1.0).abs() < 0.02, "{found} for {expected} A per rad/s");
    }
}
