//! The robot files that come with the project.

use std::path::{Path, PathBuf};

use robot_file::Robot;
use robot_file::robot::{ModuleKind, Sensor};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn load(name: &str) -> Robot {
    Robot::load(&root().join(name)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_robot_file_loads() {
    let mut names = vec!["robot.toml".to_owned()];
    let entries = std::fs::read_dir(root().join("robots")).unwrap().map(Result::unwrap);
    for entry in entries.filter(|entry| entry.path().is_file()) {
        names.push(format!("robots/{}", entry.file_name().to_string_lossy()));
    }
    assert!(names.len() >= 4, "{names:?}");
    let robots: Vec<_> = names.iter().map(|name| load(name).name).collect();
    let mut unique = robots.clone();
    unique.sort();
    unique.dedup();
    assert_eq!(unique.len(), robots.len(), "two robots with one name: {robots:?}");
}

#[test]
fn the_linear_bench_has_no_effects() {
    let bench = load("robots/bench-linear.toml");
    assert_eq!(bench.effects, robot_file::robot::Effects::default());
    assert_eq!(bench.sensor, Sensor::Ideal);
    assert_eq!(bench.supply.battery, None);
    assert_eq!(bench.driver.pwm_steps.value, 0.0);
    assert!(bench.controller.is_some());
    assert_eq!(bench.motor, load("robot.toml").motor);
    assert_eq!((&bench.body, &bench.eccentric), (&None, &None));
}

#[test]
fn the_two_module_bench_differs_in_modules_and_ground_only() {
    let (bench, mut robot) = (load("robots/bench-two-modules.toml"), load("robot.toml"));
    let body = robot.body.as_mut().unwrap();
    body.modules = vec![ModuleKind::Actuator, ModuleKind::Passive];
    body.clamped_module = Some(2.0);
    robot.ground.as_mut().unwrap().steps_m = Some(vec![[-100.0, -0.1]]);
    (robot.name, robot.summary) = (bench.name.clone(), bench.summary.clone());
    assert_eq!(bench, robot);
}

/// What walking takes from the shaft on average at full voltage, N·m: 0.29 to 0.37 mN·m (docs/body.md).
const WALKING_NM: f64 = 0.3e-3;

/// The highest steady frequency under a load (N·m), Hz, from the file's own nominal numbers.
fn ceiling_hz(robot: &Robot, load_nm: f64) -> f64 {
    let motor = &robot.motor;
    let drop = robot.effects.get::<effects::DriverDrop>().unwrap();
    let sag = robot.effects.get::<effects::BatterySag>().unwrap();
    let friction = robot.effects.get::<effects::CoulombFriction>().unwrap().torque_nm + load_nm;
    let k = motor.torque_constant_nm_per_a.value;
    let resistance = motor.resistance_ohm.value + drop.slope_ohm + sag.resistance_ohm + sag.relaxation_ohm;
    // k i = friction + b ω and k ω = supply − drop − resistance i
    let voltage = robot.supply.rail_v.value - drop.drop_v;
    let damping = k + resistance * motor.viscous_nm_s_per_rad.value / k;
    (voltage - resistance * friction / k) / damping / std::f64::consts::TAU
}

#[test]
fn the_motors_reach_what_the_thesis_says() {
    let fast = ceiling_hz(&load("robot.toml"), WALKING_NM);
    assert!((8.5..9.5).contains(&fast), "26:1: {fast} Hz");
    let slow = ceiling_hz(&load("robots/motor-136.toml"), 0.0);
    assert!(slow < 6.0, "136:1: {slow} Hz");
}
