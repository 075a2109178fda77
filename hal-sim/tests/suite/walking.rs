//! The motor on the moving body: what each does to the other, and that a group is so many robots alone.

use crate::common::{LINEAR, STEP, default_robot, drive, quiet_robot};
use effects::{GravityTilt, Laws, LoadFriction};
use hal_sim::body::{Plan, Precision, Snapshot, Walker, WalkingRobots};
use hal_sim::robot::wrap;
use hal_sim::shaft::{Shaft, ShaftState, Terminals};
use hal_sim::{Fault, Settings, SimulatedRobot};
use robot_file::Robot;

/// A step of 0.1 ms, a fixed start and a full cell.
fn settings() -> Settings {
    Settings { start_angle: Some(0.4), charge: Some(0.9), ..Settings::default() }
}

/// One step a control period of the given length (s): every step can be looked at.
fn stepwise(robot: &mut Robot, step_s: f64) -> Settings {
    if let Some(controller) = &mut robot.controller {
        controller.tick_s.value = step_s;
    }
    Settings { steps_per_tick: 1, ..settings() }
}

/// Nothing under the feet and no weight.
fn in_space(plan: &mut Plan) {
    plan.contact = None;
    plan.gravity = [0.0; 3];
}

/// Two modules in space on a backbone without damping; the eccentric at the height of the modules' centres, so that
/// everything moves in a plane. The gearmotor has no losses but its winding's, and an ideal bridge.
fn planar(robot: &mut Robot) -> Plan {
    robot.effects.remove("coulomb_friction");
    robot.effects.remove("driver_drop");
    robot.effects.remove("battery_sag");
    robot.supply.battery = None;
    robot.motor.viscous_nm_s_per_rad.value = 0.0;
    robot.motor.inductance_h.value = 0.0;
    robot.driver.dead_time_s.value = 0.0;
    // A slow rotor behind few gears spins with more angular momentum: the module feels it more.
    robot.motor.gear_ratio.value = 3.0;
    let mut plan = Plan::new(robot).unwrap();
    in_space(&mut plan);
    plan.modules.truncate(2);
    plan.backbones.truncate(1);
    plan.backbones[0].roll = 0.0;
    plan.backbones[0].damping = [0.0; 3];
    plan.eccentric.as_mut().unwrap().height = 0.0;
    plan
}

fn alone(robot: &Robot, plan: Plan, settings: &Settings) -> WalkingRobots {
    let mut walker = Walker::new(robot, 1, settings).unwrap();
    walker.plan = plan;
    WalkingRobots::new(vec![walker], Precision::Double).unwrap()
}

/// Back and forth for half a second; the shaft's angle after every tick.
fn angles(mut robots: WalkingRobots, time_s: f64) -> Vec<f64> {
    let ticks = (time_s / robots.tick_s()).round() as usize;
    let tick_s = robots.tick_s();
    (0..ticks)
        .map(|tick| {
            let time = tick as f64 * tick_s;
            robots.advance(&[drive(if time < 0.3 { 0.9 } else { -0.8 })]);
            robots.truth(0).angle
        })
        .collect()
}

fn bench_angles(robot: &Robot) -> Vec<f64> {
    let mut robot = SimulatedRobot::with(robot, 1, &settings());
    (0..500)
        .map(|tick| {
            robot.advance(drive(if tick < 300 { 0.9 } else { -0.8 }));
            robot.truth().angle
        })
        .collect()
}

fn largest_apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_body_that_cannot_move_is_the_bench() {
    let robot = default_robot();
    let bench = bench_angles(&robot);
    let mut held = Plan::new(&robot).unwrap();
    held.clamped = Some(0);
    let mut heavy = Plan::new(&robot).unwrap();
    in_space(&mut heavy);
    for module in &mut heavy.modules {
        module.mass = 1e4;
    }
    let mut free = Plan::new(&robot).unwrap();
    in_space(&mut free);
    let off = |plan: Plan| largest_apart(&bench, &angles(alone(&robot, plan, &settings()), 0.5));
    let (held, heavy, free) = (off(held), off(heavy), off(free));
    println!("against the bench: held {held:.1e} rad, 10 t a module {heavy:.1e} rad, the robot itself {free:.2} rad");
    assert!(held < 1e-9, "{held} rad");
    assert!(heavy < 1e-5, "{heavy} rad");
    assert!(free > 0.1, "{free} rad: the body must matter to the motor");
}

