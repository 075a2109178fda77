//! How much faster than real time the simulated robot is. `cargo bench -p hal-sim`.

use std::path::Path;

use control::Actuation;
use hal_sim::shaft::{ShaftState, Terminals};
use hal_sim::{SimulatedRobot, plant};
use robot_file::robot::Robot;

fn main() {
    divan::main();
}

fn default_robot() -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    Robot::load(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// One simulated second of the whole robot, every nuisance on: below 1.2 ms leaves the controller half of the time at
/// 500 times real time.
#[divan::bench]
fn one_second_of_the_default_robot(bencher: divan::Bencher) {
    let robot = default_robot();
    bencher.with_inputs(|| SimulatedRobot::new(&robot, 1)).bench_local_values(|mut simulated| {
        for _ in 0..1000 {
            let sample = simulated.sample();
            let duty = if sample.time_us % 400_000 < 200_000 { 0.9 } else { -0.7 };
            simulated.advance(Actuation { duty, enable: true });
        }
        simulated.truth()
    });
}

/// One second of the shaft alone, 10 000 steps.
#[divan::bench]
fn one_second_of_the_shaft(bencher: divan::Bencher) {
    let stepper = plant::shaft(&default_robot()).stepper(1e-4);
    bencher.bench_local(|| {
        let mut state = ShaftState::default();
        for n in 0..10_000 {
            let voltage = if n % 4000 < 2000 { 4.5 } else { -3.5 };
            stepper.advance(&mut state, Terminals::Driven { voltage: divan::black_box(voltage) });
        }
        state
    });
}
