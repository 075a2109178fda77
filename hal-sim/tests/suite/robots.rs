//! Every robot file of the project runs.

use std::path::Path;

use crate::common::{default_robot, drive};
use hal_sim::body::WalkingRobots;
use hal_sim::{Settings, SimulatedRobot};
use robot_file::robot::Robot;

/// Shaft frequency (Hz) after two seconds at full duty.
fn ceiling(robot: &Robot) -> f64 {
    let settings = Settings { charge: Some(0.8), ..Settings::default() };
    let mut simulated = SimulatedRobot::with(robot, 1, &settings);
    for _ in 0..2000 {
        simulated.sample();
        simulated.advance(drive(1.0));
    }
    simulated.truth().speed / std::f64::consts::TAU
}

#[test]
fn the_default_robot_reaches_the_theses_nine_hertz_as_it_walks() {
    let robot = default_robot();
    let mut walking = WalkingRobots::alone(&robot, 1, &Settings::default()).unwrap();
    let mut turned = 0.0;
    for tick in 0..2000 {
        walking.advance(&[drive(1.0)]);
        if tick >= 1000 {
            turned += walking.truth(0).speed * walking.tick_s();
        }
    }
    let (walking, bare) = (turned / std::f64::consts::TAU, ceiling(&robot));
    println!("{walking:.3} Hz on the ground, {bare:.3} Hz with the eccentric alone");
    assert!((8.0..9.5).contains(&walking), "{walking} Hz");
    assert!(bare > walking, "{bare} Hz");
}

#[test]
fn every_file_runs() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    let files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(!files.is_empty());
    for file in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "toml")) {
        let robot = Robot::load(file).unwrap_or_else(|error| panic!("{error}"));
        let ceiling = ceiling(&robot);
        println!("{}: {ceiling:.2} Hz at full duty", robot.name);
        assert!(ceiling.is_finite() && ceiling.abs() < 100.0, "{}: {ceiling} Hz", robot.name);
    }
}
