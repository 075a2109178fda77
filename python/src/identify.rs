//! `scram.identify_…`: parameters from measurements. Dictionaries for `scram/identification.py`: `said`, `svg`, `robot`.

use std::path::{Path, PathBuf};

use ::diagnose::{Known, MotorFit, Options, identify_motor as motor};
use ::identify::backbone::{self, BackboneFit, Gravity, Oscillation, identify_until};
use ::identify::capture;
use ::identify::potentiometer::{PotentiometerFit, SecondFit, potentiometer, second_potentiometer};
use ::identify::robot::{self as walk, Held, Placement, RobotFit};
use miette::Diagnostic;
use numpy::ndarray::ArrayView1;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use plot::{oscillation_svg, residual_svg, speeds_svg, under_title};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::Run;
use serde::Serialize;
use sweep::Measured;

use crate::arguments;
use crate::diagnose::{extended, runs, samples, usable};
use crate::errors::{InputError, failed, unusable_file, wrong_input};
use crate::interrupt::interruptible;
use crate::recording::Recording;
use crate::robot::Robot;

/// What was found, its plot, and the robot with it.
type Found<T> = (T, String, Robot);

/// The same as Python sees it.
fn result<'py>(py: Python<'py>, (said, svg, robot): Found<impl Serialize>) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("said", pythonize::pythonize(py, &said)?)?;
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
    let (model, run) = (robot.clone(), run.run());
    if second {
        return result(py, interruptible(py, move |_| of_second_potentiometer(&model, &run))??);
    }
    result(py, interruptible(py, move |_| of_potentiometer(&model, &run))??)
}

fn of_potentiometer(robot: &Robot, run: &Run) -> PyResult<Found<PotentiometerFit>> {
    let samples = usable(robot, run).map_err(refused)?;
    let fit = potentiometer(robot.robot(), &samples).map_err(refused)?;
    let mut document = robot.document().clone();
    document.set_correction(&fit.correction).map_err(refused)?;
    let svg = residual_svg(&fit);
    Ok((fit, svg, robot.with(document)?))
}

fn of_second_potentiometer(robot: &Robot, run: &Run) -> PyResult<Found<SecondFit>> {
    let samples = usable(robot, run).map_err(refused)?;
    let fit = second_potentiometer(robot.robot(), &samples).map_err(refused)?;
    let mut document = robot.document().clone();
    document.set_second_correction(&fit.own.correction).map_err(refused)?;
    document.set("sensor.second.offset_deg", &fit.offset).map_err(refused)?;
    let svg = residual_svg(&fit.own);
    Ok((fit, svg, robot.with(document)?))
}

/// What is known of a motor, if it is a positive number.
fn known(name: &str, value: Option<f64>) -> PyResult<Option<f64>> {
    match value {
        Some(number) if !(number.is_finite() && number > 0.0) => {
            Err(InputError::new_err(format!("{name}: a positive number is expected, not {number}")))
        }
        value => Ok(value),
    }
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
    #[pyo3(from_py_with = arguments::seed)] seed: u64,
    #[pyo3(from_py_with = arguments::threads)] threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let known = Known {
        resistance_ohm: known("resistance_ohm", resistance_ohm)?,
        inertia_kg_m2: known("inertia_kg_m2", inertia_kg_m2)?,
    };
    let (fit, holdout) = (runs(&fit), runs(&holdout));
    let model = robot.clone();
    let found = interruptible(py, move |stop| -> PyResult<Found<MotorFit>> {
        let (fit, holdout) = samples(&model, &fit, &holdout)?;
        let options = Options { seed, threads, progress: Some(stop.progress()), ..Options::default() };
        let found = motor(model.robot(), &fit, &holdout, known, &options).map_err(refused)?;
        let robot = extended(&model, &found.fitted, "scram identify motor; 95 % interval")?;
        Ok((found, String::new(), robot))
    })??;
    result(py, found)
}

/// How a backbone's end turns: a motion capture's file, or times and angles.
#[derive(FromPyObject)]
pub enum Release<'py> {
    Arrays(String, PyReadonlyArray1<'py, f64>, PyReadonlyArray2<'py, f64>),
    File(PathBuf),
}

/// The same without Python's lock.
enum Source {
    Oscillation(Oscillation),
    File(PathBuf),
}

impl Release<'_> {
    fn source(self) -> PyResult<Source> {
        let (name, t_s, angles) = match self {
            Self::File(path) => return Ok(Source::File(path)),
            Self::Arrays(name, t_s, angles) => (name, t_s, angles),
        };
        let (t_s, angles) = (t_s.as_array(), angles.as_array());
        let increasing = t_s.iter().zip(t_s.iter().skip(1)).all(|(a, b)| a < b);
        if angles.ncols() != 3 || angles.nrows() != t_s.len() || !increasing {
            let help =
                "t_s of shape (n,) increases, angles_rad of shape (n, 3) are about x, y and z, NaN where missing";
            return Err(InputError::new_err(format!("run `{name}` has the wrong shape\n  help: {help}")));
        }
        let angles = angles.outer_iter().map(|row| [row[0], row[1], row[2]]).collect();
        Ok(Source::Oscillation(Oscillation { name, t_s: t_s.to_vec(), angles }))
    }
}

