//! Dahl's bristle at rest and in motion.

use crate::common::{LINEAR, STEP, coulomb, driven, run};
use effects::{GravityTilt, Laws, LoadFriction, StribeckFriction};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};

const FRICTION: Laws = coulomb(2e-3, 3e-3);

#[test]
fn a_load_below_the_level_is_held_by_a_deflection() {
    let shaft = Shaft { laws: FRICTION, ..LINEAR };
    let stepper = shaft.stepper(STEP);
    let mut state = ShaftState::default();
    // Slowly up to half of the level: s = 1 − exp(−θ/δ) = ½ at θ = δ ln 2. (A sudden load overshoots, and a Dahl bristle
    // keeps a part of every overshoot.)
    let voltage = 1e-3 / shaft.torque_constant * shaft.resistance_ohm;
    for n in 0..20_000 {
        stepper.advance(&mut state, driven(voltage * f64::from(n) / 20_000.0));
    }
    let expected = 3e-3 * std::f64::consts::LN_2;
    assert!((state.angle - expected).abs() < 1e-6, "{} rad, {expected} expected", state.angle);
    run(&stepper, &mut state, driven(voltage), 2.0);
    let held = state.angle;
    assert!((state.bristle - 0.5).abs() < 1e-9, "bristle {}", state.bristle);
    run(&stepper, &mut state, driven(voltage), 10.0);
    assert!((state.angle - held).abs() < 1e-9, "crept by {} rad", state.angle - held);
    assert!(state.speed.abs() < 1e-6);
}

#[test]
fn a_load_above_the_level_slides() {
    let shaft = Shaft { laws: FRICTION, ..LINEAR };
    let mut state = ShaftState::default();
    let voltage = 2.2e-3 / shaft.torque_constant * shaft.resistance_ohm;
    run(&shaft.stepper(STEP), &mut state, driven(voltage), 2.0);
    let steady = 0.2e-3 / (shaft.viscous + shaft.torque_constant.powi(2) / shaft.resistance_ohm);
    assert!((state.speed - steady).abs() < 1e-6, "{} rad/s, {steady} expected", state.speed);
}

#[test]
fn a_tilted_mass_stays_where_friction_holds_it_and_falls_where_not() {
    for (torque_nm, falls) in [(1.5e-3, false), (2.5e-3, true)] {
        let gravity_tilt = Some(GravityTilt { torque_nm, direction_rad: 0.0 });
        let shaft = Shaft { laws: Laws { gravity_tilt, ..FRICTION }, ..LINEAR };
        let start = std::f64::consts::FRAC_PI_2;
        let mut state = ShaftState { angle: start, ..ShaftState::default() };
        run(&shaft.stepper(STEP), &mut state, Terminals::Open, 3.0);
        let moved = start - state.angle;
        assert_eq!(moved > 0.1, falls, "{torque_nm} N·m: moved by {moved} rad");
    }
}

#[test]
fn stribeck_breaks_away_above_the_sliding_level() {
    let stribeck_friction = Some(StribeckFriction {
        torque_nm: 2e-3,
        breakaway_excess_nm: 1e-3,
        speed_rad_per_s: 5.0,
        presliding_rad: 3e-3,
    });
    let shaft = Shaft { laws: Laws { stribeck_friction, ..Laws::NONE }, ..LINEAR };
    let stepper = shaft.stepper(STEP);
    let torque = |voltage: f64| voltage * shaft.torque_constant / shaft.resistance_ohm;
    let mut state = ShaftState::default();
    let mut voltage = 0.0;
    while state.speed < 1.0 {
        voltage += 1e-4;
        stepper.advance(&mut state, driven(voltage));
    }
    assert!((2.9e-3..3.2e-3).contains(&torque(voltage)), "broke away at {} N·m", torque(voltage));
}

#[test]
fn load_friction_grows_with_the_torque_through_the_teeth() {
    let laws = |coefficient: f64| Laws {
        load_friction: Some(LoadFriction { coefficient, presliding_rad: 3e-3 }),
        ..Laws::NONE
    };
    let shaft = Shaft { laws: laws(0.2), viscous: 0.0, ..LINEAR };
    let mut state = ShaftState::default();
    run(&shaft.stepper(STEP), &mut state, driven(5.0), 3.0);
    // K i (1 − c) = 0 only with no current: the no-load speed is the friction-free one …
    assert!((state.speed - 5.0 / shaft.torque_constant).abs() < 1e-3, "{} rad/s", state.speed);
    // … but the start is slower by the share c.
    let start = |coefficient: f64| {
        let mut state = ShaftState { bristle: 1.0, ..ShaftState::default() };
        run(&Shaft { laws: laws(coefficient), ..shaft }.stepper(1e-5), &mut state, driven(5.0), 1e-3);
        state.speed
    };
    let share = start(0.2) / start(0.0);
    assert!((share - 0.8).abs() < 0.01, "{share}");
}

#[test]
fn a_bristle_shorter_than_a_step_does_not_chatter() {
    let shaft = Shaft { laws: coulomb(2e-3, 1e-7), ..LINEAR };
    let mut state = ShaftState { speed: 20.0, ..ShaftState::default() };
    run(&shaft.stepper(1e-3), &mut state, driven(0.5), 0.5);
    assert!(state.speed.abs() < 1e-3, "{} rad/s", state.speed);
}
