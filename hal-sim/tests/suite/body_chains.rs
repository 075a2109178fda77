//! Chains of any length, cut into any number of segments, held anywhere, rolled any way.

use std::f64::consts::TAU;

use crate::common::body::{
    alone, damped, difference, in_space, mirrored, norm, rest, robot, run, segmented, settings, uneven,
};
use crate::common::default_robot;
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::{Drive, Ensemble, Plan, Snapshot, Track};

fn servo(hertz: f64) -> Drive {
    Drive::Servo { speed: TAU * hertz, stiffness: 0.08, damping: 2.5e-4 }
}

fn ended(plan: &Plan, hertz: f64, time_s: f64) -> Snapshot {
    let mut body = alone(plan, 1e-4);
    run(&mut body, time_s, servo(hertz));
    body.snapshot(0)
}

#[test]
fn a_chain_has_its_parts_mass_and_pose() {
    let file = default_robot();
    let (body, backbone, feet) =
        (file.body.as_ref().unwrap(), file.backbone.as_ref().unwrap(), file.feet.as_ref().unwrap());
    let pitch = body.passive.length_m.value + backbone.length_m.value;
    let height = feet.leg_m.value + 0.5 * body.passive.height_m.value;
    for modules in [2, 3, 5, 8] {
        for segments in [1, 7, 10] {
            let name = format!("{modules} modules, {segments} segments");
            let plan = segmented(robot(modules, 60.0), segments);
            let mass = body.actuator.mass_kg.value
                + body.courier.mass_kg.value
                + (modules - 2) as f64 * body.passive.mass_kg.value
                + (modules - 1) as f64 * backbone.segments.value * backbone.segment_mass_kg.value
                + file.eccentric.as_ref().unwrap().mass_kg.value;
            assert!((plan.mass() - mass).abs() < 1e-12, "{name}: {} kg, parts {mass} kg", plan.mass());
            assert_eq!(plan.degrees_of_freedom(), 6 + 3 * segments * (modules - 1) + 1, "{name}");
            let mut moving = alone(&plan, 1e-4);
            let start = moving.snapshot(0);
            assert_eq!(
                (start.modules.len(), start.segments.len(), start.feet.len()),
                (modules, segments * (modules - 1), 2 * modules)
            );
            for (k, pose) in start.modules.iter().enumerate() {
                let off = norm(difference(pose.position, [-pitch * k as f64, 0.0, height]));
                assert!(off < 1e-12, "{name}: module {k} stands {off} m off");
                assert!((pose.orientation[0] - 1.0).abs() < 1e-12, "{name}: module {k} is turned");
            }
            for (k, foot) in start.feet.iter().enumerate() {
                assert!(
                    (foot.position[2] - feet.radius_m.value).abs() < 1e-12,
                    "{name}: foot {k} at height {}",
                    foot.position[2]
                );
            }
            // What the bodies' motion tells of the mass: the momentum of a robot that moves as a whole.
            let nominal = Coordinates::nominal(&plan);
            moving.put(0, &Coordinates { velocity: [1.0, 0.0, 0.0], ..nominal });
            let balance = moving.balance(0);
            assert!(
                (balance.momentum[0] / mass - 1.0).abs() < 1e-12,
                "{name}: momentum {:?} at 1 m/s",
                balance.momentum
            );
            assert!((balance.kinetic / mass - 0.5).abs() < 1e-12, "{name}: {} J at 1 m/s", balance.kinetic);
        }
    }
}

#[test]
fn a_shaken_chain_keeps_its_momentum() {
    // A shaken robot in space: the common centre of mass rests, whatever the lengths of the arms.
    for (modules, segments) in [(2, 1), (2, 10), (3, 7), (5, 10), (8, 7)] {
        let plan = in_space(segmented(robot(modules, 60.0), segments));
        let mut body = alone(&plan, 1e-4);
        run(&mut body, 1e-4, servo(7.0));
        let before = body.balance(0).momentum;
        run(&mut body, 0.3, servo(7.0));
        let after = body.balance(0).momentum;
        // Of second order in the step: 1e-4 of the bolt's own momentum.
        let share = norm(difference(after, before)) / norm(before);
        println!("{modules} modules, {segments} segments: momentum changes by {share:.1e} of the bolt's");
        assert!(share < 1e-3, "{modules} modules, {segments} segments: momentum changes by {share:e}");
    }
}

