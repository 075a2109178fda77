//! Blocks that slide, stay, and tip.

use crate::common::body::{G, STILL, alone, block, run, velocity};
use effects::{FootAnisotropy, FootLoadFriction, FootStribeck};
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::plan::Contact;
use hal_sim::body::{Ensemble, Plan};

const MU: f64 = 0.3;
const STEP: f64 = 1e-4;

/// A block of which the ground is changed, its centre of mass so low that braking hardly shifts its load.
fn low(change: impl FnOnce(&mut Contact)) -> Plan {
    let mut plan = block(0.0021);
    let contact = plan.contact.as_mut().unwrap();
    (contact.friction, contact.normal_damping) = (MU, 50.0);
    change(contact);
    plan
}

/// Settled for half a second and then pushed off.
fn launched(plan: &Plan, velocity: [f64; 3]) -> Ensemble {
    let mut body = alone(plan, STEP);
    run(&mut body, 0.5, STILL);
    let start = Coordinates { velocity, ..body.coordinates(0) };
    body.put(0, &start);
    body
}

/// Mean deceleration between 10 ms, when the feet's rubber is sheared, and 40 ms, over g.
fn deceleration(plan: &Plan, direction: [f64; 2]) -> f64 {
    let mut body = launched(plan, [0.3 * direction[0], 0.3 * direction[1], 0.0]);
    let along = |body: &Ensemble| velocity(body, 0)[0] * direction[0] + velocity(body, 0)[1] * direction[1];
    run(&mut body, 0.01, STILL);
    let first = along(&body);
    run(&mut body, 0.03, STILL);
    (first - along(&body)) / 0.03 / G
}

#[test]
fn a_block_stops_after_the_square_of_its_speed_over_2_mu_g() {
    for direction in [[1.0, 0.0], [0.0, 1.0], [-0.6, 0.8]] {
        let plan = low(|_| ());
        let found = deceleration(&plan, direction);
        // What braking shifts of the load, and the block's bounce on its feet.
        assert!((found / MU - 1.0).abs() < 1e-3, "{direction:?}: decelerates by {found} g, friction {MU}");
        let speed = 0.3;
        let mut body = launched(&plan, [speed * direction[0], speed * direction[1], 0.0]);
        let start = body.snapshot(0).centroid();
        run(&mut body, 0.3, STILL);
        let end = body.snapshot(0).centroid();
        let (dx, dy) = (end[0] - start[0], end[1] - start[1]);
        let (path, expected) = (dx.hypot(dy), speed * speed / (2.0 * MU * G));
        println!(
            "{direction:.1?}: {found:.5} g, stops after {:.4} mm, closed form {:.4} mm",
            1e3 * path,
            1e3 * expected
        );
        // The rubber's shear under friction, a fraction of a micrometre, while it is built up and at the end, and 1e-3 as above.
        assert!(
            (path - expected).abs() < 3e-6 + 1e-3 * expected,
            "{direction:?}: stops after {path} m, not {expected}"
        );
        let aside = (dx * direction[1] - dy * direction[0]).abs();
        assert!(aside < 1e-2 * path, "{direction:?}: slides {aside} m aside");
        let left = velocity(&body, 0);
        assert!(left[0].hypot(left[1]) < 1e-6, "still moves at {left:?} m/s");
    }
}

#[test]
fn friction_across_the_feet_is_a_share_of_that_along() {
    let plan = low(|contact| contact.laws.foot_anisotropy = Some(FootAnisotropy { lateral_share: 0.5 }));
    for (direction, share) in [([1.0, 0.0], 1.0), ([0.0, 1.0], 0.5), ([0.0, -1.0], 0.5)] {
        let found = deceleration(&plan, direction);
        println!("{direction:?}: {found:.5} g, friction {:.5}", share * MU);
        assert!((found / (share * MU) - 1.0).abs() < 2e-3, "{direction:?}: {found} g, friction {}", share * MU);
    }
}

#[test]
fn each_foot_has_its_own_friction() {
    let shared = |shares: [f64; 2]| {
        let mut plan = low(|_| ());
        plan.modules.iter_mut().for_each(|module| module.friction_shares = shares);
        plan
    };
    for shares in [[0.5, 0.5], [0.4, 1.0], [1.0, 0.4]] {
        let plan = shared(shares);
        let (found, expected) = (deceleration(&plan, [1.0, 0.0]), 0.5 * MU * (shares[0] + shares[1]));
        let turned = {
            let mut body = launched(&plan, [0.3, 0.0, 0.0]);
            run(&mut body, 0.02, STILL);
            body.coordinates(0).angular_velocity[2]
        };
        println!("{shares:?}: decelerates by {found:.5} g, {expected:.5} expected, turns at {turned:.3} rad/s");
        // A block that turns slides aside a little.
        assert!((found / expected - 1.0).abs() < 2e-2, "{shares:?}: {found} g, expected {expected}");
        // It swings round to the side that grips more: to its left, counter-clockwise, where the left foot does.
        let swings = shares[0] - shares[1];
        assert!(if swings == 0.0 { turned.abs() < 1e-9 } else { turned * swings > 0.1 }, "{shares:?}: {turned} rad/s");
    }
}

