//! A module on a backbone, clamped at its other end, against linear theory and the reference's figures.

use std::f64::consts::TAU;

use crate::common::body::{G, STILL, alone, apart_percent, bench, damped, frequency_and_decrement, from, orders, rest};
use hal_sim::body::Plan;
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::skeleton::Skeleton;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Frequency and decrement of the free oscillation about an axis (0: x, 1: y, 2: z) from a shape, over five maxima.
fn oscillation(plan: &Plan, shape: &[f64], axis: usize, step: f64, time: f64) -> (f64, f64) {
    let mut start = Coordinates::nominal(plan);
    for (angles, value) in start.angles.iter_mut().zip(shape) {
        angles[axis] = *value;
    }
    let mut body = from(plan, &start, step);
    let weigh = |body: &hal_sim::body::Ensemble| -> f64 {
        body.coordinates(0).angles.iter().zip(shape).map(|(angles, weight)| angles[axis] * weight).sum()
    };
    let signal: Vec<_> = (0..(time / step) as usize)
        .map(|_| {
            body.advance(1, &[STILL]);
            weigh(&body)
        })
        .collect();
    frequency_and_decrement(&signal, step, 5)
}

#[test]
fn the_free_oscillation_is_the_references() {
    // MuJoCo 4.0.0 at a step of 1e-5 s on the same model, which agrees with the linear eigenvalues.
    let reference = [(7.9092, 0.5240), (9.0571, 0.4492), (5.3987, 0.3205)];
    for (axis, (frequency, decrement)) in reference.into_iter().enumerate() {
        let plan = bench();
        let shape = [[0.02, 0.01, 0.01][axis]; 10];
        let found = oscillation(&plan, &shape, axis, 1e-4, 1.0);
        let apart = (apart_percent(found.0, frequency), apart_percent(found.1, decrement));
        println!("axis {axis}: {:.4} Hz ({:+.3} %), decrement {:.4} ({:+.2} %)", found.0, apart.0, found.1, apart.1);
        assert!(apart.0.abs() < 0.2, "axis {axis}: {} Hz, the reference's {frequency}", found.0);
        assert!(apart.1.abs() < 2.0, "axis {axis}: decrement {}, the reference's {decrement}", found.1);
    }
}

/// Mass matrix of the hinges about one axis in the straight chain. The kinetic energy is a square form of the rates.
fn mass_matrix(plan: &Plan, axis: usize) -> DMatrix<f64> {
    let skeleton = Skeleton::new(plan);
    let kinetic = |joints: &[usize]| {
        let mut at = Coordinates::nominal(plan);
        joints.iter().for_each(|joint| at.rates[*joint][axis] += 1.0);
        at.balance(plan, &skeleton).kinetic
    };
    DMatrix::from_fn(plan.joints(), plan.joints(), |i, j| kinetic(&[i, j]) - kinetic(&[i]) - kinetic(&[j]))
}

/// Natural frequencies without damping (rad/s, rising) and shapes.
fn modes(plan: &Plan, axis: usize) -> Vec<(f64, DVector<f64>)> {
    let lower = Cholesky::new(mass_matrix(plan, axis)).unwrap().l().try_inverse().unwrap();
    let stiffness = plan.backbones[0].stiffness[axis];
    let eigen = (&lower * lower.transpose() * stiffness).symmetric_eigen();
    let mut modes: Vec<_> = (0..plan.joints())
        .map(|k| {
            let shape = lower.transpose() * eigen.eigenvectors.column(k);
            (eigen.eigenvalues[k].sqrt(), shape.normalize())
        })
        .collect();
    modes.sort_by(|a, b| a.0.total_cmp(&b.0));
    modes
}

