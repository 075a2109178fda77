//! A load behind a spring, with and without play: closed forms, and the energy that no step makes.

use std::f64::consts::TAU;

use crate::common::{LINEAR, apart, coulomb, driven};
use effects::{Backlash, Laws, ShaftCompliance};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};

const SPRING: ShaftCompliance = ShaftCompliance {
    stiffness_nm_per_rad: 4e-3,
    damping_ratio: 0.0,
    load_share: 0.3,
    load_drag_share: 0.0,
    hardening_per_rad2: 0.0,
};
const PLAY: Backlash =
    Backlash { gap_rad: 0.1, stiffness_nm_per_rad: 2.0, damping_ratio: 0.0, load_share: 0.3, load_drag_share: 0.0 };

/// A motor that nothing brakes.
fn free(laws: Laws) -> Shaft {
    Shaft { viscous: 0.0, laws, ..LINEAR }
}

fn spring(law: ShaftCompliance) -> Laws {
    Laws { shaft_compliance: Some(law), ..Laws::NONE }
}

fn play(law: Backlash) -> Laws {
    Laws { backlash: Some(law), ..Laws::NONE }
}

/// Kinetic energy of both and what is in the spring, J.
fn energy(shaft: &Shaft, state: &ShaftState) -> f64 {
    let law = shaft.laws.coupling().unwrap();
    let load = law.load_share * shaft.inertia_kg_m2;
    let depth = (state.twist.abs() - law.half_gap).max(0.0);
    0.5 * load * state.speed.powi(2)
        + 0.5 * (shaft.inertia_kg_m2 - load) * (state.speed + state.twist_rate).powi(2)
        + 0.5 * law.stiffness * depth * depth * (1.0 + 0.5 * law.hardening * depth * depth)
}

fn momentum(shaft: &Shaft, state: &ShaftState) -> f64 {
    let law = shaft.laws.coupling().unwrap();
    shaft.inertia_kg_m2 * (state.speed + (1.0 - law.load_share) * state.twist_rate)
}

/// The states of a second after a twist (rad) is let go, in steps (s).
fn let_go(shaft: &Shaft, twist: f64, step: f64) -> Vec<ShaftState> {
    let stepper = shaft.stepper(step);
    let mut states = vec![ShaftState { twist, ..ShaftState::default() }];
    for n in 0..(1.0 / step).round() as usize {
        let mut state = states[n];
        stepper.advance(&mut state, Terminals::Open);
        states.push(state);
    }
    states
}

