//! Feet on the ground: how they stand, land and lift, and that steps do not spoil it.

use std::f64::consts::TAU;

use crate::common::body::{G, STILL, alone, block, brief, difference, from, norm, robot, run, settings, velocity};
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::{Drive, Ensemble, Plan};

/// As the reference drives its eccentric.
fn servo(hertz: f64) -> Drive {
    Drive::Servo { speed: TAU * hertz, stiffness: 0.08, damping: 2.5e-4 }
}

#[test]
fn a_resting_foot_stands_as_deep_as_its_load_over_the_stiffness() {
    let plan = block(0.016);
    let contact = plan.contact.as_ref().unwrap();
    let mut body = alone(&plan, 1e-4);
    run(&mut body, 5.0, STILL);
    let load = plan.mass() * G / 4.0;
    for (index, foot) in body.snapshot(0).feet.iter().enumerate() {
        let depth = contact.foot_radius - foot.position[2];
        let expected = load / contact.normal_stiffness;
        // The backbone's 0.1 mg stand to the front, and it bends by nanometres.
        assert!(
            (depth / expected - 1.0).abs() < 1e-4,
            "foot {index} stands {depth:e} m deep, weight over k {expected:e} m"
        );
        assert!((foot.force[2] / load - 1.0).abs() < 1e-4, "foot {index} bears {} N of {load} N", foot.force[2]);
    }
}

/// By Hertz: `F = k δ √(δ/δ₀)`; half a sphere carries half like it, half like a stamp.
#[test]
fn a_resting_sphere_stands_as_deep_as_hertz_says() {
    let id = effects::Id::of("foot_hertz_contact").unwrap();
    for share in [1.0, 0.5] {
        let mut plan = block(0.016);
        let load = plan.mass() * G / 4.0;
        // A sphere of that curvature stands less deep than the stamp does.
        let nominal = 0.2 * load;
        let contact = plan.contact.as_mut().unwrap();
        id.put(&mut contact.laws, Some(&[share, nominal]));
        let k = contact.normal_stiffness;
        let radius = contact.foot_radius;
        let mut body = alone(&plan, 1e-4);
        run(&mut body, 5.0, STILL);
        for (index, foot) in body.snapshot(0).feet.iter().enumerate() {
            let depth = radius - foot.position[2];
            let carried = k * depth * (1.0 - share + share * (depth * k / nominal).sqrt());
            let linear = k * depth;
            assert!(
                (carried / load - 1.0).abs() < 1e-3,
                "foot {index} stands {depth:e} m deep, {carried} N of {load} N"
            );
            assert!((linear / load - 1.0).abs() > 0.1, "foot {index} does not stand like a stamp");
        }
    }
}

#[test]
fn the_whole_robot_stands_on_what_it_weighs() {
    for alpha in [0.0, 60.0, 120.0] {
        let plan = robot(4, alpha);
        let mut body = alone(&plan, 1e-4);
        run(&mut body, 4.0, STILL);
        let end = body.snapshot(0);
        let borne: f64 = end.feet.iter().map(|foot| foot.force[2]).sum();
        let apart = borne / (plan.mass() * G) - 1.0;
        println!("α {alpha}°: feet bear {borne:.6} N, {apart:.1e} more than the weight");
        assert!(apart.abs() < 1e-5, "α {alpha}°: the feet bear {borne} N, {apart:e} more than the weight");
        let sideways = end.feet.iter().fold([0.0; 2], |sum, foot| [sum[0] + foot.force[0], sum[1] + foot.force[1]]);
        assert!(
            sideways[0].hypot(sideways[1]) < 1e-5 * borne,
            "α {alpha}°: the ground pushes sideways by {sideways:?} N"
        );
    }
}

/// Share of its speed with which a block leaves the ground again, without weight.
fn restitution(damping: f64, speed: f64, step: f64) -> f64 {
    let mut plan = Plan { gravity: [0.0; 3], ..block(0.016) };
    plan.contact.as_mut().unwrap().normal_damping = damping;
    let nominal = Coordinates::nominal(&plan);
    let position = [nominal.position[0], nominal.position[1], nominal.position[2] + 1e-4];
    let mut body = from(&plan, &Coordinates { position, velocity: [0.0, 0.0, -speed], ..nominal }, step);
    run(&mut body, 0.1, STILL);
    assert!(body.snapshot(0).feet.iter().all(|foot| !foot.touches()), "still on the ground");
    velocity(&body, 0)[2] / speed
}

