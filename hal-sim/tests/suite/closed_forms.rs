//! The shaft against what can be solved by hand.

use crate::common::{FULL, LINEAR, STEP, apart, coulomb, driven, run};
use effects::{GravityTilt, Laws};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};
use proptest::prelude::*;

#[test]
fn free_run_ends_at_the_steady_speed_and_current() {
    // K i = b ω, v = R i + K ω
    let (k, r, b, v) = (LINEAR.torque_constant, LINEAR.resistance_ohm, LINEAR.viscous, 5.0);
    let mut state = ShaftState::default();
    run(&LINEAR.stepper(STEP), &mut state, driven(v), 3.0);
    let speed = k * v / (k * k + r * b);
    assert!(apart(state.speed, speed) < 1e-12, "{} rad/s, {speed} expected", state.speed);
    assert!(apart(state.current, b * speed / k) < 1e-9, "{} A", state.current);
}

#[test]
fn free_run_with_bridge_and_friction_ends_at_the_steady_speed() {
    // v − drop − (R + slope) i = K ω, K i = b ω + C
    let shaft = Shaft { laws: Laws { driver_drop: FULL.laws.driver_drop, ..coulomb(2.2e-3, 3e-3) }, ..FULL };
    let bridge = shaft.laws.bridge();
    let (k, r, b) = (shaft.torque_constant, shaft.resistance_ohm + bridge.slope_ohm, shaft.viscous);
    let mut state = ShaftState::default();
    run(&shaft.stepper(STEP), &mut state, driven(5.0), 3.0);
    let speed = (k * (5.0 - bridge.drop_v) - r * 2.2e-3) / (k * k + r * b);
    assert!(apart(state.speed, speed) < 1e-12, "{} rad/s, {speed} expected", state.speed);
    assert!(apart(state.current, (2.2e-3 + b * speed) / k) < 1e-9, "{} A", state.current);
}

#[test]
fn stall_current_and_torque() {
    // So much inertia that the shaft stays: 6 V give 400 mA and 8.4 mN·m.
    let shaft = Shaft { inertia_kg_m2: 1e9, ..LINEAR };
    let mut state = ShaftState::default();
    let stepper = shaft.stepper(STEP);
    run(&stepper, &mut state, driven(6.0), 0.01);
    assert!(apart(state.current, 0.4) < 1e-9, "{} A", state.current);
    let means = stepper.advance(&mut state, driven(6.0));
    assert!(apart(means.current * shaft.torque_constant, 8.36e-3) < 1e-9);
}

/// Speed and current of the linear motor a time after a voltage step from rest: two exponentials.
fn step_response(shaft: &Shaft, voltage: f64, time: f64) -> (f64, f64) {
    let (r, l, k) = (shaft.resistance_ohm, shaft.inductance_h, shaft.torque_constant);
    let (j, b) = (shaft.inertia_kg_m2, shaft.viscous);
    // L J ω'' + (R J + L b) ω' + (R b + K²) ω = K v
    let (a2, a1, a0) = (l * j, r * j + l * b, r * b + k * k);
    let root = (a1 * a1 - 4.0 * a2 * a0).sqrt();
    let fast = -(a1 + root) / (2.0 * a2);
    let slow = -2.0 * a0 / (a1 + root);
    let end = k * voltage / a0;
    let (e_fast, e_slow) = ((fast * time).exp(), (slow * time).exp());
    let speed = end * (1.0 - (fast * e_slow - slow * e_fast) / (fast - slow));
    let rate = end * fast * slow * (e_fast - e_slow) / (fast - slow);
    (speed, (j * rate + b * speed) / k)
}

/// Largest error of the speed against the closed form, relative to the end speed, over 0.2 s.
fn step_response_error(shaft: &Shaft, step: f64) -> f64 {
    let stepper = shaft.stepper(step);
    let mut state = ShaftState::default();
    let end = step_response(shaft, 5.0, 1e9).0;
    let mut worst: f64 = 0.0;
    for n in 1..=(0.2 / step).round() as usize {
        stepper.advance(&mut state, driven(5.0));
        let (speed, _) = step_response(shaft, 5.0, n as f64 * step);
        worst = worst.max((state.speed - speed).abs() / end);
    }
    worst
}

