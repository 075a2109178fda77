//! The closed loop to the shaft against real time. `cargo bench -p system-tests`. (The tick alone: `-p control`.)
//!
//! One simulated second in less than 2 ms is 500 times real time.

use std::path::Path;

use common::conventions::omega_from_frequency;
use control::{Command, Controller};
use hal_sim::SimulatedRobot;
use robot_file::robot::Robot;

fn main() {
    divan::main();
}

fn hold() -> Command {
    Command::Speed { omega: omega_from_frequency(7.0) as f32 }
}

/// The default robot after a second at 7 Hz.
fn settled() -> (SimulatedRobot, Controller) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    let file = Robot::load(&path).unwrap_or_else(|error| panic!("{error}"));
    let design = robot_file::design::design(&file).unwrap_or_else(|error| panic!("{error}"));
    let mut controller = Controller::new(&design.parameters).unwrap_or_else(|error| panic!("{error}"));
    let mut robot = SimulatedRobot::new(&file, 1);
    one_second(&mut robot, &mut controller);
    (robot, controller)
}

fn one_second(robot: &mut SimulatedRobot, controller: &mut Controller) {
    for tick in 0..1000 {
        let sample = robot.sample();
        if tick % 100 == 0 {
            controller.command(hold(), sample.time_us).unwrap_or_else(|refusal| panic!("{refusal:?}"));
        }
        robot.advance(controller.tick(&sample));
    }
}

/// One second of robot and controller, every nuisance on, one thread.
#[divan::bench]
fn one_second_of_the_closed_loop(bencher: divan::Bencher) {
    let (robot, controller) = settled();
    bencher.with_inputs(|| (robot.clone(), controller)).bench_local_values(|(mut robot, mut controller)| {
        one_second(&mut robot, &mut controller);
        robot.truth()
    });
}
