//! How fast bodies walk: 1000 steps of 0.1 ms, 97 degrees of freedom on the ground. `cargo bench -p hal-sim --bench body`;
//! beside MuJoCo: `cargo body-figures --only rate`.

use std::f64::consts::TAU;
use std::path::Path;

use divan::counter::ItemsCount;
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings};
use robot_file::robot::Robot;

fn main() {
    divan::main();
}

fn walk(bencher: divan::Bencher, bodies: usize, precision: Precision) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    let robot = Robot::load(&path).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&robot).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings { precision, ..Settings::default() };
    let drives = vec![Drive::Phase { speed: 7.0 * TAU }; bodies];
    let mut walking = Ensemble::new(&vec![plan; bodies], settings).unwrap_or_else(|error| panic!("{error}"));
    // Past the landing: all feet at work.
    walking.advance(2000, &drives);
    bencher
        .counter(ItemsCount::new(1000 * bodies))
        .with_inputs(|| walking.clone())
        .bench_local_values(|mut walking| walking.advance(1000, &drives));
}

/// One robot.
#[divan::bench]
fn one_robot(bencher: divan::Bencher) {
    walk(bencher, 1, Precision::Double);
}

/// As many as a sweep puts together.
#[divan::bench(args = [8, 24])]
fn robots_in_double_precision(bencher: divan::Bencher, bodies: usize) {
    walk(bencher, bodies, Precision::Double);
}

/// The same with half the digits.
#[divan::bench(args = [8, 24])]
fn robots_in_single_precision(bencher: divan::Bencher, bodies: usize) {
    walk(bencher, bodies, Precision::Single);
}