#[test]
fn step_response_is_two_exponentials_though_the_step_is_ten_electrical_time_constants() {
    let coarse = step_response_error(&LINEAR, 1e-4);
    assert!(coarse < 1e-6, "off by {coarse} of the end speed");
    let mut state = ShaftState::default();
    run(&LINEAR.stepper(1e-4), &mut state, driven(5.0), 0.05);
    let (_, current) = step_response(&LINEAR, 5.0, 0.05);
    assert!(apart(state.current, current) < 1e-5, "{} A, {current} expected", state.current);
}

#[test]
fn step_response_holds_for_slow_windings_too() {
    // From 0.1 µH to 50 mH: τ from far below to far above the step.
    for inductance_h in [1e-7, 1e-5, 2e-3, 5e-2] {
        let shaft = Shaft { inductance_h, ..LINEAR };
        let error = step_response_error(&shaft, 1e-4);
        assert!(error < 3e-4, "{inductance_h} H: off by {error} of the end speed");
        let finer = step_response_error(&shaft, 1e-5);
        assert!(finer < 0.02 * error || finer < 1e-9, "{inductance_h} H: {finer} after {error}");
    }
}

#[test]
fn coast_down_with_viscous_damping_is_an_exponential() {
    let start = 100.0;
    let mut state = ShaftState { speed: start, ..ShaftState::default() };
    run(&LINEAR.stepper(STEP), &mut state, Terminals::Open, 2.0);
    let rate = LINEAR.viscous / LINEAR.inertia_kg_m2;
    let speed = start * (-rate * 2.0).exp();
    assert!(apart(state.speed, speed) < 1e-8, "{} rad/s, {speed} expected", state.speed);
    assert!(apart(state.angle, (start - speed) / rate) < 1e-8);
    assert_eq!(state.current, 0.0);
}

#[test]
fn coast_down_with_coulomb_friction_stops_when_it_must() {
    // The bristle starts wound up and is so short that it does not count: t = J ω₀ / C, θ = ω₀ t / 2.
    let shaft = Shaft { laws: coulomb(2e-3, 1e-7), viscous: 0.0, ..LINEAR };
    let start = 44.0;
    let stop = shaft.inertia_kg_m2 * start / 2e-3;
    let stepper = shaft.stepper(1e-5);
    let mut state = ShaftState { speed: start, bristle: 1.0, ..ShaftState::default() };
    let mut at_rest = None;
    for n in 1..10_000 {
        stepper.advance(&mut state, Terminals::Open);
        if state.speed.abs() < 0.02 && at_rest.is_none() {
            at_rest = Some(f64::from(n) * 1e-5);
        }
        assert!(state.speed > -0.05, "turned back at {} rad/s", state.speed);
    }
    let at_rest = at_rest.unwrap();
    assert!((at_rest - stop).abs() < 3e-5, "stopped after {at_rest} s, {stop} expected");
    assert!(apart(state.angle, 0.5 * start * stop) < 1e-4, "after {} rad", state.angle);
    assert!(state.speed.abs() < 0.02, "does not rest: {} rad/s", state.speed);
}

#[test]
fn a_hanging_mass_swings_with_its_period() {
    // Small angles about where it hangs: Ω = √(τ/J); exact to amplitude²/16.
    let gravity = GravityTilt { torque_nm: 0.29e-3, direction_rad: 0.7 };
    let shaft = Shaft { laws: Laws { gravity_tilt: Some(gravity), ..Laws::NONE }, viscous: 0.0, ..LINEAR };
    let omega = (gravity.torque_nm / shaft.inertia_kg_m2).sqrt();
    let amplitude = 0.01;
    let stepper = shaft.stepper(STEP);
    let mut state = ShaftState { angle: 0.7 + amplitude, ..ShaftState::default() };
    for n in 1..=10_000 {
        stepper.advance(&mut state, Terminals::Open);
        let expected = 0.7 + amplitude * (omega * STEP * f64::from(n)).cos();
        assert!((state.angle - expected).abs() < 2e-3 * amplitude, "{} rad, {expected} expected", state.angle);
    }
}

