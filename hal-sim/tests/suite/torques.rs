//! Torques and frictions of the catalogue on the shaft, against closed forms.

use std::f64::consts::{PI, TAU};

use crate::common::{LINEAR, STEP, apart, coulomb, driven, run};
use effects::{BiasTorque, CubicDrag, DirectionalFriction, FrictionPatch, Laws, QuadraticDrag, TorqueRipple};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};

fn with(laws: Laws) -> Shaft {
    Shaft { laws, ..LINEAR }
}

/// Damping of the linear motor at driven terminals, N·m·s/rad.
fn electric(shaft: &Shaft) -> f64 {
    shaft.torque_constant.powi(2) / shaft.resistance_ohm + shaft.viscous
}

#[test]
fn a_constant_torque_turns_an_open_shaft_at_its_own_speed() {
    let shaft = with(Laws { bias_torque: Some(BiasTorque { torque_nm: -2e-5 }), ..Laws::NONE });
    let mut state = ShaftState::default();
    let time = 0.7;
    run(&shaft.stepper(STEP), &mut state, Terminals::Open, time);
    let rate = shaft.viscous / shaft.inertia_kg_m2;
    let expected = -2e-5 / shaft.viscous * (1.0 - (-rate * time).exp());
    assert!(apart(state.speed, expected) < 1e-6, "{} rad/s, {expected} expected", state.speed);
}

#[test]
fn friction_that_differs_by_direction_leaves_other_speeds_either_way() {
    let law = DirectionalFriction { forward_nm: 1.2e-3, backward_nm: 0.4e-3, presliding_rad: 3e-3 };
    let shaft = with(Laws { directional_friction: Some(law), ..Laws::NONE });
    for (voltage, friction) in [(3.0, 1.2e-3), (-3.0, -0.4e-3)] {
        let mut state = ShaftState::default();
        run(&shaft.stepper(STEP), &mut state, driven(voltage), 1.0);
        let expected = (shaft.torque_constant * voltage / shaft.resistance_ohm - friction) / electric(&shaft);
        assert!(apart(state.speed, expected) < 1e-6, "{} rad/s, {expected} expected", state.speed);
    }
}

#[test]
fn friction_of_equal_levels_is_coulombs_and_unequal_ones_rest() {
    let equal = DirectionalFriction { forward_nm: 1e-3, backward_nm: 1e-3, presliding_rad: 3e-3 };
    let of = |laws| {
        let stepper = with(laws).stepper(STEP);
        let mut state = ShaftState::default();
        for n in 0..5000 {
            stepper.advance(&mut state, driven(3.0 * (0.004 * f64::from(n)).sin()));
        }
        state
    };
    assert_eq!(of(Laws { directional_friction: Some(equal), ..Laws::NONE }), of(coulomb(1e-3, 3e-3)));
    // Where a constant torque would pull it on, a shaft that rests stays.
    let law = DirectionalFriction { backward_nm: 0.0, ..equal };
    let stepper = with(Laws { directional_friction: Some(law), ..Laws::NONE }).stepper(STEP);
    let mut state = ShaftState { speed: 5.0, ..ShaftState::default() };
    run(&stepper, &mut state, Terminals::Open, 1.0);
    let rests = state.angle;
    run(&stepper, &mut state, Terminals::Open, 5.0);
    // Without friction backwards nothing brakes what the bristle gives back but damping: it ends within its length.
    assert!((state.angle - rests).abs() < 3e-3 && state.speed.abs() < 1e-3, "{state:?}");
}

#[test]
fn friction_that_leans_never_gives_more_than_it_got() {
    let law = DirectionalFriction { forward_nm: 2e-3, backward_nm: 0.0, presliding_rad: 3e-3 };
    let shaft = with(Laws { directional_friction: Some(law), ..Laws::NONE });
    for step in [1e-4, 1.5e-3] {
        let stepper = shaft.stepper(step);
        let mut state = ShaftState::default();
        let (mut taken, mut most) = (0.0, 0.0f64);
        for n in 0..20_000 {
            let means = stepper.advance(&mut state, driven(3.0 * (0.003 * f64::from(n)).sin()));
            taken += means.friction_nm * means.speed * step;
            most = most.max(means.friction_nm.abs());
            assert!(taken > -1e-9, "{taken} J after {n} steps of {step} s");
        }
        assert!(taken > 1e-4 && most < 2.01e-3, "{taken} J, {most} N·m");
    }
}