#[test]
fn the_first_push_finds_the_bodys_inertia() {
    // On a backbone of next to no mass and stiffness module 0 is a free plate. At rest with the bolt ahead, θ″ being the
    // shaft's acceleration against the plate, ψ″ the plate's and v′ sideways, the bolt goes with a = v′ + r (θ″ + ψ″):
    //   motor    T = J θ″ + J/n ψ″ + own (θ″ + ψ″) + m r a
    //   spin     0 = plate ψ″ + J/n θ″ + own (θ″ + ψ″) + m r a       about the plate's centre, on the shaft
    //   momentum 0 = M v′ + m a
    let mut robot = quiet_robot();
    let mut plan = planar(&mut robot);
    plan.modules[1].mass = 1e-9;
    plan.backbones[0].segment_mass = 1e-12;
    plan.backbones[0].stiffness = [1e-9; 3];
    let (module, eccentric) = (plan.modules[0], plan.eccentric.unwrap());
    let settings = Settings { start_angle: Some(0.0), ..stepwise(&mut robot, 1e-6) };
    let mut robots = alone(&robot, plan, &settings);
    let steps = 200;
    for _ in 0..steps {
        robots.advance(&[drive(1.0)]);
    }
    let time = 1e-6 * f64::from(steps);
    let measured = robots.truth(0).speed / time;

    let (k, r_ohm) = (robot.motor.torque_constant_nm_per_a.value, robot.motor.resistance_ohm.value);
    let torque = k * robot.supply.rail_v.value / r_ohm;
    let rotor = robot.motor.rotor_inertia_kg_m2.value;
    let spin = rotor / robot.motor.gear_ratio.value;
    let (m, r, own) = (eccentric.mass, eccentric.radius, eccentric.inertia[0]);
    let plate = module.mass * (module.size[0].powi(2) + module.size[1].powi(2)) / 12.0;
    let orbit = own + m * r * r * module.mass / (module.mass + m);
    let turned = -(spin + orbit) / (plate + orbit); // ψ″/θ″
    let inertia = rotor + spin * turned + orbit * (1.0 + turned);
    let expected = torque / (inertia + 0.5 * time * k * k / r_ohm);
    let bare = torque / (rotor + own + m * r * r);
    println!("θ″ {measured:.0} rad/s², expected {expected:.0}, on a bench {bare:.0}");
    assert!((measured / expected - 1.0).abs() < 5e-3, "{measured} against {expected}");
    assert!(expected > 1.2 * bare);
}

/// Angle of a part about the vertical, rad.
fn yaw(orientation: &[f64; 4]) -> f64 {
    wrap(2.0 * orientation[3].atan2(orientation[0]))
}

/// Mass and moment of inertia about the vertical of every box, front to rear, modules first; and where they are.
fn boxes(plan: &Plan) -> Vec<(f64, f64)> {
    let plate = |mass: f64, x: f64, y: f64| (mass, mass * (x * x + y * y) / 12.0);
    let modules = plan.modules.iter().map(|module| plate(module.mass, module.size[0], module.size[1]));
    let segments = plan
        .backbones
        .iter()
        .flat_map(|b| (0..b.segments).map(move |_| plate(b.segment_mass, b.length / b.segments as f64, b.section[0])));
    modules.chain(segments).collect()
}