#[test]
fn no_current_below_the_bridges_drop() {
    let mut state = ShaftState::default();
    run(&FULL.stepper(STEP), &mut state, driven(2.0), 0.1);
    assert_eq!(state.current, 0.0);
    run(&FULL.stepper(STEP), &mut state, driven(5.0), 0.1);
    assert!(state.current > 0.0 && state.speed > 1.0);
}

#[test]
fn parameters_that_are_nan_make_the_state_nan() {
    for shaft in [Shaft { inertia_kg_m2: f64::NAN, ..FULL }, Shaft { laws: coulomb(f64::NAN, 3e-3), ..FULL }] {
        let mut state = ShaftState::default();
        run(&shaft.stepper(STEP), &mut state, driven(5.0), 0.01);
        assert!(state.speed.is_nan() && state.angle.is_nan(), "{shaft:?}: {state:?}");
    }
}

#[test]
fn a_bristle_without_length_is_rigid_and_not_nan() {
    let shaft = Shaft { laws: coulomb(2.2e-3, 0.0), ..FULL };
    let mut state = ShaftState::default();
    run(&shaft.stepper(STEP), &mut state, driven(5.0), 0.01);
    assert!(state.speed > 0.0 && state.speed.is_finite() && state.angle.is_finite(), "{state:?}");
}

#[test]
fn friction_that_drives_runs_away_and_is_not_nan() {
    let shaft = Shaft { laws: coulomb(-1.0, 3e-3), ..FULL };
    let mut state = ShaftState::default();
    run(&shaft.stepper(STEP), &mut state, driven(5.0), 0.01);
    assert!(state.speed.is_finite() && state.angle.is_finite() && state.current.is_finite(), "{state:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nothing_explodes_at_any_step(
        step in 1e-6f64..5e-3, voltage in -12.0f64..12.0, speed in -500.0f64..500.0, bristle in -1.0f64..1.0,
        presliding in 1e-7f64..0.1, inertia in 1e-7f64..1e-4, inductance in 0.0f64..0.1, drop in 0.0f64..3.0,
    ) {
        let mut shaft = Shaft { inertia_kg_m2: inertia, inductance_h: inductance, ..FULL };
        shaft.laws.stribeck_friction.as_mut().unwrap().presliding_rad = presliding;
        shaft.laws.driver_drop.as_mut().unwrap().drop_v = drop;
        let stepper = shaft.stepper(step);
        let mut state = ShaftState { speed, bristle, ..ShaftState::default() };
        let free = voltage.abs() / shaft.torque_constant;
        for _ in 0..200 {
            stepper.advance(&mut state, driven(voltage));
            prop_assert!(state.bristle.abs() <= 1.0);
            prop_assert!(state.speed.is_finite() && state.speed.abs() <= 2.0 * (free + speed.abs() + 50.0), "{state:?}");
            prop_assert!(state.current.abs() <= 2.0 * (12.0 + 0.0209 * (speed.abs() + free)) / 15.0, "{state:?}");
        }
    }

    #[test]
    fn everything_is_mirrored(voltage in -6.0f64..6.0, speed in -60.0f64..60.0, bristle in -1.0f64..1.0) {
        let mut shaft = FULL;
        shaft.laws.gravity_tilt.as_mut().unwrap().direction_rad = 0.0;
        let stepper = shaft.stepper(STEP);
        let mut one = ShaftState { speed, bristle, angle: 0.3, current: 0.1, ..ShaftState::default() };
        let mut other =
            ShaftState { speed: -speed, bristle: -bristle, angle: -0.3, current: -0.1, ..ShaftState::default() };
        for _ in 0..100 {
            stepper.advance(&mut one, driven(voltage));
            stepper.advance(&mut other, driven(-voltage));
            prop_assert_eq!(one.speed, -other.speed);
            prop_assert_eq!(one.current, -other.current);
        }
    }
}