#[test]
fn any_module_can_be_held() {
    // What is held does not move; what is not, shakes. Held in the nominal pose, in space, at either end alike.
    for modules in [2, 3, 5] {
        for clamped in 0..modules {
            let plan = Plan { clamped: Some(clamped), ..in_space(robot(modules, 60.0)) };
            assert_eq!(plan.degrees_of_freedom(), 30 * (modules - 1) + 1);
            let start = alone(&plan, 1e-4).snapshot(0);
            let end = ended(&plan, 7.0, 0.1);
            for k in 0..modules {
                let moved = norm(difference(end.modules[k].position, start.modules[k].position));
                if k == clamped {
                    assert_eq!(end.modules[k], start.modules[k], "module {k} of {modules} is held and moves");
                } else if k < clamped {
                    // The shaken side.
                    assert!(moved > 1e-6, "module {k} of {modules}, held at {clamped}, moves by {moved} m only");
                } else {
                    // Behind the clamp nothing shakes.
                    assert!(moved < 1e-15, "module {k} of {modules}, held at {clamped}, moves by {moved} m");
                }
            }
        }
    }
}

#[test]
fn where_the_chain_is_cut_does_not_matter() {
    // Held by a tonne instead of a clamp: another base link, the same motion of the rest.
    let clamped = Plan { clamped: Some(2), ..in_space(robot(3, 60.0)) };
    let mut heavy = Plan { clamped: None, ..clamped.clone() };
    heavy.modules[2].mass = 1e5;
    let [a, b] = [&clamped, &heavy].map(|plan| ended(plan, 7.0, 0.2));
    let start = alone(&clamped, 1e-4).snapshot(0);
    for k in 0..2 {
        let moved = norm(difference(a.modules[k].position, start.modules[k].position));
        let off = norm(difference(a.modules[k].position, b.modules[k].position));
        println!("module {k} moves by {moved:.2e} m, {off:.1e} m apart");
        // Both of second order in the step, in other coordinates; and 1e-6 of the tonnes' own motion.
        assert!(off < 1e-3 * moved, "module {k} moves by {moved} m, {off} m apart");
    }
}

/// Speeds over 0.3 to 0.6 s: longitudinal, lateral (mm/s), yaw (°/s).
fn speeds(plans: &[Plan], hertz: &[f64]) -> Vec<[f64; 3]> {
    let mut bodies = Ensemble::new(plans, settings(1e-4)).unwrap();
    let drives: Vec<_> = hertz.iter().map(|f| servo(*f)).collect();
    let mut tracks: Vec<_> =
        plans.iter().map(|plan| Track { plan: plan.clone(), snapshots: vec![], energy_j: vec![] }).collect();
    for _ in 0..=24 {
        tracks.iter_mut().enumerate().for_each(|(i, track)| track.snapshots.push(bodies.snapshot(i)));
        bodies.advance(250, &drives);
    }
    let speeds = tracks.iter().map(|track| track.speeds(0.3, 0.6).unwrap());
    speeds.map(|s| [1e3 * s.longitudinal, 1e3 * s.lateral, s.yaw.to_degrees()]).collect()
}

#[test]
fn the_mirror_turns_lateral_and_yaw_round() {
    let cases: Vec<(f64, f64)> =
        [0.0, 60.0, 90.0, 120.0].into_iter().flat_map(|alpha| [6.0, 7.0, 8.0].map(|f| (alpha, f))).collect();
    let (plans, hertz): (Vec<_>, Vec<_>) = cases.iter().map(|(alpha, f)| (robot(4, *alpha), *f)).unzip();
    let (mirrors, back): (Vec<_>, Vec<_>) = cases.iter().map(|(alpha, f)| (robot(4, 180.0 - alpha), -f)).unzip();
    assert_mirrored(&plans, &hertz, &mirrors, &back);
    // What is uneven is mirrored with the rest.
    let (plans, mirrors): (Vec<_>, Vec<_>) = cases
        .iter()
        .map(|(alpha, _)| uneven(robot(4, *alpha)))
        .zip(&cases)
        .map(|(plan, (alpha, _))| (plan.clone(), mirrored(&plan, *alpha)))
        .unzip();
    assert_mirrored(&plans, &hertz, &mirrors, &back);
}