/// Mean time between two passages of the twist through zero on its way up, s.
fn period(states: &[ShaftState], step: f64) -> f64 {
    let passages = states.windows(2).enumerate().filter(|(_, pair)| pair[0].twist < 0.0 && pair[1].twist >= 0.0);
    let times: Vec<f64> =
        passages.map(|(n, pair)| (n as f64 + pair[0].twist / (pair[0].twist - pair[1].twist)) * step).collect();
    (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64
}

#[test]
fn two_inertias_ring_at_their_frequency_and_decay_with_their_damping() {
    let (j, share) = (LINEAR.inertia_kg_m2, SPRING.load_share);
    let (motor, load) = ((1.0 - share) * j, share * j);
    let natural = (SPRING.stiffness_nm_per_rad * (1.0 / motor + 1.0 / load)).sqrt();
    for damping_ratio in [0.0, 0.05] {
        let shaft = free(spring(ShaftCompliance { damping_ratio, ..SPRING }));
        let swing = let_go(&shaft, 0.1, 1e-4);
        let at_top = |pair: &&[ShaftState]| pair[0].twist_rate > 0.0 && pair[1].twist_rate <= 0.0;
        let peaks: Vec<f64> = swing.windows(2).filter(at_top).map(|pair| pair[1].twist.max(pair[0].twist)).collect();
        let frequency = 1.0 / period(&swing, 1e-4);
        let expected = natural * (1.0f64 - damping_ratio * damping_ratio).sqrt() / TAU;
        assert!(apart(frequency, expected) < 2e-3, "{frequency} Hz, {expected} expected");
        let decrement = (peaks[0] / peaks[5]).ln() / 5.0;
        let expected = TAU * damping_ratio / (1.0f64 - damping_ratio * damping_ratio).sqrt();
        assert!((decrement - expected).abs() < 5e-3, "{decrement}, {expected} expected");
        // The load swings against the motor, by as much as it is lighter.
        assert!(momentum(&shaft, &swing[swing.len() - 1]).abs() < 1e-15);
    }
}

#[test]
fn a_spring_that_hardens_swings_as_fast_as_duffing_has_it() {
    let (j, share, twist) = (LINEAR.inertia_kg_m2, SPRING.load_share, 0.1);
    let natural = (SPRING.stiffness_nm_per_rad / (share * (1.0 - share) * j)).sqrt();
    for hardening_per_rad2 in [30.0, 1000.0] {
        let shaft = free(spring(ShaftCompliance { hardening_per_rad2, ..SPRING }));
        let swing = let_go(&shaft, twist, 2e-5);
        assert!(apart(energy(&shaft, &swing[swing.len() - 1]), energy(&shaft, &swing[0])) < 1e-6);
        let period = period(&swing, 2e-5);
        // 4 K(m)/ω with ω² = ω₀²(1 + βA²) and m = βA²/(2 (1 + βA²)); K by the arithmetic-geometric mean.
        let harder = hardening_per_rad2 * twist * twist;
        let (mut one, mut other) = (1.0f64, (1.0 - 0.5 * harder / (1.0 + harder)).sqrt());
        for _ in 0..6 {
            (one, other) = (0.5 * (one + other), (one * other).sqrt());
        }
        let expected = TAU / one / (natural * (1.0 + harder).sqrt());
        assert!(apart(period, expected) < 1e-3, "{period} s, {expected} expected");
    }
}

#[test]
fn a_stiff_spring_is_a_rigid_shaft() {
    for laws in [coulomb(5e-4, 3e-3), Laws::NONE] {
        let rigid = Shaft { laws, ..LINEAR };
        let law = ShaftCompliance { stiffness_nm_per_rad: 50.0, damping_ratio: 0.5, ..SPRING };
        let stiff = Shaft { laws: Laws { shaft_compliance: Some(law), ..laws }, ..LINEAR };
        let end = |shaft: &Shaft| {
            let stepper = shaft.stepper(1e-4);
            let mut state = ShaftState::default();
            for n in 0..6000 {
                stepper.advance(&mut state, driven(4.0 * (0.003 * f64::from(n)).sin()));
            }
            state
        };
        let (rigid, stiff) = (end(&rigid), end(&stiff));
        assert!((rigid.angle - stiff.angle).abs() < 2e-3, "{} and {} rad", rigid.angle, stiff.angle);
        assert!((rigid.speed - stiff.speed).abs() < 2e-2, "{} and {} rad/s", rigid.speed, stiff.speed);
    }
}

#[test]
fn a_torque_on_the_load_comes_to_the_motor_through_the_spring() {
    // Both accelerate with τ/J on average, and the spring carries the motor's share of it.
    let shaft = free(spring(ShaftCompliance { damping_ratio: 1.0, ..SPRING }));
    let stepper = shaft.stepper(1e-4);
    let mut state = ShaftState::default();
    let torque = 1e-4;
    for _ in 0..20_000 {
        stepper.advance_under(&mut state, Terminals::Open, torque);
    }
    let speed = torque * 2.0 / shaft.inertia_kg_m2;
    assert!(apart(state.speed, speed) < 1e-3, "{} rad/s, {speed} expected", state.speed);
    let behind = -torque * (1.0 - SPRING.load_share) / SPRING.stiffness_nm_per_rad;
    assert!(apart(state.twist, behind) < 1e-6, "{} rad, {behind} expected", state.twist);
}

#[test]
fn drag_slows_a_load_that_no_teeth_touch_and_rubs_away_its_energy() {
    // All of the damping on the load: its speed falls with b/J_L in the play, and the motor's does not.
    let shaft = Shaft { laws: play(Backlash { load_drag_share: 1.0, gap_rad: 0.7, ..PLAY }), ..LINEAR };
    let stepper = shaft.stepper(1e-4);
    let mut state = ShaftState { speed: 10.0, ..ShaftState::default() };
    let mut rubbed = 0.0;
    for _ in 0..300 {
        rubbed += 1e-4 * stepper.advance(&mut state, Terminals::Open).rubbing_w;
    }
    let load = PLAY.load_share * shaft.inertia_kg_m2;
    let speed = 10.0 * (-shaft.viscous * 0.03 / load).exp();
    assert!(speed < 9.5 && apart(state.speed, speed) < 1e-6, "{} rad/s, {speed} expected", state.speed);
    assert!(apart(state.speed + state.twist_rate, 10.0) < 1e-12, "{} rad/s", state.speed + state.twist_rate);
    let lost = 0.5 * load * (100.0 - state.speed * state.speed);
    assert!(apart(rubbed, lost) < 1e-9, "{rubbed} J, {lost} expected");
}

#[test]
fn a_spring_carries_what_the_load_rubs_and_no_share_changes_where_the_shaft_settles() {
    for load_drag_share in [0.0, 0.4, 1.0] {
        let law = ShaftCompliance { damping_ratio: 0.5, load_drag_share, ..SPRING };
        let shaft = Shaft { laws: spring(law), ..LINEAR };
        let stepper = shaft.stepper(1e-4);
        let mut state = ShaftState::default();
        for _ in 0..50_000 {
            stepper.advance(&mut state, driven(2.0));
        }
        let (k, r, b) = (shaft.torque_constant, shaft.resistance_ohm, shaft.viscous);
        let speed = 2.0 * k / (k * k + r * b);
        assert!(apart(state.speed, speed) < 1e-9, "{} rad/s, {speed} expected", state.speed);
        let ahead = load_drag_share * b * speed / SPRING.stiffness_nm_per_rad;
        assert!((state.twist - ahead).abs() < 1e-9, "{} rad, {ahead} expected", state.twist);
    }
}

#[test]
fn play_is_crossed_in_its_time_and_nothing_pulls_before() {
    let shaft = free(play(PLAY));
    let stepper = shaft.stepper(1e-5);
    // The motor turns alone: 0.1 rad at 10 rad/s.
    let mut state = ShaftState { twist: -0.05, twist_rate: 10.0, ..ShaftState::default() };
    let mut time = 0.0f64;
    while state.speed == 0.0 {
        stepper.advance(&mut state, Terminals::Open);
        time += 1e-5;
    }
    assert!((time - 0.01).abs() < 2e-5, "{time} s");
    // An elastic blow: the motor goes on with (m − l)/(m + l) of its speed, the load with 2m/(m + l).
    while state.twist > 0.04 {
        stepper.advance(&mut state, Terminals::Open);
    }
    assert!(apart(state.speed, 10.0 * 2.0 * 0.7) < 1e-6, "{} rad/s", state.speed);
    assert!(apart(state.speed + state.twist_rate, 10.0 * 0.4) < 1e-6, "{} rad/s", state.speed + state.twist_rate);
}

#[test]
fn no_step_makes_energy_and_momentum_stays() {
    for (damping_ratio, gap_rad) in [(0.0, 0.1), (0.3, 0.1), (0.3, 1e-3), (2.0, 0.02)] {
        // Up to teeth that are a thousand times stiffer than a step follows.
        for stiffness_nm_per_rad in [0.02, 2.0, 2e3] {
            for step in [1e-4, 1.5e-3] {
                let law = Backlash { damping_ratio, gap_rad, stiffness_nm_per_rad, ..PLAY };
                let shaft = free(play(law));
                let stepper = shaft.stepper(step);
                let mut state = ShaftState { twist_rate: 37.0, ..ShaftState::default() };
                let (first, carried) = (energy(&shaft, &state), momentum(&shaft, &state));
                let mut last = first;
                for n in 0..3000 {
                    stepper.advance(&mut state, Terminals::Open);
                    let now = energy(&shaft, &state);
                    let what = format!("{law:?}, {step} s, step {n}: {now} J after {last} J");
                    assert!(now <= last * (1.0 + 1e-9), "{what}");
                    assert!(damping_ratio > 0.0 || apart(now, first) < 1e-6, "{what}");
                    assert!(apart(momentum(&shaft, &state), carried) < 1e-9, "{what}");
                    last = now;
                }
            }
        }
    }
}

#[test]
fn teeth_push_and_do_not_pull() {
    let shaft = free(play(Backlash { damping_ratio: 1.5, ..PLAY }));
    let stepper = shaft.stepper(2e-5);
    let mut state = ShaftState { twist: 0.04, twist_rate: 25.0, ..ShaftState::default() };
    let mut pushed = 0.0f64;
    for _ in 0..2000 {
        let side = state.twist;
        let means = stepper.advance(&mut state, Terminals::Open);
        assert!(means.coupling_nm * side >= 0.0, "{} N·m at {side} rad", means.coupling_nm);
        pushed = pushed.max(means.coupling_nm.abs());
    }
    assert!(pushed > 1e-3);
}

#[test]
fn a_finer_step_leads_to_the_same() {
    // Driven to and fro through the play, with friction in the motor: the plant's step against one twenty times finer.
    let law = Backlash { damping_ratio: 0.3, ..PLAY };
    let shaft = Shaft { laws: Laws { backlash: Some(law), ..coulomb(3e-4, 3e-3) }, ..LINEAR };
    let end = |step: f64| {
        let stepper = shaft.stepper(step);
        let mut state = ShaftState::default();
        let mut angles = Vec::new();
        for n in 0..(0.4 / step).round() as usize {
            // The voltage at the middle of the step: what is left is the mechanics' own error.
            let time = (n as f64 + 0.5) * step;
            stepper.advance(&mut state, driven(3.0 * (TAU * 5.0 * time).sin()));
            if (n + 1) % (0.01 / step).round() as usize == 0 {
                angles.push(state.angle);
            }
        }
        angles
    };
    let (fine, usual) = (end(5e-6), end(1e-4));
    let worst = fine.iter().zip(&usual).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 3e-3, "{worst} rad");
    let swing = fine.iter().fold(0.0f64, |most, angle| most.max(angle.abs()));
    assert!(swing > 0.5, "{swing} rad");
}

#[test]
fn springs_in_a_row_give_way_together() {
    let laws = Laws { backlash: Some(PLAY), ..spring(SPRING) };
    let both = laws.coupling().unwrap();
    assert_eq!((both.half_gap, both.load_share), (0.05, 0.3));
    assert!(apart(1.0 / both.stiffness, 1.0 / 4e-3 + 1.0 / 2.0) < 1e-12);
    // The third order of a torque through both: φ₁(T) = T/k₁ − β T³/k₁³ of the one that hardens, T/k₂ of the other.
    let law = ShaftCompliance { hardening_per_rad2: 5.0, ..SPRING };
    let both = Laws { backlash: Some(PLAY), ..spring(law) }.coupling().unwrap();
    let torque = 1e-5f64;
    let twist = torque / 4e-3 + torque / 2.0 - 5.0 * (torque / 4e-3).powi(3);
    let carried = both.stiffness * twist * (1.0 + both.hardening * twist * twist);
    assert!(apart(carried, torque) < 1e-8, "{carried} N·m");
}
