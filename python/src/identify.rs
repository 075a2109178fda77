//! `scram.identify_…`: parameters from measurements. Dictionaries for `scram/identification.py`: `said`, `svg`, `robot`.

use std::path::PathBuf;

use ::diagnose::{Known, Options, identify_motor as motor};
use ::identify::backbone::{self, Gravity, Oscillation, identify as backbone_fit};
use ::identify::capture;
use ::identify::potentiometer::{potentiometer, second_potentiometer};
use ::identify::robot::{self as walk, Held, Placement};
use miette::Diagnostic;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use plot::{oscillation_svg, residual_svg, speeds_svg, under_title};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use sweep::Measured;

use crate::diagnose::{extended, runs, usable};
use crate::errors::{InputError, failed, unusable_file, wrong_input};
use crate::interrupt::interruptible;
use crate::recording::Recording;
use crate::robot::Robot;

/// What was found, as Python sees it.
fn result<'py>(py: Python<'py>, said: &impl Serialize, svg: &str, robot: Robot) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("said", pythonize::pythonize(py, said)?)?;
    result.set_item("svg", svg)?;
    result.set_item("robot", robot)?;
    Ok(result)
}

fn refused<E: Diagnostic>(error: E) -> PyErr {
    wrong_input(&error)
}

/// The angle sensor's correction and blind arc from a run at constant voltage.
#[pyfunction]
#[pyo3(signature = (robot, run, *, second))]
pub fn identify_potentiometer<'py>(
    py: Python<'py>,
    robot: &Robot,
    run: PyRef<'py, Recording>,
    second: bool,
) -> PyResult<Bound<'py, PyDict>> {
    usable(robot, &run).map_err(refused)?;
    let (model, samples) = (robot.clone(), run.samples().clone());
    let mut document = robot.document().clone();
    if second {
        let fit = interruptible(py, move |_| second_potentiometer(model.robot(), &samples))?.map_err(refused)?;
        document.set_second_correction(&fit.own.correction).map_err(refused)?;
        document.set("sensor.second.offset_deg", &fit.offset).map_err(refused)?;
        return result(py, &fit, &residual_svg(&fit.own), robot.with(document)?);
    }
    let fit = interruptible(py, move |_| potentiometer(model.robot(), &samples))?.map_err(refused)?;
    document.set_correction(&fit.correction).map_err(refused)?;
    result(py, &fit, &residual_svg(&fit), robot.with(document)?)
}

/// A motor's numbers and its friction from bench runs.
#[pyfunction]
#[pyo3(signature = (robot, fit, holdout, *, resistance_ohm, inertia_kg_m2, seed, threads))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn identify_motor<'py>(
    py: Python<'py>,
    robot: &Robot,
    fit: Vec<PyRef<'py, Recording>>,
    holdout: Vec<PyRef<'py, Recording>>,
    resistance_ohm: Option<f64>,
    inertia_kg_m2: Option<f64>,
    seed: u64,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let (fit, holdout) = runs(robot, &fit, &holdout)?;
    let known = Known { resistance_ohm, inertia_kg_m2 };
    let model = robot.clone();
    let found = interruptible(py, move |stop| {
        let options = Options { seed, threads, progress: Some(stop.progress()), ..Options::default() };
        motor(model.robot(), &fit, &holdout, known, &options)
    })?;
    let found = found.map_err(refused)?;
    let robot = extended(robot, &found.fitted, "scram identify motor; 95 % interval")?;
    result(py, &found, "", robot)
}

/// How a backbone's end turns: a motion capture's file, or times and angles.
#[derive(FromPyObject)]
pub enum Release<'py> {
    Arrays(String, PyReadonlyArray1<'py, f64>, PyReadonlyArray2<'py, f64>),
    File(PathBuf),
}

impl Release<'_> {
    fn oscillation(&self, body: Option<&str>, base: Option<&str>) -> PyResult<Oscillation> {
        match self {
            Self::File(path) => Oscillation::read(path, &capture::Options::default(), body, base)
                .map_err(|error| unusable_file(path, &error)),
            Self::Arrays(name, t_s, angles) => {
                let (t_s, angles) = (t_s.as_array(), angles.as_array());
                let increasing = t_s.iter().zip(t_s.iter().skip(1)).all(|(a, b)| a < b);
                if angles.ncols() != 3 || angles.nrows() != t_s.len() || !increasing {
                    let help = "t_s of shape (n,) increases, angles_rad of shape (n, 3) are about x, y and z, NaN where missing";
                    return Err(InputError::new_err(format!("run `{name}` has the wrong shape\n  help: {help}")));
                }
                let angles = angles.outer_iter().map(|row| [row[0], row[1], row[2]]).collect();
                Ok(Oscillation { name: name.clone(), t_s: t_s.to_vec(), angles })
            }
        }
    }
}

