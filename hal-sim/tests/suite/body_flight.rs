//! A body in flight: what Newton's laws keep, and how fast the rest converges.

use std::f64::consts::TAU;

use crate::common;
use crate::common::body::{
    G, STILL, alone, brief, difference, energy, from, in_space, norm, orders, robot, run, segmented, uneven, velocity,
};
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::{Drive, Plan};

/// A rotor without a torque; it starts at this speed.
const FREE: Drive = Drive::Servo { speed: 44.0, stiffness: 0.0, damping: 0.0 };

/// No damping in the hinges.
fn undamped(plan: Plan) -> Plan {
    common::body::damped(in_space(plan), 0.0)
}

/// Every backbone bent to another circle, spinning about all axes, the rotor turning. Along a circle the light boxes are
/// in balance: what swings are the modules.
fn tumbling(plan: &Plan, bend: f64) -> Coordinates {
    let mut start = Coordinates::nominal(plan);
    for (joint, angles) in start.angles.iter_mut().enumerate() {
        let (backbone, segments) = (joint / plan.backbones[0].segments, plan.backbones[0].segments as f64);
        let phase = backbone as f64 + 1.0;
        *angles = [phase.sin(), 0.5, -(2.0 * phase).cos()].map(|share| bend * share / segments);
    }
    start.velocity = [0.1, -0.2, 0.3];
    start.angular_velocity = [3.0, -2.0, 4.0];
    start.rotor_speed = 44.0;
    start
}