impl Source {
    fn read(self, body: Option<&str>, base: Option<&str>) -> PyResult<Oscillation> {
        match self {
            Self::Oscillation(run) => Ok(run),
            Self::File(path) => Oscillation::read(&path, &capture::Options::default(), body, base)
                .map_err(|error| unusable_file(&path, &error)),
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
    #[pyo3(from_py_with = arguments::module)] module: Option<usize>,
    gravity: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let gravity = match gravity {
        "level" => Gravity::Level,
        "hanging" => Gravity::Hanging,
        "none" => Gravity::None,
        other => return Err(InputError::new_err(format!("gravity is level, hanging or none, not `{other}`"))),
    };
    let sources = |runs: Vec<Release<'py>>| runs.into_iter().map(Release::source).collect::<PyResult<Vec<_>>>();
    let (fit, holdout) = (sources(fit)?, sources(holdout)?);
    let model = robot.clone();
    let options = backbone::Options { module, gravity, ..backbone::Options::default() };
    let found = interruptible(py, move |stop| -> PyResult<Found<BackboneFit>> {
        let read = |runs: Vec<Source>| {
            runs.into_iter().map(|run| run.read(body.as_deref(), base.as_deref())).collect::<PyResult<Vec<_>>>()
        };
        let (fit, holdout) = (read(fit)?, read(holdout)?);
        let found = identify_until(model.robot(), &fit, &holdout, options, stop.flag()).map_err(refused)?;
        let mut document = model.document().clone();
        found.write_into(&mut document).map_err(refused)?;
        let svg = oscillation_svg(&found.tracks).map_err(|error| failed(&error))?;
        let title = format!("{}, {}", model.robot().name, found.fitted().join(", "));
        Ok((found, under_title(&title, &svg), model.with(document)?))
    })??;
    result(py, found)
}

/// Measured speeds: a table's file, or rows of f in Hz, α in degrees, vx and vy in mm/s, yaw in °/s.
#[derive(FromPyObject)]
pub enum Speeds<'py> {
    Rows(PyReadonlyArray2<'py, f64>),
    File(PathBuf),
}

/// The same without Python's lock.
pub enum SpeedTable {
    Rows(Vec<[f64; 5]>),
    File(PathBuf),
}

impl Speeds<'_> {
    pub fn table(self) -> SpeedTable {
        match self {
            Self::File(path) => SpeedTable::File(path),
            Self::Rows(rows) => {
                let row = |row: ArrayView1<'_, f64>| [row[0], row[1], row[2], row[3], row[4]];
                SpeedTable::Rows(rows.as_array().outer_iter().map(row).collect())
            }
        }
    }
}

impl SpeedTable {
    /// What a report calls it.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Rows(_) => "speeds".to_owned(),
        }
    }

    pub fn read(&self) -> PyResult<Measured> {
        match self {
            Self::File(path) => Measured::read(path).map_err(|error| unusable_file(path, &error)),
            Self::Rows(rows) => {
                let number = |value: f64| Some(value).filter(|value| value.is_finite());
                let run = |row: &[f64; 5]| ((row[0], row[1]), [number(row[2]), number(row[3]), number(row[4])]);
                Ok(Measured::of_runs(rows.iter().map(run)))
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
    #[pyo3(from_py_with = arguments::draws)] draws: usize,
    #[pyo3(from_py_with = arguments::seed)] seed: u64,
    #[pyo3(from_py_with = arguments::threads)] threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let measured = measured.table();
    let model = robot.clone();
    let found = interruptible(py, move |stop| -> PyResult<Found<RobotFit>> {
        let measured = measured.read()?;
        let held = Held::named(&holdout, &measured).map_err(refused)?;
        let progress = Some(stop.progress());
        let options =
            walk::Options { held, uneven, window_s, draws, seed, threads, progress, ..walk::Options::default() };
        let found = walk::identify(model.document(), &measured, &options).map_err(refused)?;
        let svg = speeds_svg(&found.conditions).map_err(|error| failed(&error))?;
        let robot = model.with(found.document.clone())?;
        Ok((found, svg, robot))
    })??;
    result(py, found)
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
    let placement = Placement { ahead_rad: ahead_deg.to_radians() };
    let names = [body, rear];
    interruptible(py, move |_| {
        let [ahead, left, yaw] = filmed(&file, &options, names, placement, window_s)?;
        Ok((ahead, left, yaw))
    })?
}

/// Speeds of a body, or of the second of two names towards the first.
fn filmed(
    file: &Path,
    options: &capture::Options,
    [body, rear]: [Option<String>; 2],
    placement: Placement,
    (from_s, to_s): (f64, f64),
) -> PyResult<[f64; 3]> {
    let unusable = |error| unusable_file(file, &error);
    let read = capture::read(file, options).map_err(unusable)?;
    let body = read.body(body.as_deref()).map_err(unusable)?;
    let rear = rear.as_deref().map(|name| read.body(Some(name))).transpose().map_err(unusable)?;
    walk::speeds(body, rear, placement, from_s, to_s).ok_or_else(|| {
        InputError::new_err(format!(
            "{}: `{}` is not seen with a heading from {from_s} s to {to_s} s\n  help: name a rigid body, or two points by body and rear; \
             window_s says which times count",
            file.display(),
            body.name
        ))
    })
}