/// A backbone's stiffness and damping from its free oscillations.
#[pyfunction]
#[pyo3(signature = (robot, fit, holdout, *, body, base, module, gravity))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn identify_backbone<'py>(
    py: Python<'py>,
    robot: &Robot,
    fit: Vec<Release<'py>>,
    holdout: Vec<Release<'py>>,
    body: Option<String>,
    base: Option<String>,
    module: Option<usize>,
    gravity: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let gravity = match gravity {
        "level" => Gravity::Level,
        "hanging" => Gravity::Hanging,
        "none" => Gravity::None,
        other => return Err(InputError::new_err(format!("gravity is level, hanging or none, not `{other}`"))),
    };
    let read = |runs: &[Release<'_>]| {
        runs.iter().map(|run| run.oscillation(body.as_deref(), base.as_deref())).collect::<PyResult<Vec<_>>>()
    };
    let (fit, holdout) = (read(&fit)?, read(&holdout)?);
    let model = robot.clone();
    let options = backbone::Options { module, gravity, ..backbone::Options::default() };
    let found = interruptible(py, move |_| backbone_fit(model.robot(), &fit, &holdout, options))?.map_err(refused)?;
    let mut document = robot.document().clone();
    found.write_into(&mut document).map_err(refused)?;
    let svg = oscillation_svg(&found.tracks).map_err(|error| failed(&error))?;
    let title = format!("{}, {}", robot.robot().name, found.fitted().join(", "));
    result(py, &found, &under_title(&title, &svg), robot.with(document)?)
}

/// Measured speeds: a table's file, or rows of f in Hz, α in degrees, vx and vy in mm/s, yaw in °/s.
#[derive(FromPyObject)]
pub enum Speeds<'py> {
    Rows(PyReadonlyArray2<'py, f64>),
    File(PathBuf),
}

impl Speeds<'_> {
    /// The table, and what a report calls it.
    pub fn named(&self) -> PyResult<(Measured, String)> {
        let name = match self {
            Self::File(path) => path.display().to_string(),
            Self::Rows(_) => "speeds".to_owned(),
        };
        Ok((self.measured()?, name))
    }

    fn measured(&self) -> PyResult<Measured> {
        match self {
            Self::File(path) => Measured::read(path).map_err(|error| unusable_file(path, &error)),
            Self::Rows(rows) => {
                let number = |value: f64| Some(value).filter(|value| value.is_finite());
                let rows = rows.as_array();
                let run = |row: numpy::ndarray::ArrayView1<'_, f64>| {
                    ((row[0], row[1]), [number(row[2]), number(row[3]), number(row[4])])
                };
                Ok(Measured::of_runs(rows.outer_iter().map(run)))
            }
        }
    }
}

/// What of a robot decides how it walks, from its measured speeds.
#[pyfunction]
#[pyo3(signature = (robot, measured, *, holdout, uneven, window_s, draws, seed, threads))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn identify_robot<'py>(
    py: Python<'py>,
    robot: &Robot,
    measured: Speeds<'py>,
    holdout: Vec<(f64, f64)>,
    uneven: bool,
    window_s: (f64, f64),
    draws: usize,
    seed: u64,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let measured = measured.measured()?;
    let held = Held::named(&holdout, &measured).map_err(refused)?;
    let document = robot.document().clone();
    let found = interruptible(py, move |stop| {
        let progress = Some(stop.progress());
        let options =
            walk::Options { held, uneven, window_s, draws, seed, threads, progress, ..walk::Options::default() };
        walk::identify(&document, &measured, &options)
    })?;
    let found = found.map_err(refused)?;
    let svg = speeds_svg(&found.conditions).map_err(|error| failed(&error))?;
    result(py, &found, &svg, robot.with(found.document.clone())?)
}

/// Mean speeds of a robot that was filmed: longitudinal and lateral, mm/s, and yaw, °/s.
#[pyfunction]
#[pyo3(signature = (file, *, body, rear, ahead_deg, window_s, rate_hz, mm_per_unit, up, columns))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn captured_speeds(
    py: Python<'_>,
    file: PathBuf,
    body: Option<String>,
    rear: Option<String>,
    ahead_deg: f64,
    window_s: (f64, f64),
    rate_hz: Option<f64>,
    mm_per_unit: Option<f64>,
    up: Option<&str>,
    columns: Vec<(String, String)>,
) -> PyResult<(f64, f64, f64)> {
    let up = match up {
        None => None,
        Some("y") => Some(capture::Up::Y),
        Some("z") => Some(capture::Up::Z),
        Some(other) => return Err(InputError::new_err(format!("up is y or z, not `{other}`"))),
    };
    let (from_s, to_s) = window_s;
    if !(from_s >= 0.0 && to_s > from_s) {
        return Err(InputError::new_err("window_s is two times in s, the second one later"));
    }
    let options = capture::Options { rate_hz, metres: mm_per_unit.map(|mm| 1e-3 * mm), up, columns };
    let unusable = |error| unusable_file(&file, &error);
    let read = py.detach(|| capture::read(&file, &options)).map_err(unusable)?;
    let body = read.body(body.as_deref()).map_err(unusable)?;
    let rear = rear.as_deref().map(|name| read.body(Some(name))).transpose().map_err(unusable)?;
    let placement = Placement { ahead_rad: ahead_deg.to_radians() };
    let Some([ahead, left, yaw]) = walk::speeds(body, rear, placement, from_s, to_s) else {
        return Err(InputError::new_err(format!(
            "{}: `{}` is not seen with a heading from {from_s} s to {to_s} s\n  help: name a rigid body, or two points by body and rear; \
             window_s says which times count",
            file.display(),
            body.name
        )));
    };
    Ok((ahead, left, yaw))
}
