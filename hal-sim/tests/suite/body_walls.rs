//! Walls, and bodies that take another's place.

use crate::common::body::{STILL, alone, block, robot, run, settings, velocity};
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings, Wall};

const STEP: f64 = 1e-4;

/// A block without friction on the ground between x = ±0.2 m and y = ±0.2 m, which moves as told.
fn between_walls(velocity: [f64; 2], friction: f64) -> Ensemble {
    let mut plan = block(0.0021);
    plan.contact.as_mut().unwrap().friction = friction;
    let corners = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]];
    plan.walls = (0..4).map(|i| Wall { from: corners[i], to: corners[(i + 1) % 4] }).collect();
    let mut body = alone(&plan, STEP);
    run(&mut body, 0.3, STILL);
    let start = Coordinates { velocity: [velocity[0], velocity[1], 0.0], ..body.coordinates(0) };
    body.put(0, &start);
    body
}

/// Of all modules' boxes, seen from above: the least and the greatest x and y of a corner.
fn extent(plan: &Plan, body: &Ensemble) -> [[f64; 2]; 2] {
    let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for (pose, module) in body.snapshot(0).modules.iter().zip(&plan.modules) {
        let axes = hal_sim::body::coordinates::rotation(pose.orientation);
        for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            for (axis, extent) in extent.iter_mut().enumerate() {
                let off = 0.5 * (a * module.size[0] * axes[axis][0] + b * module.size[1] * axes[axis][1]);
                let at = pose.position[axis] + off;
                *extent = [extent[0].min(at), extent[1].max(at)];
            }
        }
    }
    extent
}

#[test]
fn a_block_that_runs_into_a_wall_stays_before_it_and_loses_energy() {
    for direction in [[0.05, 0.0], [-0.05, 0.0], [0.0, 0.05], [0.03, -0.04]] {
        let mut body = between_walls(direction, 0.0);
        let plan = body.plans()[0].clone();
        let (mut deepest, mut last, mut turned) = (0.0_f64, body.balance(0).kinetic, false);
        for _ in 0..600 {
            for _ in 0..20 {
                run(&mut body, 1e-3, STILL);
                for [low, high] in extent(&plan, &body) {
                    deepest = deepest.max(-0.2 - low).max(high - 0.2);
                }
            }
            let speed = velocity(&body, 0);
            turned |= speed[0] * direction[0] + speed[1] * direction[1] < 0.0;
            let kinetic = body.balance(0).kinetic;
            assert!(kinetic <= last * (1.0 + 1e-3) + 1e-12, "{direction:?}: {kinetic} J after {last} J");
            last = kinetic.max(1e-9);
        }
        println!("{direction:?}: {:.3} mm deep, {last:.2e} J left", 1e3 * deepest);
        assert!(turned, "{direction:?}: it never came back");
        // 12 g at 50 mm/s on the springs of two corners: 0.09 mm; of one, 0.13 mm.
        assert!((3e-5..2e-4).contains(&deepest), "{direction:?}: {deepest} m in the wall");
    }
}

#[test]
fn a_wall_brakes_what_slides_along_it() {
    let speed_after = |friction: f64| {
        let mut body = between_walls([0.02, 0.05], friction);
        // Without weight the wall alone rubs.
        let mut plan = body.plans()[0].clone();
        plan.gravity = [0.5, 0.0, 0.0];
        let start = body.coordinates(0);
        body.replace(0, plan).unwrap();
        body.put(0, &Coordinates { velocity: [0.0, 0.05, 0.0], ..start.carried(0.0, [0.0, -0.1]) });
        run(&mut body, 1.6, STILL);
        velocity(&body, 0)[1]
    };
    let (smooth, rough) = (speed_after(0.0), speed_after(0.4));
    println!("along the wall: {smooth:.4} m/s without friction, {rough:.4} m/s with 0.4");
    assert!(smooth > 0.045, "{smooth}");
    assert!(rough < 0.6 * smooth, "{rough} of {smooth}");
}

#[test]
fn an_end_of_a_wall_stops_the_side_of_a_box() {
    let mut plan = block(0.0021);
    plan.contact.as_mut().unwrap().friction = 0.0;
    // Across the way of the block's side, and shorter than it: no corner meets it.
    let y = 0.5 * plan.modules[0].size[1] + 0.01;
    plan.walls = vec![Wall { from: [0.0, y], to: [0.0, y + 0.1] }];
    let mut body = alone(&plan, STEP);
    run(&mut body, 0.2, STILL);
    let start = Coordinates { velocity: [0.0, 0.04, 0.0], ..body.coordinates(0) };
    body.put(0, &start);
    run(&mut body, 1.0, STILL);
    let [_, [_, high]] = extent(&plan, &body);
    assert!(velocity(&body, 0)[1] < 0.02, "it went on at {} m/s", velocity(&body, 0)[1]);
    let module = body.snapshot(0).modules[0].position;
    assert!(module[1] + 0.5 * plan.modules[0].size[1] < y + 1e-3, "through the end: {high} m");
}

