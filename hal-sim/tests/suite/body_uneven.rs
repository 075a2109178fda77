//! A body that is not even: what a robot file says of modules, feet and backbones one by one, and what stands on them.

use crate::common::body::{G, difference, rest, robot, segmented};
use hal_sim::body::Plan;
use hal_sim::body::coordinates::rotation;
use hal_sim::body::skeleton::{sum, times};
use robot_file::Robot;

/// The default robot's file with tables after it.
fn plan_with(tables: &str) -> Plan {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robot.toml");
    let text = std::fs::read_to_string(path).unwrap() + tables;
    Plan::new(&Robot::parse(&text, path).unwrap()).unwrap()
}

fn quantity(value: f64) -> String {
    format!("{{ value = {value}, low = {value}, high = {value}, source = \"a test\" }}")
}

#[test]
fn what_is_one_modules_own_changes_that_module_alone() {
    let tables = format!(
        "[body.module.3]\nmass_kg = {}\nwidth_m = {}\ninset_m = {}\ninertia_y_kg_m2 = {}\n[body.module.4]\nfeet = \
         [\"right\"]\n",
        quantity(0.009),
        quantity(0.05),
        quantity(0.005),
        quantity(4e-7)
    );
    let (plan, even) = (plan_with(&tables), plan_with(""));
    let mut expected = even.clone();
    let third = &mut expected.modules[2];
    (third.mass, third.size[1]) = (0.009, 0.05);
    // A box of 9 g, 20 × 50 × 8 mm, but for what is said of y.
    third.inertia =
        Some([0.009 * (0.05 * 0.05 + 0.008 * 0.008) / 12.0, 4e-7, 0.009 * (0.02 * 0.02 + 0.05 * 0.05) / 12.0]);
    (third.feet[0][1], third.feet[1][1]) = (0.02, -0.02);
    expected.modules[3].has_foot = [false, true];
    let (found, wanted) = (plan.modules[2].inertia.unwrap(), expected.modules[2].inertia.unwrap());
    assert!((0..3).all(|axis| (found[axis] / wanted[axis] - 1.0).abs() < 1e-12), "{found:?}, expected {wanted:?}");
    expected.modules[2].inertia = plan.modules[2].inertia;
    assert_eq!(plan, expected);
}

#[test]
fn the_longest_legs_stand_at_the_start() {
    // The file's legs are 12 mm under modules of 8 mm.
    let legs = |left: f64, right: f64| {
        format!("[body.module.2]\nleft_leg_m = {}\nright_leg_m = {}\n", quantity(left), quantity(right))
    };
    for (left, right, height) in [(0.011, 0.012, 0.016), (0.0125, 0.012, 0.0165), (0.010, 0.013, 0.017)] {
        let plan = plan_with(&legs(left, right));
        let lowest = |k: usize, side: usize| plan.modules[k].centre_height + plan.modules[k].feet[side][2] - 0.002;
        let hang = height - 0.016;
        for k in 0..4 {
            assert!((plan.modules[k].centre_height - height).abs() < 1e-12, "{left}, {right}: module {k}");
            let expected = if k == 1 { [height - 0.004 - left, height - 0.004 - right] } else { [hang; 2] };
            for (side, expected) in expected.iter().enumerate() {
                assert!((lowest(k, side) - expected).abs() < 1e-12, "{left}, {right}: foot {k}, {side}");
            }
        }
    }
}

#[test]
fn effects_of_the_body_are_numbers_of_the_plan() {
    let table = |name: &str, keys: &[(&str, f64)]| {
        let lines: Vec<_> = keys.iter().map(|(key, value)| format!("{key} = {}\n", quantity(*value))).collect();
        format!("[effects.{name}]\n{}", lines.concat())
    };
    let even = plan_with("");
    let payload = plan_with(&table("payload_offset", &[("x_m", 0.001), ("y_m", -0.004), ("z_m", 0.002)]));
    let mut expected = even.clone();
    expected.modules[1].mass_centre = [0.001, -0.004, 0.002];
    assert_eq!(payload.modules, expected.modules);

    let names = ["stiffness_1_share", "stiffness_2_share", "stiffness_3_share"];
    let damping = ["damping_1_share", "damping_2_share", "damping_3_share"];
    let (stiff, damped) = ([1.2, 0.9, 1.0], [0.5, 1.0, 2.0]);
    let keys: Vec<_> = names.into_iter().zip(stiff).chain(damping.into_iter().zip(damped)).collect();
    let unequal = plan_with(&table("backbone_mismatch", &keys));
    for (b, (found, even)) in unequal.backbones.iter().zip(&even.backbones).enumerate() {
        assert_eq!(found.stiffness, even.stiffness.map(|k| stiff[b] * k), "backbone {b}");
        assert_eq!(found.damping, even.damping.map(|d| damped[b] * d), "backbone {b}");
    }

    let hardening = [("torsion_share", 0.5), ("stiff_share", 3.0), ("soft_share", 2.0)];
    let hard = plan_with(&table("backbone_hardening", &hardening));
    // Ten hinges turn a tenth each: a hundred times as much of the square of a hinge's angle.
    assert!(hard.backbones.iter().all(|backbone| backbone.hardening == [50.0, 300.0, 200.0]));

    let feet: Vec<_> = (1..=4).flat_map(|k| [format!("left_{k}_share"), format!("right_{k}_share")]).collect();
    let keys: Vec<_> = feet.iter().enumerate().map(|(i, key)| (key.as_str(), 0.5 + 0.1 * i as f64)).collect();
    let gripping = plan_with(&table("foot_friction", &keys));
    for (k, module) in gripping.modules.iter().enumerate() {
        let expected = [0, 1].map(|side| 0.5 + 0.1 * (2 * k + side) as f64);
        assert_eq!(module.friction_shares, expected, "module {k}");
    }
}

