//! The energy book: electrical in = kinetic + winding + bridge + viscous + friction + gravity.

use crate::common::{FULL, coulomb, driven};
use hal_sim::shaft::{Shaft, ShaftState, Terminals};

struct Book {
    electrical: f64,
    /// Drift: what is missing at the end, J.
    missing: f64,
}

/// A quarter of a second of driving forward and back and a coast, booked at a step (s).
fn book(shaft: &Shaft, step: f64) -> Book {
    let stepper = shaft.stepper(step);
    let mut state = ShaftState::default();
    let (mut electrical, mut lost) = (0.0, 0.0);
    let potential = |angle: f64| {
        shaft.laws.gravity_tilt.map_or(0.0, |gravity| -gravity.torque_nm * (angle - gravity.direction_rad).cos())
    };
    let stored = |state: &ShaftState| {
        0.5 * shaft.inertia_kg_m2 * state.speed * state.speed
            + 0.5 * shaft.inductance_h * state.current * state.current
            + potential(state.angle)
    };
    let before = stored(&state);
    let steps = (0.25 / step).round() as usize;
    for n in 0..steps {
        // Smooth, so that the order of the rule shows.
        let time = n as f64 * step;
        let terminals = if time < 0.2 { driven(5.0 * (40.0 * time).sin()) } else { Terminals::Open };
        let before_opening = state.current;
        let means = stepper.advance(&mut state, terminals);
        if let Terminals::Driven { voltage } = terminals {
            electrical += voltage * means.current * step;
            let drop = shaft.laws.bridge();
            let bridge = drop.drop_v * means.current.abs() + drop.slope_ohm * means.current.powi(2);
            lost += (shaft.resistance_ohm * means.current.powi(2) + bridge) * step;
        } else {
            // The diodes take what the winding had stored.
            lost += 0.5 * shaft.inductance_h * before_opening * before_opening;
        }
        lost += (shaft.viscous * means.speed + means.friction_nm) * means.speed * step;
    }
    Book { electrical, missing: electrical - lost - (stored(&state) - before) }
}

#[test]
fn the_book_closes_and_closes_better_with_finer_steps() {
    let drift = |step| {
        let book = book(&FULL, step);
        (book.missing / book.electrical).abs()
    };
    let (coarse, usual, fine) = (drift(1e-3), drift(1e-4), drift(1e-5));
    println!("energy drift / electrical energy: {coarse:.1e} at 1 ms, {usual:.1e} at 0.1 ms, {fine:.1e} at 10 µs");
    assert!(usual < 1e-4, "{usual}");
    assert!(fine < 0.15 * usual, "{fine} after {usual}");
}

#[test]
fn the_bristle_never_gives_more_than_it_got() {
    let stepper = Shaft { laws: coulomb(2e-3, 3e-3), ..FULL }.stepper(1e-4);
    let mut state = ShaftState::default();
    let mut taken = 0.0;
    for n in 0..20_000 {
        // Around the level: stuck, ringing and sliding in turn.
        let means = stepper.advance(&mut state, driven(5.0 * (0.003 * f64::from(n)).sin()));
        taken += means.friction_nm * means.speed * 1e-4;
        assert!(taken > -1e-12, "{taken} J after {n} steps");
    }
    assert!(state.angle.abs() > 1e-3 && taken > 1e-4, "{taken} J");
}
