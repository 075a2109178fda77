//! What is no body, and which steps are too long: refused with the reason and the number; and the longest step that is not
//! refused is carried.

use crate::common;
use crate::common::body::robot;
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings};

fn at(step_s: f64) -> Settings {
    Settings { step_s, precision: Precision::Double }
}

fn refusal(plan: &Plan, step_s: f64) -> String {
    Ensemble::new(std::slice::from_ref(plan), at(step_s)).expect_err("must be refused").to_string()
}

/// The longest step that is not refused, s.
fn longest(plan: &Plan) -> f64 {
    let (mut low, mut high) = (1e-6, 1e-1);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if Ensemble::new(std::slice::from_ref(plan), at(middle)).is_ok() { low = middle } else { high = middle }
    }
    low
}

/// Largest speed of any hinge, rad/s, after a second of shaking.
fn shaken(plan: &Plan, step_s: f64) -> f64 {
    let mut body = Ensemble::new(std::slice::from_ref(plan), at(step_s)).unwrap();
    body.advance((1.0 / step_s) as usize, &[Drive::Phase { speed: 44.0 }]);
    body.coordinates(0)
        .rates
        .iter()
        .flatten()
        .fold(0.0, |largest: f64, rate| if rate.is_nan() { f64::INFINITY } else { largest.max(rate.abs()) })
}

#[test]
fn the_longest_step_is_carried_and_a_longer_one_refused() {
    let mut in_the_air = robot(4, 60.0);
    in_the_air.contact = None;
    for (name, plan, field) in [("hinges", in_the_air, "backbone"), ("feet", robot(4, 60.0), "feet")] {
        let step = longest(&plan);
        println!("{name}: {step:.3e} s");
        let fastest = shaken(&plan, 0.99 * step);
        assert!(fastest < 100.0, "{name}: a hinge turns at {fastest} rad/s with the longest step");
        let message = refusal(&plan, 1.01 * step);
        let number = format!("{:.1e} s can", step);
        assert!(message.starts_with(field) && message.contains(&number), "{name}: {message}, expected {number}");
    }
}

#[test]
fn undamped_segments_need_a_shorter_step() {
    let mut plan = robot(4, 60.0);
    plan.contact = None;
    plan.backbones.iter_mut().for_each(|backbone| backbone.damping = [0.0; 3]);
    let step = longest(&plan);
    assert!((5e-6..5e-5).contains(&step), "{step} s");
    assert!(shaken(&plan, 0.99 * step) < 1000.0);
}

#[test]
fn what_is_no_body_is_refused() {
    let with = |change: &dyn Fn(&mut Plan)| {
        let mut plan = robot(3, 60.0);
        change(&mut plan);
        refusal(&plan, 1e-4)
    };
    for (message, expected) in [
        (with(&|plan| plan.modules.clear()), "0 modules and 2 backbones"),
        (with(&|plan| plan.backbones.truncate(1)), "3 modules and 1 backbones"),
        (with(&|plan| plan.modules[1].mass = 0.0), "module 2: mass and size must be positive"),
        (with(&|plan| plan.modules[1].mass = f64::NAN), "module 2: mass and size must be positive"),
        (with(&|plan| plan.modules[1].inertia = Some([1e-6, 0.0, 1e-6])), "module 2: inertia must be positive"),
        (with(&|plan| plan.modules[1].mass_centre[1] = f64::NAN), "module 2: inertia must be positive"),
        (with(&|plan| plan.modules[0].friction_shares[1] = -0.1), "module 1: inertia must be positive, friction not"),
        (with(&|plan| plan.backbones[1].hardening[2] = -1.0), "backbone 2: segments, mass"),
        (with(&|plan| plan.modules[2].centre_height *= 1.1), "module 3 is not as high as the first"),
        (with(&|plan| plan.backbones[1].segments = 0), "backbone 2: segments, mass"),
        (with(&|plan| plan.backbones[0].damping[2] = -1.0), "backbone 1: segments, mass"),
        (with(&|plan| plan.backbones[0].stiffness[0] = f64::NAN), "backbone 1: segments, mass"),
        (with(&|plan| plan.clamped = Some(3)), "there are 3 modules"),
        (with(&|plan| plan.eccentric.as_mut().unwrap().mass = -1.0), "its mass and inertia must be positive"),
    ] {
        assert!(message.contains(expected), "{message}, expected {expected}");
    }
    assert!(refusal(&robot(2, 0.0), f64::NAN).contains("must be positive"));
    let unlike = Ensemble::new(&[robot(3, 0.0), robot(4, 0.0)], at(1e-4)).unwrap_err().to_string();
    assert!(unlike.contains("the same modules and segments"), "{unlike}");
    assert!(Ensemble::new(&[], at(1e-4)).is_err());
}

#[test]
fn modules_of_unlike_heights_stand_on_one_ground() {
    let mut robot = common::default_robot();
    robot.body.as_mut().unwrap().courier.height_m.value = 0.012;
    let plan = Plan::new(&robot).unwrap();
    let body = Ensemble::new(&[plan], at(1e-4)).unwrap();
    let low = body.snapshot(0).feet.iter().map(|foot| foot.position[2]).collect::<Vec<_>>();
    assert!(low.iter().all(|z| (z - 0.002).abs() < 1e-12), "{low:?}");
    let heights = body.snapshot(0).modules.iter().map(|module| module.position[2]).collect::<Vec<_>>();
    assert!(heights.iter().all(|z| (z - 0.018).abs() < 1e-12), "{heights:?}");
}