/// Spin about the vertical through the origin (kg·m²/s) and energy (J) of everything in the plane at the middle of the
/// second of three snapshots a step apart, the gearmotor's rotor included.
fn spin_and_energy(plan: &Plan, robot: &Robot, around: &[Snapshot; 3], step_s: f64) -> (f64, f64) {
    let [before, now, after] = around;
    let rate = |a: f64, b: f64| (b - a) / (2.0 * step_s);
    let (mut spin, mut energy) = (0.0, 0.0);
    let parts = |s: &Snapshot| s.modules.iter().chain(&s.segments).copied().collect::<Vec<_>>();
    let (a, b, c) = (parts(before), parts(now), parts(after));
    for (i, (mass, inertia)) in boxes(plan).into_iter().enumerate() {
        let (x, y) = (b[i].position[0], b[i].position[1]);
        let velocity = [0, 1].map(|axis| rate(a[i].position[axis], c[i].position[axis]));
        let turning = rate(yaw(&a[i].orientation), yaw(&c[i].orientation));
        spin += mass * (x * velocity[1] - y * velocity[0]) + inertia * turning;
        energy += 0.5 * mass * (velocity[0].powi(2) + velocity[1].powi(2)) + 0.5 * inertia * turning.powi(2);
    }
    let eccentric = plan.eccentric.unwrap();
    let [bolt_before, bolt, bolt_after] = [before, now, after].map(|s| s.rotor.unwrap());
    let velocity = [0, 1].map(|axis| rate(bolt_before.bolt[axis], bolt_after.bolt[axis]));
    let shaft = rate(bolt_before.angle, bolt_after.angle);
    let turning = rate(yaw(&a[0].orientation), yaw(&c[0].orientation));
    let rotor = robot.motor.rotor_inertia_kg_m2.value;
    let geared = rotor / robot.motor.gear_ratio.value;
    spin += eccentric.mass * (bolt.bolt[0] * velocity[1] - bolt.bolt[1] * velocity[0]);
    spin += eccentric.inertia[0] * (shaft + turning) + geared * shaft;
    energy += 0.5 * eccentric.mass * (velocity[0].powi(2) + velocity[1].powi(2));
    energy += 0.5 * eccentric.inertia[0] * (shaft + turning).powi(2);
    energy += 0.5 * rotor * shaft * shaft + geared * shaft * turning;
    // The soft hinges between module 0, the segments (the last is part of module 1).
    let chain: Vec<f64> =
        std::iter::once(&b[0]).chain(&b[plan.modules.len()..]).map(|pose| yaw(&pose.orientation)).collect();
    energy += chain.windows(2).map(|w| 0.5 * plan.backbones[0].stiffness[2] * (w[1] - w[0]).powi(2)).sum::<f64>();
    (spin, energy)
}

#[test]
fn spin_and_energy_of_the_whole_are_kept_in_flight() {
    let mut robot = quiet_robot();
    let plan = planar(&mut robot);
    let step_s = 2e-5;
    let settings = stepwise(&mut robot, step_s);
    let mut robots = alone(&robot, plan.clone(), &settings);
    let (k, ohm) = (robot.motor.torque_constant_nm_per_a.value, robot.motor.resistance_ohm.value);
    let mut around = vec![robots.snapshot(0)];
    let (mut worst_spin, mut worst_energy, mut turned) = (0.0f64, 0.0f64, 0.0f64);
    let (mut done, mut power, mut lost) = (0.0, 0.0, 0.0);
    for tick in 0..10_000 {
        robots.advance(&[drive(if tick < 6000 { 1.0 } else { -1.0 })]);
        let truth = robots.truth(0);
        // Work of the magnetic torque, and heat, by the trapezoidal rule. The duty's jump is not smooth: leave it out.
        let next = k * truth.current * truth.speed;
        done += if tick == 0 || tick == 6000 { next } else { 0.5 * (power + next) } * step_s;
        lost += ohm * truth.current.powi(2) * step_s;
        power = next;
        around.push(robots.snapshot(0));
        if around.len() < 3 {
            continue;
        }
        let three: &[Snapshot; 3] = around[..].try_into().unwrap();
        let (spin, energy) = spin_and_energy(&plan, &robot, three, step_s);
        let scale = 1.5e-6 / robot.motor.gear_ratio.value * 50.0;
        worst_spin = worst_spin.max(spin.abs() / scale);
        // The middle snapshot is a step old.
        let input = done - power * step_s;
        worst_energy = worst_energy.max((energy - input).abs());
        turned = turned.max(yaw(&three[1].modules[0].orientation).abs());
        around.remove(0);
    }
    println!("in {:.3} J, heat {lost:.3} J, work {done:.4} J", robots.energy_j(0));
    println!(
        "spin off by {worst_spin:.1e} of the rotor's, energy by {worst_energy:.1e} J; module 1 turned {turned:.2} rad"
    );
    assert!(turned > 0.05);
    assert!(worst_spin < 0.01, "{worst_spin}");
    assert!(worst_energy < 0.01 * done.abs().max(1e-3), "{worst_energy} J of {done} J");
    assert!((robots.energy_j(0) - lost - done).abs() < 0.01 * robots.energy_j(0), "electrical = heat + work");
}

