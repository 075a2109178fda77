//! `scram.simulate_batch`: many robots side by side, as `scram sweep` runs them.

use std::path::Path;

use control::Stroke;
use hal_sim::body::Precision;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulation::{DriveCommand, LONGEST_S, Step};
use sweep::{Axis, Campaign, Design, DriveKind, Factor, Measures, PATH_POINTS, Run, RunSettings, SweepError};

use crate::arguments::whole;
use crate::errors::{InputError, wrong_input};
use crate::interrupt::interruptible;
use crate::robot::Robot;
use crate::simulate::parsed;

/// How the runs of a batch are made.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings<'py> {
    seconds: f64,
    step_s: f64,
    single: bool,
    /// Every seed is a run of the robot that the first seed draws.
    one_robot: bool,
    /// Phase error of an ideal shaft, rad; none for a motor.
    phase_noise: Option<f64>,
    threads: Bound<'py, PyAny>,
}

/// Runs every point with every seed. `points` has a row a point and a column a path.
#[pyfunction]
pub fn simulate_batch<'py>(
    py: Python<'py>,
    robot: &Robot,
    drives: Vec<String>,
    paths: Vec<String>,
    points: PyReadonlyArray2<'py, f64>,
    seeds: PyReadonlyArray1<'py, u64>,
    settings: Settings<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let threads = whole("threads", &settings.threads)?;
    let points: Vec<Vec<f64>> = points.as_array().outer_iter().map(|point| point.to_vec()).collect();
    let design = design(&drives, robot.path(), &paths, points, seeds.as_array().to_vec())?;
    let design = if settings.one_robot { design.clone().with_runs_a_robot(design.seeds.len()) } else { design };
    let shape = (design.points.len(), design.seeds.len());
    let run = run_settings(&settings)?;
    run.check_step(robot.robot()).map_err(|error| InputError::new_err(format!("step_s: {error}")))?;
    let builder = robot.builder().clone();
    let made = interruptible(py, move |stop| -> Result<Vec<Run>, SweepError> {
        identify::robot::in_pool(threads, || Campaign::new(&builder, design, run)?.outcomes_until(stop.flag()))
    })?;
    arrays(py, &made.map_err(|error| wrong_input(&error))?, shape)
}

fn run_settings(settings: &Settings<'_>) -> PyResult<RunSettings> {
    let Settings { seconds, step_s, .. } = *settings;
    if !(0.1..=LONGEST_S).contains(&seconds) {
        return Err(InputError::new_err(format!("seconds must be a number from 0.1 to {LONGEST_S}")));
    }
    let drive = settings.phase_noise.map_or(DriveKind::Motor, |phase_noise| DriveKind::Ideal { phase_noise });
    let precision = if settings.single { Precision::Single } else { Precision::Double };
    Ok(RunSettings { drive, seconds, step_s, precision })
}

/// The design of a batch: what the shaft does first, then the paths.
fn design(
    drives: &[String],
    robot_file: &Path,
    paths: &[String],
    points: Vec<Vec<f64>>,
    seeds: Vec<u64>,
) -> PyResult<Design> {
    let mut factors = vec![Factor::Frequency, Factor::Swing];
    for path in paths {
        let factor = Factor::parse(path).map_err(|why| InputError::new_err(format!("parameters: `{path}`: {why}")))?;
        if factors.contains(&factor) {
            let help = "what the shaft does is said by `drive`, everything else once";
            return Err(InputError::new_err(format!("parameters: `{path}` is there twice\n  help: {help}")));
        }
        factors.push(factor);
    }
    let mut whole = Vec::with_capacity(points.len());
    for (point, drive) in points.iter().zip(drives) {
        whole.push(shaft(drive, robot_file)?.into_iter().chain(point.iter().copied()).collect::<Vec<f64>>());
    }
    let axis = |(index, what): (usize, Factor)| Axis { what, values: whole.iter().map(|point| point[index]).collect() };
    let axes = factors.into_iter().enumerate().map(axis).collect();
    Ok(Design { axes, points: whole, seeds, runs_a_robot: 1 })
}

/// Frequency, Hz, and swing, degrees, of a drive.
fn shaft(drive: &str, robot_file: &Path) -> PyResult<[f64; 2]> {
    match parsed(drive, robot_file)?.steps.as_slice() {
        [Step { command: DriveCommand::Freq { hz }, .. }] => Ok([*hz, 0.0]),
        [Step { command: DriveCommand::Oscillate { from_deg, to_deg, style: Stroke::BangBang }, .. }]
            if (*from_deg == 0.0) != (*to_deg == 0.0) =>
        {
            Ok([sweep::USUAL_F_HZ, from_deg + to_deg])
        }
        _ => Err(InputError::new_err(format!(
            "drive `{drive}`: a batch turns or swings\n  help: freq:HZ, oscillate:0..DEG or oscillate:-DEG..0; `simulate` takes the others"
        ))),
    }
}

/// Measures of shape (points, seeds) and paths of shape (points, seeds, times, 2), NaN where a run has none.
fn arrays<'py>(py: Python<'py>, runs: &[Run], (points, seeds): (usize, usize)) -> PyResult<Bound<'py, PyDict>> {
    let arrays = PyDict::new(py);
    for (index, name) in Measures::names().into_iter().enumerate() {
        let column: Vec<f64> = runs.iter().map(|run| run.measures.values()[index].unwrap_or(f64::NAN)).collect();
        arrays.set_item(name, column.into_pyarray(py).reshape([points, seeds])?)?;
    }
    let mut path = Vec::with_capacity(runs.len() * PATH_POINTS * 2);
    for run in runs {
        match run.path.is_empty() {
            true => path.extend([f64::NAN; 2 * PATH_POINTS]),
            false => path.extend(run.path.iter().flatten()),
        }
    }
    arrays.set_item("path_mm", path.into_pyarray(py).reshape([points, seeds, PATH_POINTS, 2])?)?;
    arrays.set_item("notes", runs.iter().map(|run| run.note.as_str()).collect::<Vec<_>>())?;
    Ok(arrays)
}