#[test]
fn restitution_is_hunt_and_crossleys() {
    let speed = 0.1_f64;
    let mut last = 1.1;
    for damping in [0.0_f64, 2.0, 8.0, 50.0] {
        // m v dv/dδ = −k δ (1 + χ v) has the integral u − ln(1 + u), u = χ v, the same on the way in and out.
        let into = damping * speed;
        let level = into - (1.0 + into).ln();
        let (mut low, mut high) = (0.0_f64, into.min(1.0 - 1e-12));
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if -middle - (1.0 - middle).ln() < level { low = middle } else { high = middle }
        }
        let expected = if damping > 0.0 { low / into } else { 1.0 };
        let [coarse, fine] = [1e-4, 2.5e-5].map(|step| (restitution(damping, speed, step) - expected).abs());
        println!("χ {damping} s/m: closed form {expected:.5}, {coarse:.1e} off at 1e-4 s, {fine:.1e} at 2.5e-5 s");
        // Touching lasts 6 ms, 60 steps; where it begins and ends within a step, the force has a kink.
        assert!(coarse < 5e-3, "χ {damping}: {coarse} off {expected} at 1e-4 s");
        assert!(fine < 5e-4, "χ {damping}: {fine} off {expected} at 2.5e-5 s");
        assert!(expected < last, "χ {damping}: {expected} after {last}");
        last = expected;
    }
}

#[test]
fn the_ground_never_pulls_and_never_grips_beyond_friction() {
    for (alpha, hertz) in [(60.0, 8.0), (90.0, -7.0)] {
        let plan = robot(4, alpha);
        let friction = plan.contact.as_ref().unwrap().friction;
        let mut body = alone(&plan, 1e-4);
        let (mut landings, mut touched) = (0, vec![true; 8]);
        for step in 0..10_000 {
            body.advance(1, &[servo(hertz)]);
            for (index, foot) in body.snapshot(0).feet.iter().enumerate() {
                let [x, y, z] = foot.force;
                assert!(z >= 0.0, "foot {index} is pulled by {z} N in step {step}");
                assert!(
                    x.hypot(y) <= friction * z * (1.0 + 1e-9) + 1e-15,
                    "foot {index} grips by {:e} N under {z:e} N",
                    x.hypot(y)
                );
                landings += usize::from(foot.touches() && !touched[index]);
                touched[index] = foot.touches();
            }
        }
        println!("α {alpha}°, {hertz} Hz: {landings} landings");
        assert!(landings > 5, "the case has {landings} landings only");
    }
}

#[test]
fn forces_have_no_jumps() {
    // The largest change within a step falls as the step does, to a quarter, where a jump would stay. On a contact softer
    // than the file's: its forces change slowly, so that a small jump would show.
    let mut plan = robot(4, 90.0);
    let contact = plan.contact.as_mut().unwrap();
    (contact.normal_stiffness, contact.normal_damping) = (720.0, 8.0);
    (contact.shear_stiffness, contact.shear_damping) = (12_000.0, 3.0);
    let weight = plan.mass() * G;
    let largest = |step: f64| {
        let mut body = alone(&plan, step);
        let mut last: Option<Vec<[f64; 3]>> = None;
        let mut largest = 0.0_f64;
        for _ in 0..(0.5 / step) as usize {
            body.advance(1, &[servo(8.0)]);
            let forces: Vec<_> = body.snapshot(0).feet.iter().map(|foot| foot.force).collect();
            if let Some(last) = &last {
                let change = forces.iter().zip(last).map(|(a, b)| norm(difference(*a, *b)));
                largest = change.fold(largest, f64::max);
            }
            last = Some(forces);
        }
        largest
    };
    let changes = [1e-4, 2.5e-5, 6.25e-6].map(|step| largest(step) / weight);
    let figures = brief(&changes);
    println!("largest change of a foot's force in a step, over the weight: {figures} at 1e-4, 2.5e-5 and 6.25e-6 s");
    assert!(changes[1] < 0.4 * changes[0] && changes[2] < 0.4 * changes[1], "{figures} of the weight");
    assert!(changes[2] < 0.05, "{figures} of the weight");
}