#[test]
fn a_torque_from_outside_loads_the_teeth() {
    let load_friction = Some(LoadFriction { coefficient: 0.2, presliding_rad: 3e-3 });
    let shaft = Shaft { laws: Laws { load_friction, ..Laws::NONE }, viscous: 0.0, ..LINEAR };
    let mut state = ShaftState { bristle: 1.0, speed: 50.0, ..ShaftState::default() };
    let torque = 1e-3;
    for _ in 0..100 {
        shaft.stepper(STEP).advance_under(&mut state, Terminals::Open, torque);
    }
    // Nothing but the torque and the friction of its own transmission.
    let expected = 50.0 + (1.0 - 0.2) * torque / shaft.inertia_kg_m2 * 100.0 * STEP;
    assert!((state.speed - expected).abs() < 1e-9 * expected, "{} rad/s, expected {expected}", state.speed);
}

/// The shaft's angle in the end with 5, 10, 20, 40 steps a tick, less that with 320, rad.
fn left_by_steps(robot: &Robot, plan: &Plan, time_s: f64) -> Vec<f64> {
    let run = |steps_per_tick: usize| {
        let settings = Settings { steps_per_tick, ..settings() };
        *angles(alone(robot, plan.clone(), &settings), time_s).last().unwrap()
    };
    let reference = run(320);
    [5, 10, 20, 40].iter().map(|&steps| (run(steps) - reference).abs()).collect()
}

#[test]
fn the_coupling_is_of_second_order() {
    // No friction, no dead time: nothing but the coupling and smooth motion.
    let mut smooth = quiet_robot();
    let mut plan = planar(&mut smooth);
    plan.backbones[0].damping = Plan::new(&smooth).unwrap().backbones[0].damping;
    let errors = left_by_steps(&smooth, &plan, 0.2);
    let orders: Vec<f64> = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    println!("smooth: {errors:?} rad, orders {orders:.2?}");
    assert!(orders.iter().all(|order| *order > 1.8), "{orders:?}");

    let robot = default_robot();
    let mut plan = Plan::new(&robot).unwrap();
    in_space(&mut plan);
    let errors = left_by_steps(&robot, &plan, 0.3);
    println!("the robot: {errors:?} rad");
    assert!(errors[1] < 2e-5, "{errors:?}");
}

/// State of a robot as text, for comparing bits.
fn everything(robots: &WalkingRobots, i: usize) -> String {
    format!("{:?} {:?} {:?}", robots.truth(i), robots.snapshot(i), robots.energy_j(i))
}

