//! The cell's charge, the converter's limits, the rail's sag.

use crate::common::{LINEAR, apart, default_robot, drive};
use control::Actuation;
use effects::{BatterySag, Laws};
use hal_sim::shaft::Shaft;
use hal_sim::supply::Supply;
use hal_sim::{Settings, SimulatedRobot};

fn supply(charge: f64) -> Supply {
    Supply::new(&default_robot(), charge)
}

#[test]
fn the_open_circuit_voltage_follows_the_table() {
    for (charge, voltage) in [(0.0, 3.5), (0.15, 3.65), (0.55, 3.9), (0.65, 3.95), (0.87, 4.1), (1.0, 4.2)] {
        let open = supply(charge).cell.unwrap().open_circuit();
        assert!((open - voltage).abs() < 1e-12, "{open} V at {charge}, {voltage} expected");
    }
}

#[test]
fn the_cell_gives_the_power_that_the_rail_takes() {
    let mut cell = supply(0.8).cell.unwrap();
    cell.draw(1.5, 1.0);
    let power = cell.voltage() * cell.current;
    // The charge drawn in this second moved the open-circuit voltage by about a millivolt.
    assert!(apart(power * cell.efficiency(), 1.5) < 1e-3, "{power} W out of the cell");
    let ideal = 1.5 / cell.efficiency() / cell.open_circuit();
    assert!(cell.current > ideal, "the internal resistance costs something");
}

#[test]
fn charge_is_booked_to_the_last_coulomb() {
    let mut supply = supply(0.9);
    let before = supply.cell.as_ref().unwrap().charge();
    let mut coulombs = 0.0;
    for n in 0..5000 {
        supply.drive(&LINEAR, 0.8, 0.01 * f64::from(n));
        supply.book(0.1, 1e-3);
        supply.end_period(&Laws::NONE, 1e-3);
        coulombs += supply.cell.as_ref().unwrap().current * 1e-3;
    }
    let cell = supply.cell.as_ref().unwrap();
    let fallen = before - cell.charge();
    assert!(apart(fallen * cell.capacity_as, coulombs) < 1e-9, "{fallen} of the charge, {coulombs} C");
    // (0.1 A + logic)·5 V/η from a cell of about 4 V
    let expected = (0.1 + cell.logic_a) * 5.0 / cell.efficiency() / 4.05 * 5.0;
    assert!(apart(coulombs, expected) < 0.05, "{coulombs} C, about {expected} expected");
}

#[test]
fn the_whole_robot_draws_what_its_motor_and_electronics_need() {
    let robot = default_robot();
    let settings = Settings { charge: Some(0.9), ..Settings::default() };
    let mut idle = SimulatedRobot::with(&robot, 1, &settings);
    let mut driving = idle.clone();
    for _ in 0..5000 {
        idle.advance(Actuation::OFF);
        driving.advance(drive(1.0));
    }
    let cell = Supply::new(&robot, 0.9).cell.unwrap();
    let drawn = |robot: &SimulatedRobot| (0.9 - robot.charge().unwrap()) * cell.capacity_as;
    let (idle_as, driving_as) = (drawn(&idle), drawn(&driving));
    // Energy over efficiency, at the mean voltage of a cell at 90 %, for 5 s.
    let cell_as = |rail_a: f64| 5.0 * rail_a / cell.efficiency() / 4.05 * 5.0;
    assert!(apart(idle_as, cell_as(cell.logic_a)) < 0.05, "idle {idle_as} A·s");
    let motor_a = driving.truth().current;
    assert!(motor_a > 0.08, "{motor_a} A");
    assert!(apart(driving_as - idle_as, cell_as(motor_a)) < 0.1, "driving {driving_as} A·s");
    assert!(driving.truth().battery_v < idle.truth().battery_v);
}

#[test]
fn the_rail_sags_at_once_and_relaxes() {
    let mut supply = supply(1.0);
    let sag = BatterySag { resistance_ohm: 0.5, relaxation_ohm: 0.2, relaxation_s: 0.3 };
    let shaft = Shaft { laws: Laws { battery_sag: Some(sag), ..Laws::NONE }, ..LINEAR };
    // At a stalled motor: v = 5 − R_s d i and i = d v/R, so i = d·5/(R + d² R_s).
    let duty = 0.9;
    let current = duty * 5.0 / (15.0 + duty * duty * 0.5);
    let rail = supply.drive(&shaft, duty, 0.0);
    assert!(apart(rail, 5.0 - 0.5 * duty * current) < 1e-12, "{rail} V");
    for n in 1..=600 {
        supply.drive(&shaft, duty, 0.0);
        supply.book(0.2, 1e-3);
        supply.end_period(&shaft.laws, 1e-3);
        let slow = 0.2 * 0.2 * (1.0 - (-f64::from(n) * 1e-3 / 0.3f64).exp());
        assert!(
            (shaft.laws.supply_fallen(&supply.states) - slow).abs() < 1e-12,
            "{} V after {n} ms",
            shaft.laws.supply_fallen(&supply.states)
        );
    }
}

#[test]
fn beyond_the_converters_current_the_rail_falls_to_where_the_bridge_takes_no_more() {
    let mut supply = supply(1.0);
    let cell = supply.cell.as_mut().unwrap();
    cell.limit_a = 0.3;
    let logic_a = cell.logic_a;
    // Stalled at full duty the motor wants 5/15 A = 0.333 A.
    let rail = supply.drive(&LINEAR, 1.0, 0.0);
    assert!(apart(rail / LINEAR.resistance_ohm, 0.3 - logic_a) < 1e-12, "{rail} V");
    // The other way round just the same.
    assert_eq!(supply.drive(&LINEAR, -1.0, 0.0), rail);
    assert_eq!(supply.drive(&LINEAR, 0.1, 0.0), 5.0);
}

#[test]
fn beyond_the_cells_power_the_rail_falls_too() {
    let mut robot = default_robot();
    robot.supply.battery.as_mut().unwrap().resistance_ohm.value = 2.0;
    let mut supply = Supply::new(&robot, 0.5);
    let cell = supply.cell.as_ref().unwrap();
    let (limit, logic_a) = (cell.power_limit(), cell.logic_a);
    let rail = supply.drive(&LINEAR, 1.0, 0.0);
    let taken = rail * (rail / LINEAR.resistance_ohm + logic_a);
    assert!(rail < 5.0 && apart(taken, limit) < 1e-12, "{taken} W of {limit} W at {rail} V");
}