#[test]
fn free_fall_is_exact() {
    // Gravity that leans, and a throw.
    let plan = Plan { contact: None, gravity: [1.0, -2.0, -G], ..robot(4, 60.0) };
    let (thrown, time) = ([0.3, -0.1, 2.0], 0.5);
    let mut body = from(&plan, &Coordinates { velocity: thrown, ..Coordinates::nominal(&plan) }, 1e-4);
    let start = body.snapshot(0);
    run(&mut body, time, STILL);
    let end = body.snapshot(0);
    // 5000 additions of numbers up to 1 m.
    let fallen = [0, 1, 2].map(|axis| thrown[axis] * time + 0.5 * plan.gravity[axis] * time * time);
    let off = norm(difference(difference(end.centroid(), start.centroid()), fallen));
    assert!(off < 1e-12, "{off:e} m off {fallen:?} m");
    let gained = plan.gravity.map(|g| g * time);
    let off = norm(difference(difference(velocity(&body, 0), thrown), gained));
    assert!(off < 1e-12, "{off:e} m/s off");
    for (index, (before, after)) in start.modules.iter().zip(&end.modules).enumerate() {
        let off = (0..4).map(|i| (before.orientation[i] - after.orientation[i]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "module {index} turned by {off:e} in free fall");
    }
}

/// Largest drift of energy, momentum and angular momentum over 0.2 s, each over its size.
fn drifts(plan: &Plan, start: &Coordinates, step_s: f64, time_s: f64) -> [f64; 3] {
    let mut body = from(plan, start, step_s);
    let before = body.balance(0);
    let mut worst = [0.0; 3];
    for _ in 0..20 {
        run(&mut body, time_s / 20.0, FREE);
        let now = body.balance(0);
        let drift = [
            (energy(&now) - energy(&before)).abs() / energy(&before),
            norm(difference(now.momentum, before.momentum)) / norm(before.momentum),
            norm(difference(now.angular_momentum, before.angular_momentum)) / norm(before.angular_momentum),
        ];
        worst = [0, 1, 2].map(|i| drift[i].max(worst[i]));
    }
    worst
}

/// Drifts at four steps that halve, and the least order of each between the last ones.
fn table(name: &str, plan: &Plan, bend: f64, coarsest_s: f64, time_s: f64) -> ([f64; 3], [f64; 3]) {
    let steps = [1.0, 0.5, 0.25, 0.125].map(|share| share * coarsest_s);
    let start = tumbling(plan, bend);
    let rows = steps.map(|step| drifts(plan, &start, step, time_s));
    println!("{name}: step, drift of energy, momentum, angular momentum, each over its size");
    for (step, row) in steps.iter().zip(&rows) {
        println!("{step:8.1e}  {:9.2e} {:9.2e} {:9.2e}", row[0], row[1], row[2]);
    }
    let order = [0, 1, 2].map(|i| orders(&rows.map(|row| row[i]))[1..].iter().copied().fold(f64::INFINITY, f64::min));
    println!("order     {:9.2} {:9.2} {:9.2}", order[0], order[1], order[2]);
    (rows[3], order)
}

#[test]
fn energy_and_momenta_are_kept_to_second_order_without_damping() {
    // One segment a backbone: no light boxes, whose vibrations would ask for steps below 2e-5 s.
    let plan = undamped(segmented(robot(4, 60.0), 1));
    let (last, order) = table("4 modules, 1 segment", &plan, 0.2, 4e-4, 0.2);
    for (name, order) in ["energy", "momentum", "angular momentum"].iter().zip(order) {
        assert!(order >= 1.9, "{name} converges with order {order:.2}");
    }
    // 5e-5 s: the modules' fastest vibration, about 500 rad/s, turns by 0.025 a step, whose square is 6e-4.
    assert!(last.iter().all(|drift| *drift < 1e-4), "drifts of {}", brief(&last));
}

#[test]
fn energy_and_momenta_are_kept_to_second_order_with_light_segments() {
    let plan = undamped(robot(4, 60.0));
    let (last, order) = table("4 modules, 10 segments", &plan, 0.2, 1.6e-5, 0.05);
    for (name, order) in ["energy", "momentum", "angular momentum"].iter().zip(order) {
        assert!(order >= 1.9, "{name} converges with order {order:.2}");
    }
    assert!(last.iter().all(|drift| *drift < 1e-3), "drifts of {}", brief(&last));
}

#[test]
fn an_uneven_body_keeps_them_as_well() {
    // Off-centre mass, inertias of its own, unequal and hardening backbones: each by its own energy and momentum.
    let plan = undamped(uneven(segmented(robot(4, 60.0), 1)));
    let (last, order) = table("uneven, 1 segment", &plan, 0.2, 4e-4, 0.2);
    for (name, order) in ["energy", "momentum", "angular momentum"].iter().zip(order) {
        assert!(order >= 1.9, "{name} converges with order {order:.2}");
    }
    assert!(last.iter().all(|drift| *drift < 3e-4), "drifts of {}", brief(&last));
}

#[test]
fn energy_never_rises_with_damping() {
    for alpha in [0.0, 60.0, 90.0] {
        let plan = in_space(robot(4, alpha));
        let largest_rise = |step: f64| {
            let mut body = from(&plan, &tumbling(&plan, 0.2), step);
            let first = energy(&body.balance(0));
            let (mut last, mut rise) = (first, 0.0_f64);
            for _ in 0..(0.5 / step) as usize {
                body.advance(1, &[FREE]);
                let now = energy(&body.balance(0));
                rise = rise.max((now - last) / first);
                last = now;
            }
            println!(
                "α {alpha}°, {step:.0e} s: {:.4} of {first:.2e} J left, rises by {rise:.1e} in a step",
                last / first
            );
            assert!(last < first, "α {alpha}°: {last} J of {first} J are left");
            rise
        };
        let [coarse, fine] = [1e-4, 2.5e-5].map(largest_rise);
        // What springs and step exchange in error is of third order in each step; where they turn, hardly anything is damped.
        assert!(coarse < 1e-5, "α {alpha}°: rises by {coarse:e} of the whole in a step");
        assert!(fine <= 0.1 * coarse, "α {alpha}°: rises by {fine:e} in a fine step, {coarse:e} in a coarse one");
    }
}

#[test]
fn the_path_in_flight_converges() {
    for (name, plan, least, largest) in [
        ("undamped, 1 segment", undamped(segmented(robot(4, 60.0), 1)), 1.9, 1e-5),
        ("default", in_space(robot(4, 60.0)), 1.9, 1e-5),
    ] {
        let end = |step: f64| {
            let mut body = from(&plan, &tumbling(&plan, 0.2), step);
            run(&mut body, 0.2, FREE);
            body.snapshot(0)
        };
        let steps = [4e-4, 2e-4, 1e-4, 5e-5];
        // The path's size is about that of the robot, 0.1 m.
        let exact = end(3.125e-6);
        let error = |step: f64| {
            let modules = end(step).modules;
            let off = modules.iter().zip(&exact.modules).map(|(a, b)| norm(difference(a.position, b.position)));
            off.fold(0.0, f64::max)
        };
        let errors = steps.map(error);
        let orders = orders(&errors);
        println!("{name}: at {} s {} m off, orders {orders:.2?}", brief(&steps), brief(&errors));
        assert!(orders.iter().all(|order| *order > least), "{name}: orders {orders:.2?}");
        assert!(errors[2] < largest, "{name}: {:e} m off at 1e-4 s", errors[2]);
    }
}

#[test]
fn the_eccentric_leads_a_heavy_module_round_its_circle() {
    let mut plan = in_space(robot(3, 0.0));
    plan.modules.remove(1);
    plan.backbones.truncate(1);
    let heavy = 10.0;
    plan.modules[0].mass = heavy;
    plan.modules[1].mass = 1e-5;
    let eccentric = plan.eccentric.as_mut().unwrap();
    eccentric.height = 0.0;
    let (mass, radius) = (eccentric.mass, eccentric.radius);
    for hertz in [-8.0, 6.0] {
        let speed = TAU * hertz;
        let circle = mass * radius / plan.mass();
        // The common centre of mass rests.
        let start = Coordinates { velocity: [0.0, -circle * speed, 0.0], ..Coordinates::nominal(&plan) };
        let mut body = from(&plan, &start, 1e-4);
        let first = body.snapshot(0).modules[0].position;
        for quarter in 1..=8 {
            run(&mut body, 0.02, Drive::Phase { speed });
            let angle = speed * 0.02 * f64::from(quarter);
            let now = body.snapshot(0).modules[0].position;
            let expected = [-circle * (angle.cos() - 1.0), -circle * angle.sin()];
            let off = (now[0] - first[0] - expected[0]).hypot(now[1] - first[1] - expected[1]) / circle;
            // The backbone and the second module weigh 3e-5 beside 10 kg; the step adds (ωh)² = 2e-5.
            assert!(off < 1e-4, "{hertz} Hz, {angle:.2} rad: {off:e} of the circle of m·r/M = {circle:e} m off");
        }
    }
}

#[test]
fn a_servo_swings_its_eccentric_as_spring_and_damper_do() {
    let plan = Plan { clamped: Some(0), ..in_space(robot(2, 0.0)) };
    let eccentric = plan.eccentric.unwrap();
    let inertia = eccentric.mass * eccentric.radius.powi(2) + eccentric.inertia[0];
    let (stiffness, damping, speed, offset) = (0.08, 2.5e-4, 44.0, 0.1);
    let (decay, free) = (0.5 * damping / inertia, (stiffness / inertia).sqrt());
    let swing = (free * free - decay * decay).sqrt();
    let error = |step: f64| {
        let mut body = alone(&plan, step);
        let drive = Drive::Servo { speed, stiffness, damping };
        // The first step brings the rotor to its speed; what follows starts beside the phase that is wanted.
        body.advance(1, &[drive]);
        let start = body.coordinates(0);
        body.put(0, &Coordinates { rotor_angle: start.rotor_angle + offset, ..start });
        let mut worst = 0.0_f64;
        for n in 1..=(0.02 / step).round() as usize {
            body.advance(1, &[drive]);
            let time = n as f64 * step;
            let expected =
                offset * (-decay * time).exp() * ((swing * time).cos() + decay / swing * (swing * time).sin());
            let off = body.coordinates(0).rotor_angle - speed * (time + step);
            worst = worst.max((off - expected).abs() / offset);
        }
        worst
    };
    let errors = [1e-4, 5e-5, 2.5e-5, 1.25e-5].map(error);
    let orders = orders(&errors);
    println!("servo: error over the offset {}, orders {orders:.2?}", brief(&errors));
    // (ωh)²/24 at 513 rad/s is 1e-4.
    assert!(errors[0] < 2e-4 && orders.iter().all(|order| *order > 1.9), "{} off, orders {orders:.2?}", brief(&errors));
}

#[test]
fn a_spinning_rotor_couples_roll_and_pitch_as_a_gyroscope() {
    // Module 1 on one triple of hinges before a clamped module; a balanced flywheel at the height of its centre.
    let mut plan = segmented(robot(2, 0.0), 1);
    plan = undamped(plan);
    plan.clamped = Some(1);
    plan.backbones[0].segment_mass = 1e-9;
    let (flywheel, across, speed) = (2e-6, 1e-6, 300.0);
    let eccentric = plan.eccentric.as_mut().unwrap();
    (eccentric.radius, eccentric.height, eccentric.inertia) = (0.0, 0.0, [flywheel, across]);
    let (module, bolt) = (plan.modules[0], eccentric.mass);
    // The hinges are at the module's rear face.
    let [x, y, z] = module.size;
    let about = [
        module.mass * (y * y + z * z) / 12.0 + across,
        module.mass * (x * x + z * z) / 12.0 + across + (module.mass + bolt) * 0.25 * x * x,
    ];
    let stiffness = [plan.backbones[0].stiffness[0], plan.backbones[0].stiffness[1]];
    // Of the small angles: I₁ẍ + Hẏ + k₁x = 0, I₂ÿ − Hẋ + k₂y = 0, by classical Runge-Kutta with a fine step.
    let rate = |[a, b, u, v]: [f64; 4]| {
        let momentum = flywheel * speed;
        [u, v, -(momentum * v + stiffness[0] * a) / about[0], (momentum * u - stiffness[1] * b) / about[1]]
    };
    let small = 1e-4;
    let mut exact = [small, 0.0, 0.0, 0.0];
    let mut start = Coordinates::nominal(&plan);
    // The module lies before the hinges: its own turn is against the hinge's.
    start.angles[0][0] = -small;
    let step = 2e-5;
    let mut body = from(&plan, &start, step);
    let (mut worst, mut largest_pitch) = (0.0_f64, 0.0_f64);
    for _ in 0..5000 {
        let add = |a: [f64; 4], b: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| a[i] + h * b[i]);
        let k1 = rate(exact);
        let k2 = rate(add(exact, k1, 0.5 * step));
        let k3 = rate(add(exact, k2, 0.5 * step));
        let k4 = rate(add(exact, k3, step));
        exact = [0, 1, 2, 3].map(|i| exact[i] + step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        body.advance(1, &[Drive::Phase { speed }]);
        let found = body.coordinates(0).angles[0];
        worst = worst.max((found[0] + exact[0]).hypot(found[1] + exact[1]) / small);
        largest_pitch = largest_pitch.max(exact[1].abs() / small);
    }
    println!("gyroscope: {worst:.1e} of the first roll off over 0.1 s; pitch reaches {largest_pitch:.2} of it");
    assert!(largest_pitch > 0.1, "the case shows no coupling: {largest_pitch}");
    // (ωh)²/24 of phase a radian at 700 rad/s, over 70 rad: 6e-4.
    assert!(worst < 2e-3, "{worst:e} of the first roll off");
}