/// Sum over a resting robot's feet of their forces, and of their moments about a point, N and N·m.
fn borne(plan: &Plan) -> (f64, [f64; 2]) {
    let end = rest(plan, 1e-4).snapshot(0);
    let mut centre = [0.0; 3];
    let mut add = |mass: f64, at: [f64; 3]| centre = sum(centre, at.map(|x| mass * x));
    for (module, pose) in plan.modules.iter().zip(&end.modules) {
        add(module.mass, sum(pose.position, times(rotation(pose.orientation), module.mass_centre)));
    }
    let segments = plan.backbones.iter().flat_map(|b| std::iter::repeat_n(b.segment_mass, b.segments));
    segments.zip(&end.segments).for_each(|(mass, pose)| add(mass, pose.position));
    if let (Some(eccentric), Some(rotor)) = (plan.eccentric, end.rotor) {
        add(eccentric.mass, rotor.bolt);
    }
    let centre = centre.map(|x| x / plan.mass());
    end.feet.iter().fold((0.0, [0.0; 2]), |(force, [roll, pitch]), foot| {
        let [x, y, z] = difference(foot.position, centre);
        let [fx, fy, fz] = foot.force;
        // The point that touches lies a radius below the foot's centre; friction at rest is next to nothing, but counts.
        let z = z - plan.contact.as_ref().unwrap().foot_radius;
        (force + fz, [roll + y * fz - z * fy, pitch + z * fx - x * fz])
    })
}

#[test]
fn the_feet_balance_the_weight_where_it_is() {
    for (name, side) in [("to the left", 0.012), ("to the right", -0.012)] {
        let mut plan = robot(4, 60.0);
        plan.modules[1].mass_centre = [0.004, side, 0.0];
        let weight = plan.mass() * G;
        let (force, moments) = borne(&plan);
        println!("{name}: the feet bear {:.6} of the weight, moments {moments:?} N·m", force / weight);
        // What the old place of the mass would leave: 20 g · 12 mm of 47 g.
        let left = plan.modules[1].mass * G * side.abs();
        assert!((force / weight - 1.0).abs() < 1e-6, "{name}: {force} N of {weight} N");
        assert!(moments.iter().all(|moment| moment.abs() < 1e-3 * left), "{name}: {moments:?} N·m are left over");
    }
}

#[test]
fn where_a_foot_is_missing_the_others_stand() {
    let mut plan = robot(4, 60.0);
    plan.modules[1].has_foot[1] = false;
    let end = rest(&plan, 1e-4).snapshot(0);
    let weight = plan.mass() * G;
    let borne: f64 = end.feet.iter().map(|foot| foot.force[2]).sum();
    assert_eq!(end.feet[3].force, [0.0; 3], "the foot is missing");
    assert!((borne / weight - 1.0).abs() < 1e-6, "the others bear {borne} N of {weight} N");
    // The courier sinks and leans to that side.
    let low = end.feet[2].position[2] - end.feet[3].position[2];
    println!("the courier's right side hangs {:.3} mm lower", 1e3 * low);
    assert!(low > 1e-4, "{low} m");
}

#[test]
fn how_a_backbone_is_cut_does_not_matter_to_its_hardening() {
    // Held at module 1, bent by the weight of the second module: one law, cut into 10 and into 40.
    let sag = |segments: usize, share: f64| {
        let mut plan = robot(2, 0.0);
        plan.backbones[0].hardening = [share * 100.0; 3];
        let mut plan = segmented(plan, segments);
        plan = Plan { clamped: Some(0), eccentric: None, contact: None, gravity: [0.0, -4.0 * G, 0.0], ..plan };
        plan.backbones[0].damping = plan.backbones[0].damping.map(|d| 10.0 * d);
        rest(&plan, 5e-5).snapshot(0).modules[1].position[1]
    };
    let (linear, coarse, fine) = (sag(10, 0.0), sag(10, 3.0), sag(40, 3.0));
    println!("sag {:.4} mm without, {:.4} mm in 10 segments, {:.4} mm in 40", 1e3 * linear, 1e3 * coarse, 1e3 * fine);
    assert!(coarse / linear < 0.95, "the case hardens");
    // Of the law, segments change what they change of a linear backbone.
    let of_linear = (sag(40, 0.0) / linear - 1.0).abs();
    assert!((fine / coarse - 1.0).abs() < 2.0 * of_linear + 5e-3, "{coarse} m in 10 segments, {fine} m in 40");
}
