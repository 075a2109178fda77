//! Which runs, as options of a command line: of `scram sweep` and of whoever makes the same rows elsewhere.

use clap::{Args, ValueEnum};
use hal_sim::body::Precision;
use simulation::LONGEST_S;

use super::axis::{Axis, AxisError, Factor};
use super::design::{Design, MOST_RUNS};
use super::trial::{DriveKind, RunSettings, StepError};

/// Repeats of the thesis.
const REPEATS: u64 = 3;

/// Conditions, repeats, and how a run is made.
#[derive(Args, Clone, Debug)]
pub struct SweepArguments {
    /// What is varied: PATH=from:to:count or PATH=v1,v2,…; repeatable
    #[arg(long = "axis", value_name = "PATH=VALUES", allow_hyphen_values = true)]
    pub axes: Vec<String>,
    /// Runs of every condition, each with a seed of its own, from --seed on [default: 3; 1 for --search]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub repeats: Option<u64>,
    /// So many robots of one file, each with --repeats runs: what belongs to a robot, its sensor's (or phase) error, is drawn once for
    /// each, and it is said how far runs scatter and how far robots do
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub robots: u64,
    /// Length of a run, s
    #[arg(long, default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// Integration step, s; must go into 10 ms and into the robot's control period
    #[arg(long, value_name = "SECONDS", default_value_t = 1e-4)]
    pub step: f64,
    /// What turns the eccentric
    #[arg(long, value_enum, default_value_t = Turns::Motor)]
    pub drive: Turns,
    /// Phase error of the ideal shaft, root mean square, degrees
    #[arg(long, value_name = "DEG", default_value_t = 2.0, value_parser = phase_noise)]
    pub phase_noise: f64,
    /// Advance the bodies in single precision: about twice as fast
    #[arg(long)]
    pub single: bool,
    /// Run everything with 10 % more friction, too: sensitivity (5.2) and effectiveness (5.3)
    #[arg(long)]
    pub sensitivity: bool,
}

/// What turns the eccentric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Turns {
    /// The firmware's controller with the simulated motor, sensor and battery
    Motor,
    /// A shaft at exactly the frequency but for a start angle and a phase error
    Ideal,
}

/// Why there is no such sweep.
#[derive(Debug, Clone, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum ArgumentError {
    /// An axis is wrong.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Axis(#[from] AxisError),
    /// The step does not fit.
    #[error("--step {0}")]
    #[diagnostic(help("e.g. 1e-4, 2e-4, 5e-5"))]
    Step(#[from] StepError),
    /// A slip of the finger.
    #[error("{0} runs are more than {MOST_RUNS}")]
    #[diagnostic(help("fewer values or repeats; several sweeps into several directories"))]
    TooMany(usize),
}

fn between(text: &str, low: f64, high: f64, what: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(format!("{what} must be a number from {low} to {high}")),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    between(text, 0.1, LONGEST_S, "seconds")
}

fn phase_noise(text: &str) -> Result<f64, String> {
    between(text, 0.0, 90.0, "the phase error")
}

impl SweepArguments {
    /// How a run is made.
    #[must_use]
    pub fn settings(&self) -> RunSettings {
        let drive = match self.drive {
            Turns::Motor => DriveKind::Motor,
            Turns::Ideal => DriveKind::Ideal { phase_noise: self.phase_noise.to_radians() },
        };
        let precision = if self.single { Precision::Single } else { Precision::Double };
        RunSettings { drive, seconds: self.seconds, step_s: self.step, precision }
    }

    /// Whether the firmware's controller turns the eccentric.
    #[must_use]
    pub fn is_by_motor(&self) -> bool {
        self.drive == Turns::Motor
    }

    /// The seeds of every condition's runs, from one on.
    #[must_use]
    pub fn seeds(&self, first: u64) -> Vec<u64> {
        let count = self.repeats.unwrap_or(REPEATS) * self.robots;
        (0..count).map(|repeat| first.wrapping_add(repeat)).collect()
    }

    /// Seeds in a row that are of one robot.
    #[must_use]
    pub fn runs_a_robot(&self) -> usize {
        self.repeats.unwrap_or(REPEATS) as usize
    }

    /// What is swept over these axes, the thesis's where there is none; and whether paths are worth keeping: where frequency and α are all
    /// that varies a picture shows them.
    ///
    /// # Errors
    /// There are more runs than anybody means.
    pub fn design(&self, given: Vec<Axis>, first_seed: u64) -> Result<(Design, bool), ArgumentError> {
        let mut axes = if given.is_empty() { Design::thesis() } else { given };
        let seeds = self.seeds(first_seed);
        let count = Design::count(&axes, seeds.len());
        if count > MOST_RUNS {
            return Err(ArgumentError::TooMany(count));
        }
        let paths = axes.iter().all(|axis| matches!(axis.what, Factor::Frequency | Factor::Alpha));
        if self.sensitivity {
            axes.push(Design::friction_axis());
        }
        Ok((Design::product(axes, seeds).with_runs_a_robot(self.runs_a_robot()), paths))
    }
}
