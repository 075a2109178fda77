//! Steps per second of the robot in `robot.toml` on one thread: alone in f64, in a batch of 24 in f64, and in f32, one
//! number a line. `cargo body-figures --only instructions` builds it for two instruction sets.

use std::time::Instant;

use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings};
use robot_file::Robot;

/// Steps of every body, after as many to warm up.
const STEPS: usize = 2000;

fn main() {
    let robot = Robot::load("robot.toml".as_ref()).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&robot).unwrap_or_else(|error| panic!("{error}"));
    for (bodies, precision) in [(1, Precision::Double), (24, Precision::Double), (24, Precision::Single)] {
        println!("{:.0}", rate(&vec![plan.clone(); bodies], precision));
    }
}

fn rate(plans: &[Plan], precision: Precision) -> f64 {
    let settings = Settings { precision, ..Settings::default() };
    let mut bodies = Ensemble::new(plans, settings).unwrap_or_else(|error| panic!("{error}"));
    let drives = vec![Drive::Servo { speed: 44.0, stiffness: 0.08, damping: 2.5e-4 }; plans.len()];
    bodies.advance(STEPS, &drives);
    let start = Instant::now();
    bodies.advance(STEPS, &drives);
    let rate = (STEPS * plans.len()) as f64 / start.elapsed().as_secs_f64();
    assert!(bodies.snapshot(0).centroid().iter().all(|x| x.is_finite()), "the robot has blown up");
    rate
}
