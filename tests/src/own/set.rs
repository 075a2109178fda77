//! A set: one robot, one specimen, runs to fit and runs held out; and what a diagnosis says about it.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use diagnose::{Cause, DiagnoseError, Diagnosis, Options, Verdict, diagnose};
use effects::{Effect, Id, Parameter, SensorNonlinearity};
use hal_sim::Settings;
use rayon::prelude::*;
use recording::Recording;
use robot_file::robot::{Correction, Robot, Sensor};
use simulation::{Drive, DriveCommand, Place, Plan, Walk, recording, run};

use super::drives::{KINDS, RUN_S, drive};
use crate::blind::score::LARGEST_CLASS;

/// Runs of a set, one of each kind of drive, and how many of them are held out.
const RUNS: (usize, usize) = (12, 4);

/// Size of a nonlinearity that is stated for a set, as a share of the half ranges that the file gives.
const STATED: f64 = 0.7;

/// What a set's diagnosis should say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// The file is the simulator's own: nothing.
    Nothing,
    /// This effect was taken out of the file.
    Missing(Id),
}

/// A set before it is simulated.
#[derive(Clone, Copy, Debug)]
pub struct Set {
    /// Seed of the specimen.
    pub seed: u64,
    /// `robot.toml` or a file of `robots/`.
    pub robot: &'static str,
    /// The file has the correction that a calibration run of this specimen gives.
    pub calibrated: bool,
    /// It walks on the ground; else it is its shaft alone on a bench.
    pub on_ground: bool,
    /// First kind of its runs.
    pub first_kind: usize,
    /// What should be said.
    pub expected: Expected,
}

/// What was said.
pub struct Outcome {
    /// The set.
    pub set: Set,
    /// The diagnosis.
    pub said: Result<Diagnosis, DiagnoseError>,
    /// Wall-clock time of the diagnosis, s.
    pub seconds: f64,
}

impl Outcome {
    /// Whether it says what it should: nothing, or the one missing effect, be it in a class with others that the recordings
    /// do not tell from it, as large as the blind campaign allows.
    #[must_use]
    pub fn right(&self) -> bool {
        let Ok(said) = &self.said else { return false };
        match self.set.expected {
            Expected::Nothing => said.verdict == Verdict::Nothing,
            Expected::Missing(id) => {
                let [cause] = said.causes.as_slice() else { return false };
                names(cause, id) && cause.also.len() < LARGEST_CLASS
            }
        }
    }

    /// Whether it says so with no other name beside it.
    #[must_use]
    pub fn alone(&self) -> bool {
        let causes = self.said.as_ref().map_or(&[][..], |said| said.causes.as_slice());
        self.right() && causes.iter().all(|cause| cause.also.is_empty())
    }

    /// Whether it names a cause that is not missing.
    #[must_use]
    pub fn false_name(&self) -> bool {
        let causes = self.said.as_ref().map_or(&[][..], |said| said.causes.as_slice());
        match self.set.expected {
            Expected::Nothing => !causes.is_empty(),
            Expected::Missing(id) => causes.iter().any(|cause| !names(cause, id)),
        }
    }

    /// One line.
    #[must_use]
    pub fn line(&self) -> String {
        let Set { seed, robot, calibrated, on_ground, first_kind, expected } = self.set;
        let calibrated = if calibrated { ", calibrated" } else { "" };
        let on_ground = if on_ground { ", on the ground" } else { "" };
        let said = match &self.said {
            Ok(said) => {
                let names: Vec<String> =
                    said.causes.iter().map(|one| format!("{} {:?}", one.effect, one.also)).collect();
                let floor = said.noise_floor;
                format!(
                    "{} {} before {:.3} after {:.3} of {:.3}°",
                    said.verdict.word(),
                    names.join(" + "),
                    said.before / floor,
                    said.after / floor,
                    floor.to_degrees()
                )
            }
            Err(error) => error.to_string(),
        };
        let mark = if self.right() { "ok  " } else { "MISS" };
        format!(
            "{mark} seed {seed} {robot}{calibrated}{on_ground} drives {first_kind}: {expected:?}: {said} ({:.1} s)",
            self.seconds
        )
    }
}

fn names(cause: &Cause, id: Id) -> bool {
    cause.effect == id.name() || cause.also.iter().any(|also| also == id.name())
}

