//! A controller that goes on with other parameters decides as one that was made with them.

use control::{Command, Controller, Parameters, Telemetry};

mod common;
use common::{World, parameters};

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