#[test]
fn a_group_is_so_many_robots_alone_and_a_clone_goes_on() {
    let robot = default_robot();
    let duties: [f32; 5] = [0.9, -0.6, 0.3, 1.0, 0.0];
    let walker = |seed: u64| Walker::new(&robot, seed, &Settings::default()).unwrap();
    let mut group = WalkingRobots::new((0..5).map(walker).collect(), Precision::Double).unwrap();
    let mut single: Vec<_> =
        (0..5).map(|seed| WalkingRobots::new(vec![walker(seed)], Precision::Double).unwrap()).collect();
    for _ in 0..100 {
        let readings: Vec<_> = (0..5).map(|i| group.sample(i)).collect();
        group.advance(&duties.map(drive));
        for ((robot, duty), reading) in single.iter_mut().zip(duties).zip(readings) {
            assert_eq!(robot.sample(0), reading);
            robot.advance(&[drive(duty)]);
        }
    }
    for (i, robot) in single.iter().enumerate() {
        assert_eq!(everything(&group, i), everything(robot, 0), "robot {i}");
    }
    let mut clone = group.clone();
    let before = everything(&group, 1);
    clone.advance(&duties.map(drive));
    assert_eq!(before, everything(&group, 1));
    group.advance(&duties.map(drive));
    assert_eq!(everything(&clone, 1), everything(&group, 1));
    assert_ne!(before, everything(&group, 1));
}

#[test]
fn a_fault_reaches_its_robot_alone() {
    let robot = default_robot();
    let walkers = (0..2).map(|_| Walker::new(&robot, 3, &settings()).unwrap()).collect();
    let mut robots = WalkingRobots::new(walkers, Precision::Double).unwrap();
    robots.schedule(1, Fault::Stalled, 0.2);
    for _ in 0..300 {
        robots.advance(&[drive(0.9), drive(0.9)]);
    }
    assert!(robots.truth(0).speed > 10.0, "{}", robots.truth(0).speed);
    assert_eq!(robots.truth(1).speed, 0.0);
    let finite = |pose: &hal_sim::body::snapshot::Pose| pose.position.iter().all(|x| x.abs() < 1.0);
    assert!(
        robots.snapshot(1).modules.iter().all(finite),
        "a shaft that jams shakes the body, but not out of the world"
    );
}

#[test]
fn a_tilted_bench_does_not_pull_at_a_walking_robots_shaft() {
    let mut robot = default_robot();
    let mut held = Plan::new(&robot).unwrap();
    held.clamped = Some(0);
    let level = angles(alone(&robot, held.clone(), &settings()), 0.2);
    let quantity = |value: f64| robot_file::robot::Quantity { value, ..robot.load.inertia_kg_m2.clone() };
    robot.effects.insert::<GravityTilt>(vec![quantity(3e-4), quantity(40.0)]);
    assert_eq!(level, angles(alone(&robot, held, &settings()), 0.2));
    // Where the ground slopes, the body's own gravity does.
    let mut leaning = Plan::new(&robot).unwrap();
    leaning.clamped = Some(0);
    leaning.gravity = [-9.81 * 0.5, 0.0, -9.81 * 0.75f64.sqrt()];
    let apart = largest_apart(&level, &angles(alone(&robot, leaning, &settings()), 0.2));
    assert!(apart > 1e-3, "{apart} rad");
}

#[test]
fn what_makes_no_group_is_refused() {
    let robot = default_robot();
    let walker = |robot: &Robot, settings: &Settings| Walker::new(robot, 1, settings).unwrap();
    let group = |walkers: Vec<Walker>| WalkingRobots::new(walkers, Precision::Double).unwrap_err().to_string();
    assert!(group(vec![]).contains("at least one robot"));
    let finer = Settings { steps_per_tick: 20, ..Settings::default() };
    let message = group(vec![walker(&robot, &Settings::default()), walker(&robot, &finer)]);
    assert!(message.contains("0.001 s in steps of 0.00005 s") && message.contains("0.0001 s"), "{message}");
    let bench = Robot::load(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/bench-linear.toml"));
    let message = Walker::new(&bench.unwrap(), 1, &Settings::default()).unwrap_err().to_string();
    assert!(message.contains("no [body]"), "{message}");
}
