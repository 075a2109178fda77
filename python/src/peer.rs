//! What the calls of this package take when Rust makes them: the peers of `benches/overhead.py`, in one process with what is compared.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use hal_sim::body::Precision;
use pyo3::prelude::*;
use simulation::{Drive, Place, Plan};
use sweep::{Axis, Campaign, Design, DriveKind, Factor, RunSettings};

use crate::errors::wrong_input;
use crate::robot::Robot;

/// Time of a walk at 7 Hz by `simulation::simulate`, s.
#[pyfunction]
pub fn peer_walk(py: Python<'_>, robot: &Robot, seconds: f64, seed: u64) -> PyResult<f64> {
    let drive = Drive::parse("freq:7").map_err(|error| wrong_input(&error))?;
    let (plan, never) = (Plan { drive, seconds, faults: Vec::new() }, AtomicBool::new(false));
    py.detach(|| {
        let began = Instant::now();
        let ran = simulation::simulate(robot.robot(), robot.robot(), Place::Ground, seed, &plan, &never);
        let took = began.elapsed().as_secs_f64();
        ran.map(|_| took).map_err(|error| wrong_input(&error))
    })
}

/// Time of walks at 7 Hz with so many seeds by `sweep::Campaign`, over all cores, s.
#[pyfunction]
pub fn peer_batch(py: Python<'_>, robot: &Robot, seconds: f64, seeds: u64) -> PyResult<f64> {
    let axis = Axis { what: Factor::Frequency, values: vec![7.0] };
    let design = Design::product(vec![axis], (1..=seeds).collect());
    let settings = RunSettings { drive: DriveKind::Motor, seconds, step_s: 1e-4, precision: Precision::Double };
    py.detach(|| {
        let began = Instant::now();
        let made = || Campaign::new(robot.builder(), design, settings)?.outcomes();
        let runs = identify::robot::in_pool(0, made);
        let took = began.elapsed().as_secs_f64();
        runs.map(|_| took).map_err(|error| wrong_input(&error))
    })
}