#[test]
fn friction_falls_with_speed_as_stribeck_says() {
    let (excess, stribeck) = (0.5, 0.1);
    let plan = low(|contact| {
        contact.laws.foot_stribeck = Some(FootStribeck { excess_share: excess, speed_m_per_s: stribeck });
    });
    let mut body = launched(&plan, [0.3, 0.0, 0.0]);
    run(&mut body, 0.01, STILL);
    // dv/dt = −µ g (1 + excess·exp(−(v/v_s)²)), by midpoint steps of 10 µs, while the block slides.
    let mut expected = velocity(&body, 0)[0];
    let falls = |speed: f64| MU * G * (1.0 + excess * (-(speed / stribeck).powi(2)).exp());
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        run(&mut body, 0.005, STILL);
        for _ in 0..500 {
            let middle = expected - 0.5e-5 * falls(expected);
            expected -= 1e-5 * falls(middle);
        }
        if expected < 0.02 {
            break;
        }
        worst = worst.max((velocity(&body, 0)[0] - expected).abs());
    }
    println!("Stribeck: {worst:.1e} m/s off down to {expected:.4} m/s");
    assert!(expected < 0.02, "the case does not reach the slow speeds: {expected} m/s");
    // 1e-4 of the 0.27 m/s that are lost.
    assert!(worst < 3e-5, "{worst} m/s off");
}

#[test]
fn friction_falls_with_load() {
    let (exponent, nominal) = (0.2, 0.01);
    let plan = low(|contact| {
        contact.laws.foot_load_friction = Some(FootLoadFriction { exponent, load_n: nominal });
    });
    let load = plan.mass() * G / 4.0;
    let expected = MU * (load / nominal).powf(-exponent);
    let found = deceleration(&plan, [1.0, 0.0]);
    println!("load {load:.4} N, nominal {nominal} N: {found:.5} g, law {expected:.5}");
    assert!((expected / MU - 1.0).abs() > 0.1, "the case does not show the law");
    assert!((found / expected - 1.0).abs() < 3e-3, "{found} g, the law says {expected}");
}

/// Leaning by an angle in a direction, rad.
fn leaning(plan: &Plan, angle: f64, direction: f64) -> Plan {
    let down = G * angle.sin();
    Plan { gravity: [down * direction.cos(), down * direction.sin(), -G * angle.cos()], ..plan.clone() }
}

#[test]
fn on_a_slope_it_stays_below_the_angle_of_friction_and_slides_above() {
    for direction in [0.0_f64, 1.0, std::f64::consts::FRAC_PI_2, 4.0] {
        let below = leaning(&low(|_| ()), 0.95 * MU.atan(), direction);
        let mut body = alone(&below, STEP);
        run(&mut body, 1.0, STILL);
        let before = body.snapshot(0).centroid();
        run(&mut body, 1.0, STILL);
        let after = body.snapshot(0).centroid();
        let crept = (after[0] - before[0]).hypot(after[1] - before[1]);
        assert!(
            crept < 1e-9,
            "creeps by {crept:e} m in a second at 95 % of the angle of friction, direction {direction}"
        );

        let angle = 1.2 * MU.atan();
        let mut body = alone(&leaning(&low(|_| ()), angle, direction), STEP);
        run(&mut body, 0.1, STILL);
        let first = velocity(&body, 0);
        run(&mut body, 0.4, STILL);
        let second = velocity(&body, 0);
        let found = (second[0] - first[0]).hypot(second[1] - first[1]) / 0.4;
        let expected = G * (angle.sin() - MU * angle.cos());
        println!(
            "direction {direction:.2}: creeps {crept:.0e} m; slides at {found:.5} m/s², closed form {expected:.5}"
        );
        assert!((found / expected - 1.0).abs() < 2e-3, "slides at {found} m/s², closed form {expected}");
    }
}

#[test]
fn a_tall_block_tips_where_its_weight_passes_its_feet() {
    // On a slope across: tan of the angle is half the track over the height of the centre of mass.
    let height = 0.016;
    let mut plan = block(height);
    let contact = plan.contact.as_mut().unwrap();
    // Hard and overdamped: it neither sinks to one side nor rocks.
    (contact.friction, contact.normal_stiffness, contact.normal_damping) = (5.0, 2e4, 1000.0);
    let half_track = plan.modules[0].feet[0][1];
    let tips = (half_track / height).atan();
    for (share, falls) in [(0.99, false), (1.01, true)] {
        // The weight leans to −y: the feet to the left, at +y, lift.
        let mut body = alone(&leaning(&plan, share * tips, -std::f64::consts::FRAC_PI_2), 5e-5);
        run(&mut body, 1.0, STILL);
        let end = body.snapshot(0);
        let uphill: f64 = end.feet.iter().step_by(2).map(|foot| foot.force[2]).sum();
        let roll = 2.0 * end.modules[0].orientation[1].atan2(end.modules[0].orientation[0]);
        let carried = uphill / plan.mass() / G;
        println!(
            "{share} of {:.2}°: roll {roll:.4} rad, uphill feet carry {carried:.4} of the weight",
            tips.to_degrees()
        );
        if falls {
            assert!(roll > 0.5, "does not tip at 1 % above {tips} rad: roll {roll}");
        } else {
            assert!(roll.abs() < 0.01 && uphill > 0.0, "tips at 1 % below {tips} rad: roll {roll}, uphill {uphill} N");
            // Moments about the downhill feet.
            let angle = share * tips;
            let expected = 0.5 * (angle.cos() - height / half_track * angle.sin());
            assert!((carried - expected).abs() < 1e-3, "uphill feet carry {carried}, the moments say {expected}");
        }
    }
}