#[test]
fn a_foot_on_a_step_stands_at_its_height() {
    let (edge, height) = (-0.02, 0.002);
    let mut plan = block(0.016);
    plan.contact.as_mut().unwrap().steps = vec![[edge, height]];
    // The front module stands at x = 0, the rear one at −40 mm: dropped level from above the step.
    let nominal = Coordinates::nominal(&plan);
    let position = [nominal.position[0], nominal.position[1], nominal.position[2] + height + 1e-3];
    let mut body = from(&plan, &Coordinates { position, ..nominal }, 1e-4);
    run(&mut body, 5.0, STILL);
    let contact = plan.contact.as_ref().unwrap();
    let end = body.snapshot(0);
    for (index, foot) in end.feet.iter().enumerate() {
        let ground = if index < 2 { height } else { 0.0 };
        let depth = ground + contact.foot_radius - foot.position[2];
        let expected = foot.force[2] / contact.normal_stiffness;
        println!("foot {index}: {:.4} mm over its ground, bears {:.4} N", -1e3 * depth, foot.force[2]);
        assert!(foot.force[2] > 0.0, "foot {index} hangs in the air");
        assert!((depth - expected).abs() < 1e-7, "foot {index} stands {depth:e} m deep, load over k {expected:e} m");
    }
    let borne: f64 = end.feet.iter().map(|foot| foot.force[2]).sum();
    assert!((borne / (plan.mass() * G) - 1.0).abs() < 1e-4, "the feet bear {borne} N");
}

#[test]
fn a_patch_has_its_own_friction() {
    let mut plan = block(0.0021);
    let contact = plan.contact.as_mut().unwrap();
    (contact.friction, contact.normal_damping) = (0.3, 50.0);
    // Half the friction from x = 0.1 m on.
    contact.patches = vec![[0.1, 0.5]];
    for (x, expected) in [(0.0, 0.3), (0.2, 0.15)] {
        let mut body = alone(&plan, 1e-4);
        let nominal = body.coordinates(0);
        body.put(
            0,
            &Coordinates { position: [nominal.position[0] + x, nominal.position[1], nominal.position[2]], ..nominal },
        );
        run(&mut body, 0.5, STILL);
        let settled = body.coordinates(0);
        body.put(0, &Coordinates { velocity: [0.2, 0.0, 0.0], ..settled });
        run(&mut body, 0.01, STILL);
        let first = velocity(&body, 0)[0];
        run(&mut body, 0.03, STILL);
        let found = (first - velocity(&body, 0)[0]) / 0.03 / G;
        assert!((found / expected - 1.0).abs() < 2e-3, "at x = {x} m it brakes by {found} g, friction {expected}");
    }
}

#[test]
fn the_walk_converges_better_than_first_order() {
    let (alphas, hertz): (Vec<f64>, Vec<f64>) =
        [0.0, 60.0, 90.0, 120.0].into_iter().flat_map(|alpha| [-8.0, 6.0, 7.0].map(|f| (alpha, f))).unzip();
    let plans: Vec<_> = alphas.iter().map(|alpha| robot(4, *alpha)).collect();
    let drives: Vec<_> = hertz.iter().map(|f| servo(*f)).collect();
    let end = |step: f64| -> Vec<[f64; 3]> {
        let mut bodies = Ensemble::new(&plans, settings(step)).unwrap();
        bodies.advance((0.3 / step).round() as usize, &drives);
        (0..plans.len()).map(|i| bodies.snapshot(i).centroid()).collect()
    };
    let exact = end(3.125e-6);
    let steps = [2e-4, 1e-4, 5e-5, 2.5e-5];
    let errors = steps.map(|step| {
        let squares: f64 = end(step).iter().zip(&exact).map(|(a, b)| norm(difference(*a, *b)).powi(2)).sum();
        (squares / exact.len() as f64).sqrt()
    });
    // Least squares of log error over log step.
    let points: Vec<_> = steps.iter().zip(&errors).map(|(h, e)| (h.ln(), e.ln())).collect();
    let mean = |read: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(read).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let order = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
    let figures = brief(&errors);
    println!("12 walks of 0.3 s: at {} s the centroids are {figures} m off, order {order:.2}", brief(&steps));
    assert!(order > 1.25, "order {order:.2}: {figures} m");
    // A walk of 0.3 s is some 3 mm long.
    assert!(errors[1] < 5e-5, "{:e} m off at 1e-4 s", errors[1]);
}
