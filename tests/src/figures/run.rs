//! Running campaigns: robots, seeds, and how single runs are put together to a figure.

use std::path::Path;

use control::{Controller, Parameters, Stroke};
use hal_sim::{Settings, SimulatedRobot};
use rayon::prelude::*;
use robot_file::design::design;
use robot_file::robot::Robot;
use simulation::{Drive, DriveCommand, Metrics, Plan, Trace, closed_loop, metrics};

/// Robot of `robot.toml` with its designed controller.
#[derive(Clone, Debug)]
pub struct DesignedRobot {
    /// Robot of `robot.toml`.
    pub robot: Robot,
    /// Its designed controller.
    pub parameters: Parameters,
}

impl DesignedRobot {
    /// The project's `robot.toml`.
    ///
    /// # Panics
    /// When the file is not there or no controller follows from it: there is nothing to measure then.
    #[must_use]
    pub fn new() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
        let robot = Robot::load(&path).unwrap_or_else(|error| panic!("{error}"));
        let parameters = design(&robot).unwrap_or_else(|error| panic!("{error}")).parameters;
        Self { robot, parameters }
    }
}

impl Default for DesignedRobot {
    fn default() -> Self {
        Self::new()
    }
}

/// Runs a controller on a specimen.
///
/// # Panics
/// When the controller refuses its parameters.
#[must_use]
pub fn trace(robot: &Robot, parameters: &Parameters, seed: u64, plan: &Plan) -> Trace {
    let controller = Controller::new(parameters).unwrap_or_else(|error| panic!("{error}"));
    closed_loop(SimulatedRobot::with(robot, seed, &Settings::default()), controller, plan)
}

/// Runs one order and judges it.
#[must_use]
pub fn run(robot: &Robot, parameters: &Parameters, seed: u64, command: DriveCommand, seconds: f64) -> Metrics {
    metrics(&trace(robot, parameters, seed, &plan(command, seconds)))
}

/// One order, nothing breaks.
#[must_use]
pub fn plan(command: DriveCommand, seconds: f64) -> Plan {
    Plan { drive: Drive::constant(command), seconds, faults: Vec::new() }
}

/// The oscillation that the figures are about.
#[must_use]
pub fn swing(style: Stroke) -> DriveCommand {
    DriveCommand::Oscillate { from_deg: -100.0, to_deg: 100.0, style }
}

/// What `one` gives for every seed, on all cores, in the order of the seeds.
pub fn for_seeds<T: Send>(seeds: u64, one: impl Fn(u64) -> T + Send + Sync) -> Vec<T> {
    (0..seeds).into_par_iter().map(one).collect()
}

/// The largest, 0 of nothing. A NaN counts as infinite.
#[must_use]
pub fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(|value| if value.is_nan() { f64::INFINITY } else { value }).fold(0.0, f64::max)
}

/// The middle one; infinite of nothing.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    common::median(&mut values).unwrap_or(f64::INFINITY)
}

/// Root of the mean square; infinite where a value is missing.
#[must_use]
pub fn pooled(values: impl IntoIterator<Item = Option<f64>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value.map_or(f64::INFINITY, |value| value * value);
        count += 1.0;
    }
    f64::sqrt(sum / count)
}

/// Relative deviation of the mean frequency from its target; infinite where there is none.
#[must_use]
pub fn frequency_error(metrics: &Metrics) -> f64 {
    match (metrics.mean_frequency_hz, metrics.target_frequency_hz) {
        (Some(mean), Some(target)) => (mean / target - 1.0).abs(),
        _ => f64::INFINITY,
    }
}

/// Within 0.1 % of what was asked for; an error that is NaN does not count.
#[must_use]
pub fn holds_frequency(metrics: &Metrics) -> bool {
    frequency_error(metrics) <= 1e-3
}
