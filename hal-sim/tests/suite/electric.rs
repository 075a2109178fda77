//! What the catalogue has between the command and the winding, and warmth, against closed forms.

use crate::common::{LINEAR, STEP, apart, coulomb, default_robot, drive, run};
use control::Actuation;
use effects::{
    BatteryDischarge, CommandLatency, DriverDeadTime, DriverDrop, DriverDropByCommand, Effect, GreaseWarming, Laws,
    States, WindingHeating,
};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};
use hal_sim::{Settings, SimulatedRobot};
use robot_file::Robot;
use robot_file::robot::{Quantity, Sensor};

fn with(laws: Laws) -> Shaft {
    Shaft { laws, ..LINEAR }
}

/// Speed at which a shaft ends under a duty at a supply.
fn ends(shaft: &Shaft, duty: f64, supply_v: f64) -> f64 {
    let stepper = shaft.stepper(STEP);
    let mut state = ShaftState::default();
    run(&stepper, &mut state, stepper.terminals(duty, supply_v), 1.5);
    state.speed
}

/// Of the linear motor at a voltage.
fn free_speed(voltage: f64) -> f64 {
    let (k, r) = (LINEAR.torque_constant, LINEAR.resistance_ohm);
    voltage * k / (k * k + r * LINEAR.viscous)
}

#[test]
fn a_drop_by_command_is_a_lower_voltage_whichever_way_the_current_flows() {
    let shaft = with(Laws { driver_drop_by_command: Some(DriverDropByCommand { drop_v: 1.2 }), ..Laws::NONE });
    for (duty, voltage) in [(1.0, 3.8), (0.4, 0.8), (-0.7, -2.3), (0.2, 0.0), (0.0, 0.0)] {
        let (speed, expected) = (ends(&shaft, duty, 5.0), free_speed(voltage));
        assert!((speed - expected).abs() < 1e-6, "{speed} rad/s at {duty}, {expected} expected");
    }
    // Where the motor brakes itself through the bridge, it is no more than that: a drop against the current would help.
    let stepper = shaft.stepper(STEP);
    let mut state = ShaftState { speed: 150.0, ..ShaftState::default() };
    let means = stepper.advance(&mut state, stepper.terminals(0.3, 5.0));
    let settled = (0.3 - LINEAR.torque_constant * 150.0) / LINEAR.resistance_ohm;
    assert!(apart(state.current, settled) < 1e-2 && means.current < 0.0, "{} A, {settled} expected", state.current);
}

#[test]
fn dead_time_acts_against_the_current_and_only_where_it_switches() {
    let shaft = with(Laws {
        driver_dead_time: Some(DriverDeadTime { lost_duty: 0.05, shortest_duty: 0.04, knee_a: 0.0 }),
        ..Laws::NONE
    });
    let arrives = [(0.6, 0.55), (-0.6, -0.55), (0.03, 0.0), (0.95, 0.9), (0.98, 0.955), (1.0, 1.0), (-1.0, -1.0)];
    for (duty, arrives) in arrives {
        for supply_v in [5.0, 8.0] {
            let (speed, expected) = (ends(&shaft, duty, supply_v), free_speed(arrives * supply_v));
            assert!((speed - expected).abs() < 1e-6, "{speed} rad/s at {duty}, {expected} expected");
        }
    }
    // While the motor brakes itself the sign of the current turns, and the loss with it.
    let stepper = shaft.stepper(STEP);
    let mut state = ShaftState { speed: 150.0, ..ShaftState::default() };
    stepper.advance(&mut state, stepper.terminals(0.2, 5.0));
    let settled = (0.2 * 5.0 + 0.05 * 5.0 - LINEAR.torque_constant * 150.0) / LINEAR.resistance_ohm;
    assert!(apart(state.current, settled) < 1e-2, "{} A, {settled} expected", state.current);
}