#[test]
fn a_wall_out_of_reach_changes_no_bit_nor_does_company_with_walls() {
    let drive = Drive::Phase { speed: 44.0 };
    for precision in [Precision::Double, Precision::Single] {
        let settings = Settings { step_s: STEP, precision };
        let free = robot(4, 90.0);
        let mut walled = free.clone();
        walled.walls = vec![Wall { from: [1.0, -1.0], to: [1.0, 1.0] }];
        let mut narrow = free.clone();
        narrow.walls = vec![Wall { from: [0.0101, -1.0], to: [0.0101, 1.0] }];
        let snapshots = |plans: &[Plan]| {
            let mut bodies = Ensemble::new(plans, settings).unwrap();
            bodies.advance(3000, &vec![drive; plans.len()]);
            (0..plans.len()).map(|i| bodies.snapshot(i)).collect::<Vec<_>>()
        };
        let alone = snapshots(std::slice::from_ref(&free));
        let together = snapshots(&[narrow.clone(), free, walled]);
        assert_eq!(alone[0], together[1]);
        assert_eq!(alone[0], together[2]);
        assert_ne!(alone[0], together[0]);
        assert_eq!(snapshots(&[narrow])[0], together[0]);
    }
}

#[test]
fn a_robot_that_pushes_at_a_wall_stays_before_it() {
    let mut plan = robot(4, 90.0);
    // 4 mm ahead of the first module, across.
    let x = 0.5 * plan.modules[0].size[0] + 0.004;
    plan.walls = vec![Wall { from: [x, -0.3], to: [x, 0.3] }];
    let mut body = alone(&plan, STEP);
    let mut most = f64::NEG_INFINITY;
    for _ in 0..400 {
        run(&mut body, 0.01, Drive::Phase { speed: -44.0 });
        most = most.max(extent(&plan, &body)[0][1]);
    }
    println!("{:.3} mm in the wall at most", 1e3 * (most - x));
    assert!(most > x, "it never reached the wall");
    assert!(most < x + 1.5e-3, "{} m in the wall", most - x);
}

#[test]
fn a_body_in_anothers_place_is_a_new_one_and_the_others_do_not_notice() {
    let drives = |speed: f64| vec![Drive::Motor { angle: 0.3, speed, acceleration: 0.0, rotor_inertia: 0.0 }; 5];
    for precision in [Precision::Double, Precision::Single] {
        let settings = Settings { step_s: STEP, precision };
        let plans: Vec<Plan> = [0.0, 60.0, 90.0, 120.0, 30.0].map(|alpha| robot(4, alpha)).into();
        for replaced in 0..5 {
            let mut bodies = Ensemble::new(&plans, settings).unwrap();
            let mut undisturbed = bodies.clone();
            bodies.advance(700, &drives(40.0));
            undisturbed.advance(700, &drives(40.0));
            let mut other = robot(4, 75.0);
            other.modules[1].mass *= 1.1;
            bodies.replace(replaced, other.clone()).unwrap();
            bodies.advance(900, &drives(30.0));
            undisturbed.advance(900, &drives(30.0));
            let mut fresh = Ensemble::new(&[other], settings).unwrap();
            fresh.advance(900, &drives(30.0)[..1]);
            for i in 0..5 {
                let (now, expected) = if i == replaced {
                    (bodies.coordinates(i), fresh.coordinates(0))
                } else {
                    (bodies.coordinates(i), undisturbed.coordinates(i))
                };
                assert_eq!(now, expected, "{precision:?}: body {i} with {replaced} replaced");
            }
        }
    }
}

#[test]
fn what_cannot_take_a_place_is_refused() {
    let mut bodies = Ensemble::new(&[robot(4, 90.0), robot(4, 60.0)], settings(STEP)).unwrap();
    let before = bodies.coordinates(0);
    let shape = bodies.replace(0, robot(3, 90.0)).unwrap_err().to_string();
    assert!(shape.contains("same modules"), "{shape}");
    let floating = Plan { contact: None, ..robot(4, 90.0) };
    let contact = bodies.replace(0, floating).unwrap_err().to_string();
    assert!(contact.contains("contact"), "{contact}");
    let mut wall = robot(4, 90.0);
    wall.walls = vec![Wall { from: [1.0, 1.0], to: [1.0, 1.0] }];
    let ends = bodies.replace(1, wall).unwrap_err().to_string();
    assert!(ends.contains("two different ends"), "{ends}");
    assert_eq!(bodies.coordinates(0), before);
}

#[test]
fn carrying_a_body_turns_and_moves_it_whole() {
    let plan = robot(4, 90.0);
    let mut bodies = Ensemble::new(&[plan.clone(), plan], settings(STEP)).unwrap();
    let carried = bodies.coordinates(1).carried(0.7, [0.3, -0.2]);
    bodies.put(1, &carried);
    bodies.advance(2000, &[Drive::Phase { speed: 40.0 }; 2]);
    let (still, moved) = (bodies.snapshot(0), bodies.snapshot(1));
    let (sin, cos) = 0.7_f64.sin_cos();
    for (a, b) in still.feet.iter().zip(&moved.feet) {
        let [x, y, z] = a.position;
        let expected = [cos * x - sin * y + 0.3, sin * x + cos * y - 0.2, z];
        for (expected, found) in expected.into_iter().zip(b.position) {
            assert!((expected - found).abs() < 1e-9, "{expected} {found}");
        }
    }
    assert!((moved.heading() - still.heading() - 0.7).abs() < 1e-9);
}