#[test]
fn modes_swing_at_the_eigenvalues_of_the_linear_chain() {
    // The axes do not mix in the straight chain, and each axis's damping is a share of its stiffness: every mode swings
    // by itself, with the damping ratio ½·(d/k)·ω.
    let errors = |axis: usize, mode: usize, plan: &Plan, step: f64, time: f64| {
        let (natural, shape) = modes(plan, axis)[mode].clone();
        let backbone = &plan.backbones[0];
        let ratio = 0.5 * backbone.damping[axis] / backbone.stiffness[axis] * natural;
        let share = (1.0 - ratio * ratio).sqrt();
        let (frequency, decrement) = (natural * share / TAU, TAU * ratio / share);
        // So small that the swing is linear: a thousandth of a radian in all.
        let shape: Vec<_> = shape.iter().map(|x| 3e-4 * x).collect();
        let found = oscillation(plan, &shape, axis, step, time);
        let apart = [apart_percent(found.0, frequency), apart_percent(found.1, decrement)];
        println!(
            "axis {axis}, mode {mode}, {step:.0e} s: {frequency:.4} Hz {:+.4} %, decrement {decrement:.4} {:+.3} %",
            apart[0], apart[1]
        );
        apart
    };
    for axis in 0..3 {
        let plan = bench();
        let steps = [2e-4, 1e-4, 5e-5].map(|step| errors(axis, 0, &plan, step, 1.0));
        // (ωh)²/24 of a leapfrog at 9 Hz is 1e-6.
        assert!(steps[1][0].abs() < 0.003, "axis {axis}: {} % in frequency at 1e-4 s", steps[1][0]);
        assert!(steps[1][1].abs() < 0.01, "axis {axis}: {} % in decrement at 1e-4 s", steps[1][1]);
        let orders = orders(&steps.map(|step| step[0].abs()));
        assert!(orders.iter().all(|order| *order > 1.8), "axis {axis}: the frequency's orders {orders:.2?}");
    }
    // The second mode of bending, in which the tip rocks, with a tenth of the damping so that it swings at all.
    for axis in [1, 2] {
        let [frequency, decrement] = errors(axis, 1, &damped(bench(), 0.1), 2e-5, 0.2);
        assert!(frequency.abs() < 0.03, "axis {axis}: {frequency} % in the second frequency");
        assert!(decrement.abs() < 0.03, "axis {axis}: {decrement} % in the second decrement");
    }
}

/// Sag of the tip module's centre at rest, m, and its small-angle form `Σ M_i/k·l_i`.
fn sag(axis: usize, gravity: f64) -> (f64, f64) {
    let mut plan = damped(bench(), 10.0);
    plan.gravity = [[0.0; 3], [0.0, 0.0, -gravity], [0.0, -gravity, 0.0]][axis];
    let (backbone, tip) = (plan.backbones[0], plan.modules[1]);
    let length = backbone.length / backbone.segments as f64;
    // Distances from the clamp, of the masses and of the tip module's centre.
    let end = backbone.length + 0.5 * tip.size[0];
    let mut masses: Vec<_> =
        (0..backbone.segments).map(|i| (backbone.segment_mass, (i as f64 + 0.5) * length)).collect();
    masses.push((tip.mass, end));
    let turned = |i: usize| {
        let hinge = i as f64 * length;
        let beyond = masses.iter().filter(|(_, x)| *x > hinge);
        let moment: f64 = beyond.map(|(mass, x)| mass * gravity * (x - hinge)).sum();
        moment / backbone.stiffness[axis] * (end - hinge)
    };
    let expected = (0..backbone.segments).map(turned).sum();
    let before = alone(&plan, 1e-4).snapshot(0).modules[1].position;
    let after = rest(&plan, 1e-4).snapshot(0).modules[1].position;
    let down = [0, 2, 1][axis];
    (before[down] - after[down], expected)
}

#[test]
fn the_tip_sags_as_moments_over_stiffness_say() {
    for axis in [1, 2] {
        let [small, large] = [0.03 * G, 0.3 * G].map(|gravity| {
            let (found, expected) = sag(axis, gravity);
            println!(
                "axis {axis}, {gravity:.3} m/s²: sag {:.5} mm, small angles {:.5} mm",
                1e3 * found,
                1e3 * expected
            );
            1.0 - found / expected
        });
        // What is left is of second order in the slope, a hundred times less at a tenth of the weight, and then of fourth.
        assert!(small > 0.0 && large < 1e-2, "axis {axis}: {small} and {large} apart");
        let ratio = large / small;
        assert!(
            (ratio / 100.0 - 1.0).abs() < 0.05,
            "axis {axis}: {large} at a weight, {small} at a tenth of it: {ratio} times"
        );
    }
}