#[test]
fn of_a_current_below_its_knee_a_loss_takes_a_part() {
    let drop = DriverDrop { drop_v: 0.4, knee_a: 0.01, slope_ohm: 2.0 };
    let dead_time = DriverDeadTime { lost_duty: 0.05, shortest_duty: 0.0, knee_a: 0.02 };
    let sharp = DriverDrop { knee_a: 0.0, ..drop };
    let (supply_v, duty) = (5.0, 0.2);
    for (drop, dead_time) in
        [(Some(drop), None), (None, Some(dead_time)), (Some(drop), Some(dead_time)), (Some(sharp), Some(dead_time))]
    {
        let shaft = with(Laws { driver_drop: drop, driver_dead_time: dead_time, ..Laws::NONE });
        let (voltage, switching_v) = match shaft.stepper(STEP).terminals(duty, supply_v) {
            Terminals::Switched { voltage, switching_v } => (voltage, switching_v),
            Terminals::Driven { voltage } => (voltage, 0.0),
            Terminals::Open => panic!("a bridge that is driven is not open"),
        };
        for expected in [-0.06, -0.015, -5e-3, -1e-4, 1e-4, 5e-3, 0.015, 0.04] {
            // Kirchhoff's law of the winding tells the speed at which this much current flows.
            let in_full =
                |knee_a: f64| if knee_a > 0.0 { (expected / knee_a).clamp(-1.0, 1.0) } else { expected.signum() };
            let own = drop.map_or(0.0, |drop| drop.drop_v * in_full(drop.knee_a) + drop.slope_ohm * expected);
            let switched = dead_time.map_or(0.0, |one| one.lost_duty * supply_v * in_full(one.knee_a));
            let speed = (duty * supply_v - own - switched - LINEAR.resistance_ohm * expected) / LINEAR.torque_constant;
            let (current, slope) = shaft.settled_current(voltage, speed, switching_v);
            assert!((current - expected).abs() < 1e-12, "{current} A, {expected} expected");
            let next = shaft.settled_current(voltage, speed - 1e-6, switching_v).0;
            assert!(apart((next - current) / -1e-6, slope) < 1e-6, "slope {slope}");
        }
    }
}

fn quantity(value: f64) -> Quantity {
    Quantity { value, low: value, high: value, source: "test".to_owned() }
}

/// The default robot on a bench supply with an ideal sensor, driver and bridge, no effects but one.
fn bench<E: Effect>(values: &[f64]) -> Robot {
    let mut robot = default_robot();
    robot.sensor = Sensor::Ideal;
    robot.supply.battery = None;
    let driver = &mut robot.driver;
    (driver.pwm_steps.value, driver.dead_time_s.value) = (0.0, 0.0);
    let listed: Vec<&str> = robot.effects.listed().map(effects::Id::name).collect();
    for name in listed {
        robot.effects.remove(name);
    }
    if !values.is_empty() {
        robot.effects.insert::<E>(values.iter().map(|value| quantity(*value)).collect());
    }
    robot
}

fn start(robot: &Robot) -> SimulatedRobot {
    SimulatedRobot::with(robot, 1, &Settings { start_angle: Some(0.0), ..Settings::default() })
}

/// The shaft's angle at every tick under levels with an open bridge between them.
fn angles(robot: &Robot) -> Vec<f64> {
    let mut simulated = start(robot);
    (0..600u32)
        .map(|tick| {
            let level = (f64::from(tick / 37) * 2.4).sin() as f32;
            simulated.advance(Actuation { duty: level, enable: (tick / 37) % 4 != 3 });
            simulated.truth().angle
        })
        .collect()
}

#[test]
fn a_late_command_is_the_same_motion_later() {
    let prompt = angles(&bench::<CommandLatency>(&[]));
    let late = angles(&bench::<CommandLatency>(&[0.004]));
    assert!(late[..4].iter().all(|angle| *angle == 0.0));
    for (tick, (late, prompt)) in late[4..].iter().zip(&prompt).enumerate() {
        assert!((late - prompt).abs() < 1e-12, "{late} and {prompt} rad at tick {tick}");
    }
    // Between the ticks too: a constant speed is half a tick more behind.
    let half = angles(&bench::<CommandLatency>(&[0.0045]));
    let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64;
    let (between, to_either) = (
        late[..599].iter().zip(&late[1..]).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<_>>(),
        mean(&late[..599], &late[1..]),
    );
    assert!(mean(&half[1..], &between) < 0.02 * to_either, "{} of {to_either}", mean(&half[1..], &between));
}