#[test]
fn ripple_is_a_potential() {
    // Energy of a shaft that nothing else acts on: ½ J ω² + (torque/order)·(−sin(order·θ − phase)).
    let law = TorqueRipple { order: 7.0, torque_nm: 1.3e-4, phase_rad: 0.4 };
    let shaft = Shaft { viscous: 0.0, ..with(Laws { torque_ripple: Some(law), ..Laws::NONE }) };
    let energy = |state: &ShaftState| {
        0.5 * shaft.inertia_kg_m2 * state.speed * state.speed
            - law.torque_nm / law.order * (law.order * state.angle - law.phase_rad).sin()
    };
    let mut state = ShaftState { speed: 12.0, ..ShaftState::default() };
    let (before, stepper) = (energy(&state), shaft.stepper(1e-5));
    let mut speeds = (f64::INFINITY, 0.0f64);
    for _ in 0..200_000 {
        stepper.advance(&mut state, Terminals::Open);
        assert!((energy(&state) - before).abs() < 1e-3 * law.torque_nm / law.order);
        speeds = (speeds.0.min(state.speed), speeds.1.max(state.speed));
    }
    // All of the potential's height, 2·torque/order, comes and goes in the speed.
    let swing = 0.5 * shaft.inertia_kg_m2 * (speeds.1.powi(2) - speeds.0.powi(2));
    assert!(apart(swing, 2.0 * law.torque_nm / law.order) < 2e-3, "{swing} J");
    // Seven periods a turn.
    for angle in [0.1, 1.0, 4.0] {
        let torque = |angle| shaft.laws.torque(angle);
        assert!((torque(angle) - torque(angle + TAU / 7.0)).abs() < 1e-12);
        assert!((torque(angle) + torque(angle + PI / 7.0)).abs() < 1e-12);
    }
}

#[test]
fn drag_coasts_down_as_its_closed_form() {
    let shaft = |laws| Shaft { viscous: 0.0, ..with(laws) };
    let (start, inertia) = (200.0, LINEAR.inertia_kg_m2);
    for direction in [1.0, -1.0] {
        for step in [1e-4, 1e-3] {
            let time = 0.5;
            let coast = |shaft: Shaft| {
                let mut state = ShaftState { speed: direction * start, ..ShaftState::default() };
                run(&shaft.stepper(step), &mut state, Terminals::Open, time);
                state.speed
            };
            // J dω/dt = −c ω²: 1/ω grows evenly; J dω/dt = −c ω³: 1/ω² does.
            let c = 4e-8;
            let square = coast(shaft(Laws { quadratic_drag: Some(QuadraticDrag { drag: c }), ..Laws::NONE }));
            let expected = direction / (1.0 / start + c * time / inertia);
            assert!(apart(square, expected) < 2e-2 * step / 1e-3, "{square}, {expected} expected");
            let c = 2e-10;
            let cube = coast(shaft(Laws { cubic_drag: Some(CubicDrag { drag: c }), ..Laws::NONE }));
            let expected = direction / (start.powi(-2) + 2.0 * c * time / inertia).sqrt();
            assert!(apart(cube, expected) < 2e-2 * step / 1e-3, "{cube}, {expected} expected");
        }
    }
}

#[test]
fn drag_that_stops_a_shaft_within_a_step_does_not_turn_it_back() {
    let stepper = with(Laws { cubic_drag: Some(CubicDrag { drag: 1.0 }), ..Laws::NONE }).stepper(1e-3);
    let mut state = ShaftState { speed: 300.0, ..ShaftState::default() };
    let mut last = state.speed;
    for _ in 0..1000 {
        stepper.advance(&mut state, Terminals::Open);
        assert!(state.speed.abs() <= last.abs(), "{} after {last}", state.speed);
        last = state.speed;
    }
    assert!(last.abs() < 1.0);
}

#[test]
fn a_patch_takes_its_level_times_its_width() {
    let law =
        FrictionPatch { torque_nm: 1.5e-4, middle_rad: 2.9, half_width_rad: 0.6, edge_rad: 0.05, presliding_rad: 1e-3 };
    let shaft = Shaft { viscous: 0.0, ..with(Laws { friction_patch: Some(law), ..Laws::NONE }) };
    let stepper = shaft.stepper(1e-5);
    // The range goes over the seam at half a turn, and a coasting shaft loses ∫ g dθ = torque·width in it, a turn.
    for direction in [1.0, -1.0] {
        let mut state = ShaftState { speed: direction * 60.0, bristle: direction, ..ShaftState::default() };
        let kinetic = |state: &ShaftState| 0.5 * shaft.inertia_kg_m2 * state.speed * state.speed;
        let before = kinetic(&state);
        while state.angle.abs() < 3.0 * TAU {
            stepper.advance(&mut state, Terminals::Open);
        }
        let lost = before - kinetic(&state);
        let expected = 3.0 * law.torque_nm * 2.0 * law.half_width_rad;
        assert!(apart(lost, expected) < 1e-3, "{lost} J, {expected} expected");
    }
    // Outside nothing brakes.
    assert!(shaft.laws.friction_level(0.5, 1.0, 0.0) < 1e-12 * law.torque_nm + 1e-18);
    assert!(apart(shaft.laws.friction_level(-PI, 1.0, 0.0), law.torque_nm) < 1e-5);
}