fn assert_mirrored(plans: &[Plan], hertz: &[f64], mirrors: &[Plan], back: &[f64]) {
    let (here, there) = (speeds(plans, hertz), speeds(mirrors, back));
    for (component, (name, sign)) in [("vx", 1.0), ("vy", -1.0), ("yaw", -1.0)].into_iter().enumerate() {
        let largest = here.iter().map(|speed| speed[component].abs()).fold(0.0, f64::max);
        let pairs = here.iter().zip(&there);
        let off = pairs.map(|(a, b)| (a[component] - sign * b[component]).abs()).fold(0.0, f64::max);
        println!("{name}: largest {largest:.3}, mirror {off:.1e} off");
        assert!(largest > 0.1, "{name}: nothing to mirror, {largest}");
        assert!(off < 0.01 * largest, "{name}: {off} off, largest {largest}");
    }
}

#[test]
fn rolls_of_backbones_are_alpha_and_its_multiples() {
    let mut robot_file = default_robot();
    let backbone = robot_file.backbone.as_mut().unwrap();
    backbone.roll_deg = Some(vec![60.0, 120.0, 180.0]);
    let listed = Plan::new(&robot_file).unwrap();
    assert_eq!(listed, robot(4, 60.0));
    let mut other = default_robot();
    other.backbone.as_mut().unwrap().roll_deg = Some(vec![60.0, 120.0, 90.0]);
    let other = Plan::new(&other).unwrap();
    let [a, b, c] = [&listed, &robot(4, 60.0), &other].map(|plan| ended(plan, 7.0, 0.2));
    assert_eq!(a, b, "α and its multiples listed are not α");
    assert!(norm(difference(a.centroid(), c.centroid())) > 1e-6, "the third backbone's roll does nothing");
}

#[test]
fn a_whole_turn_of_alpha_changes_nothing() {
    for alpha in [0.0, 60.0] {
        let [a, b] = [alpha, alpha + 360.0].map(|alpha| ended(&robot(4, alpha), 7.0, 0.3));
        let off = norm(difference(a.centroid(), b.centroid()));
        let half = norm(difference(a.centroid(), ended(&robot(4, alpha + 90.0), 7.0, 0.3).centroid()));
        println!("α {alpha}°: a turn more {off:.1e} m, a quarter of a turn {half:.1e} m apart");
        // cos 2π is 1 but for rounding, which contact makes larger.
        assert!(off < 1e-9, "α {alpha}°: {off} m apart after a whole turn");
        assert!(half > 1e-6, "α does nothing: {half} m");
    }
}

#[test]
fn a_rolled_backbone_bends_about_its_rolled_axes() {
    // Clamped, α = 90° in one backbone: what was the stiff axis's sag becomes the soft one's.
    let sag = |alpha: f64, gravity: [f64; 3]| {
        let plan = robot(2, alpha);
        let plan = Plan { clamped: Some(0), eccentric: None, contact: None, gravity, ..plan };
        let plan = damped(plan, 10.0);
        let start = alone(&plan, 1e-4).snapshot(0).modules[1].position;
        difference(rest(&plan, 1e-4).snapshot(0).modules[1].position, start)
    };
    // So little that second order, slope squared, is a few millionths.
    let weight = 0.05;
    let (upright, lying) = (sag(0.0, [0.0, 0.0, -weight]), sag(90.0, [0.0, 0.0, -weight]));
    let sideways = sag(0.0, [0.0, -weight, 0.0]);
    println!("sag {:.3e} m upright, {:.3e} lying, {:.3e} sideways", upright[2], lying[2], sideways[1]);
    // At rest to some 1e-11 m/s.
    assert!((lying[2] / sideways[1] - 1.0).abs() < 1e-6, "lying {} m, sideways {} m", lying[2], sideways[1]);
    // Stiffness 0.1 against 0.04.
    assert!((lying[2] / upright[2] - 2.5).abs() < 1e-4, "lying {} m, upright {} m", lying[2], upright[2]);
    // Half way the weight's share along y' meets the soft hinges and that along z' the stiff ones: it gives way sideways.
    let leaning = sag(45.0, [0.0, 0.0, -weight]);
    let (stiff, soft) = (upright[2], lying[2]);
    let expected = [0.5 * (soft - stiff), 0.5 * (soft + stiff)];
    let off = (leaning[1] - expected[0]).hypot(leaning[2] - expected[1]) / soft.abs();
    assert!(off < 1e-4, "at 45° {leaning:?} m, the two axes say {expected:?}");
}