#[test]
fn a_supply_falls_with_the_charge_that_the_bridge_takes() {
    let mut simulated = start(&bench::<BatteryDischarge>(&[0.5]));
    let rail = simulated.truth().bridge_supply_v;
    let mut drawn = 0.0;
    for tick in 0..4000 {
        let before = simulated.energy_j();
        let duty = if tick < 2000 { 0.9 } else { -0.5 };
        simulated.advance(drive(duty));
        drawn += (simulated.energy_j() - before) / simulated.truth().bridge_supply_v;
    }
    let fallen = rail - simulated.truth().bridge_supply_v;
    // The supply falls as often as the bridge is told: within a period's charge.
    assert!(apart(fallen, 0.5 * drawn) < 1e-3 && fallen > 0.01, "{fallen} V after {drawn} A·s");
}

/// A shaft as warm as its effects remember.
fn warmed(cold: &Shaft, states: &States) -> Shaft {
    let mut stepper = cold.stepper(STEP);
    stepper.warm(cold, states);
    *stepper.shaft()
}

#[test]
fn a_winding_warms_as_one_body_and_its_resistance_with_it() {
    let law = WindingHeating { rise_k_per_w: 80.0, time_s: 2.0 };
    let shaft = with(Laws { winding_heating: Some(law), ..Laws::NONE });
    let mut states = States::default();
    // Adiabatic at first: R_th·P/τ kelvin a second; and R_th·P in the end.
    let resistance = |states: &States| warmed(&shaft, states).resistance_ohm / LINEAR.resistance_ohm - 1.0;
    shaft.laws.warm(&mut states, 0.5, 9.0, 1e-3);
    assert!(apart(resistance(&states), 0.00393 * 80.0 * 0.5 / 2.0 * 1e-3) < 1e-3);
    for _ in 0..1999 {
        shaft.laws.warm(&mut states, 0.5, 9.0, 1e-3);
    }
    assert!(apart(resistance(&states), 0.00393 * 40.0 * (1.0 - (-1f64).exp())) < 1e-9);
    shaft.laws.warm(&mut states, 0.5, 9.0, 1e3);
    assert!(apart(resistance(&states), 0.00393 * 40.0) < 1e-9);
}

#[test]
fn a_robot_at_stall_draws_less_as_it_warms() {
    let (rise, time) = (80.0, 2.0);
    let mut simulated = start(&bench::<WindingHeating>(&[rise, time]));
    simulated.inject(hal_sim::Fault::Stalled);
    simulated.advance(drive(1.0));
    let cold = simulated.truth().current;
    for _ in 0..20_000 {
        simulated.advance(drive(1.0));
    }
    let (warm, supply) = (simulated.truth().current, simulated.truth().bridge_supply_v);
    // i = V/(R₀(1 + α·R_th·V·i)): a constant voltage, the loss V·i.
    let ratio = 1.0 + 0.00393 * rise * supply * warm;
    assert!(apart(cold / warm, ratio) < 1e-3 && ratio > 1.1, "{cold} A, then {warm} A: {ratio}");
}

#[test]
fn grease_thins_with_what_friction_takes() {
    let law = GreaseWarming { thinning_per_w: 400.0, time_s: 1.5 };
    let shaft = with(Laws { grease_warming: Some(law), ..coulomb(1e-3, 3e-3) });
    let mut states = States::default();
    shaft.laws.warm(&mut states, 9.0, 2e-3, 3.0);
    let expected = (-400.0 * 2e-3 * (1.0 - (-2f64).exp())).exp();
    assert!(apart(warmed(&shaft, &states).viscous / LINEAR.viscous, expected) < 1e-12);
    // The power is what damping and friction take at that speed.
    let stepper = shaft.stepper(STEP);
    let mut state = ShaftState::default();
    let mut means = stepper.advance(&mut state, Terminals::Driven { voltage: 3.0 });
    for _ in 0..20_000 {
        means = stepper.advance(&mut state, Terminals::Driven { voltage: 3.0 });
    }
    let expected = (1e-3 + LINEAR.viscous * state.speed) * state.speed;
    assert!(apart(means.rubbing_w, expected) < 1e-6, "{} W, {expected} expected", means.rubbing_w);
    // Of a robot that runs on, the damping that is left is less.
    let mut simulated = start(&bench::<GreaseWarming>(&[400.0, 1.5]));
    let mut speeds = (0.0, 0.0);
    for tick in 0..8000 {
        simulated.advance(drive(1.0));
        if tick == 400 {
            speeds.0 = simulated.truth().speed;
        }
    }
    speeds.1 = simulated.truth().speed;
    assert!(speeds.1 > speeds.0 * 1.0005, "{speeds:?}");
}