fn load(name: &str) -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    Robot::load(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// Sets in turn over robots, calibration and drives; with `missing`, each with one listed effect taken out of its file.
#[must_use]
pub fn sets(count: usize, seed: u64, missing: bool) -> Vec<Set> {
    in_turn(&["robot.toml", "robots/motor-136.toml"], false, count, seed, missing)
}

/// The same of walks of `robot.toml`.
#[must_use]
pub fn walks(count: usize, seed: u64, missing: bool) -> Vec<Set> {
    in_turn(&["robot.toml"], true, count, seed, missing)
}

fn in_turn(robots: &[&'static str], on_ground: bool, count: usize, seed: u64, missing: bool) -> Vec<Set> {
    let one = |i: usize| {
        let (robot, calibrated) = (robots[i % robots.len()], i / robots.len() % 2 == 1);
        let taken_out = || taken_out(i / (2 * robots.len()), calibrated);
        let expected = if missing { Expected::Missing(taken_out()) } else { Expected::Nothing };
        Set { seed: seed + i as u64, robot, calibrated, on_ground, first_kind: (i * 5) % KINDS, expected }
    };
    (0..count).map(one).collect()
}

/// Which effect is taken out: of those that the files list and that such runs show. A calibrated file's correction has the
/// sensor's nonlinearity in it already. `battery_sag`, 0.15 Ω beside a winding of 15, is within the refit of that winding.
fn taken_out(i: usize, calibrated: bool) -> Id {
    let names: &[&str] = if calibrated {
        &["coulomb_friction", "driver_drop"]
    } else {
        &["coulomb_friction", "sensor_nonlinearity", "driver_drop"]
    };
    Id::of(names[i % names.len()]).unwrap_or_else(|| panic!("the catalogue lost {}", names[i % names.len()]))
}

/// Simulates a set and diagnoses it.
///
/// # Panics
/// A file of the project does not load, or its robot does not run.
#[must_use]
pub fn examine(set: Set) -> Outcome {
    let mut robot = load(set.robot);
    let correction = if set.calibrated { correction(&robot, set.seed) } else { None };
    let set = Set { calibrated: correction.is_some(), ..set };
    if let Sensor::Potentiometer(potentiometer) = &mut robot.sensor {
        potentiometer.correction = correction;
    }
    let top = robot_file::design::ceiling(&robot) / std::f64::consts::TAU;
    if matches!(set.expected, Expected::Missing(id) if id.name() == SensorNonlinearity::SPEC.name) {
        state_nonlinearity(&mut robot, set.seed);
    }
    let record = |i: usize| {
        let drive = drive(set.first_kind + i * 5, top);
        if set.on_ground { walk(&robot, set.seed, drive) } else { simulate(&robot, set.seed, drive) }
    };
    let runs: Vec<Recording> = (0..RUNS.0).into_par_iter().map(record).collect();
    if let Expected::Missing(id) = set.expected {
        assert!(robot.effects.remove(id.name()), "{} does not list {}", set.robot, id.name());
    }
    let (fit, held_out) = runs.split_at(RUNS.0 - RUNS.1);
    let clock = Instant::now();
    let said = diagnose(&robot, fit, held_out, &Options::default());
    Outcome { set, said, seconds: clock.elapsed().as_secs_f64() }
}

/// States the sensor's nonlinearity as of an identified sensor: each number at [`STATED`] of its half range, with signs from
/// the seed. The file knows ranges about zero only, and a specimen drawn from them may have next to none of it.
fn state_nonlinearity(robot: &mut Robot, seed: u64) {
    let spec = SensorNonlinearity::SPEC;
    let stated = |(i, key): (usize, &Parameter)| {
        let mut quantity = robot.effects.quantity(spec.name, key.key)?.clone();
        let half_range = 0.5 * (quantity.high - quantity.low);
        quantity.value = if seed >> i & 1 == 1 { STATED * half_range } else { -STATED * half_range };
        Some(quantity)
    };
    let quantities = spec.parameters.iter().enumerate().filter_map(stated).collect();
    robot.effects.insert::<SensorNonlinearity>(quantities);
}

fn simulate(robot: &Robot, seed: u64, drive: Drive) -> Recording {
    let plan = Plan { drive, seconds: RUN_S, faults: Vec::new() };
    let trace = run(robot, seed, &Settings::default(), &plan).unwrap_or_else(|error| panic!("{error}"));
    recording(&trace, robot)
}

fn walk(robot: &Robot, seed: u64, drive: Drive) -> Recording {
    let plan = Plan { drive, seconds: RUN_S, faults: Vec::new() };
    let ran = simulation::simulate(robot, robot, Place::Ground, seed, &plan, &AtomicBool::new(false))
        .unwrap_or_else(|error| panic!("{error}"));
    Recording { pose: ran.walk.as_ref().map_or_else(Vec::new, Walk::poses_of_rows), ..recording(&ran.trace, robot) }
}

/// The correction that a calibration run of the specimen gives, as `scram identify potentiometer` does; `None` where it
/// refuses the run.
fn correction(robot: &Robot, seed: u64) -> Option<Correction> {
    let run = simulate(robot, seed, Drive::constant(DriveCommand::Duty { duty: 0.95 }));
    identify::potentiometer::potentiometer(robot, &run).ok().map(|fit| fit.correction)
}
