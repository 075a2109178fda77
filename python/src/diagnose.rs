//! `scram.diagnose`: what the simulation of a recorded robot gets wrong.

use ::diagnose::walk::{self, WalkOptions};
use ::diagnose::{DiagnoseError, FEWEST_SAMPLES, FittedParameter, Options};
use effects::Id;
use identify::robot::Held;
use plot::report::{About, WalkAbout, html, walk_html};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::{Kept, Loaded, RecordingError, require_same_rig};
use robot_file::edit::Document;

use crate::errors::{InputError, failed, wrong_input};
use crate::identify::Speeds;
use crate::interrupt::interruptible;
use crate::recording::Recording;
use crate::robot::Robot;

/// Compares a robot file with recordings. A dictionary for `scram/diagnosis.py`: `said`, `summary`, `html`, `models`.
#[pyfunction]
#[pyo3(signature = (robot, fit, holdout, *, seed, also_try, threads))]
pub fn diagnose<'py>(
    py: Python<'py>,
    robot: &Robot,
    fit: Vec<PyRef<'py, Recording>>,
    holdout: Vec<PyRef<'py, Recording>>,
    seed: u64,
    also_try: Vec<String>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let (fit, holdout) = runs(robot, &fit, &holdout)?;
    let also_try = also_try.iter().map(|name| effect(name)).collect::<PyResult<Vec<Id>>>()?;
    let model = robot.clone();
    let found = interruptible(py, move |stop| {
        let options = Options { seed, threads, also_try, progress: Some(stop.progress()), ..Options::default() };
        let diagnosis = ::diagnose::diagnose(model.robot(), &fit, &holdout, &options)?;
        let about = About {
            robot: model.robot().name.clone(),
            robot_file: model.path().display().to_string(),
            extended_file: None,
            tracking: Vec::new(),
        };
        let page = html(&diagnosis, &about);
        Ok((diagnosis, page))
    })?;
    let (diagnosis, page) = found.map_err(|error: DiagnoseError| wrong_input(&error))?;
    let detail = &diagnosis.detail;
    let source = format!("scram diagnose, fitted on {}", detail.fit_runs.join(", "));
    let models: Vec<Robot> = std::iter::once(&detail.extended)
        .chain(&detail.rivals)
        .map(|fitted| extended(robot, fitted, &source))
        .collect::<PyResult<_>>()?;
    let result = PyDict::new(py);
    result.set_item("said", pythonize::pythonize(py, &diagnosis)?)?;
    result.set_item("summary", &detail.summary)?;
    result.set_item("html", page)?;
    result.set_item("models", models)?;
    Ok(result)
}

/// What the simulated walk of a robot gets wrong. A dictionary for `scram/diagnosis.py`: `said`, `summary`, `html`, `robot`.
#[pyfunction]
#[pyo3(signature = (robot, measured, *, holdout, window_s, draws, seed, threads))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn diagnose_walk<'py>(
    py: Python<'py>,
    robot: &Robot,
    measured: Speeds<'py>,
    holdout: Vec<(f64, f64)>,
    window_s: (f64, f64),
    draws: usize,
    seed: u64,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let (measured, name) = measured.named()?;
    let held = Held::named(&holdout, &measured).map_err(|error| wrong_input(&error))?;
    let document = robot.document().clone();
    let found = interruptible(py, move |stop| {
        let progress = Some(stop.progress());
        let options = WalkOptions { held, window_s, draws, seed, threads, progress, ..WalkOptions::default() };
        walk::diagnose_walk(&document, &measured, &options)
    })?;
    let found = found.map_err(|error| wrong_input(&error))?;
    let about = WalkAbout { robot: robot.path().display().to_string(), measured: vec![name], extended_file: None };
    let result = PyDict::new(py);
    result.set_item("said", pythonize::pythonize(py, &found)?)?;
    result.set_item("summary", &found.summary)?;
    result.set_item("html", walk_html(&found, &about).map_err(|error| failed(&error))?)?;
    result.set_item("robot", robot.with(found.document)?)?;
    Ok(result)
}

/// The robot file with fitted numbers and the tables of effects.
pub fn extended(robot: &Robot, fitted: &[FittedParameter], source: &str) -> PyResult<Robot> {
    let mut document: Document = robot.document().clone();
    ::diagnose::extend(&mut document, fitted, source).map_err(|error| wrong_input(&error))?;
    robot.with(document)
}

/// The recordings to fit on and to judge by.
pub fn runs(
    robot: &Robot,
    fit: &[PyRef<'_, Recording>],
    holdout: &[PyRef<'_, Recording>],
) -> PyResult<(Vec<recording::Recording>, Vec<recording::Recording>)> {
    let all: Vec<&Recording> = fit.iter().chain(holdout).map(|run| &**run).collect();
    for (index, run) in all.iter().enumerate() {
        usable(robot, run).map_err(|error| wrong_input(&error))?;
        if all[..index].iter().any(|other| other.same_samples(run)) {
            return Err(InputError::new_err(format!(
                "{} is there twice\n  help: a model is judged on runs that it was not fitted to: give every run once",
                run.samples().path.display()
            )));
        }
    }
    let samples = |runs: &[PyRef<'_, Recording>]| runs.iter().map(|run| run.samples().clone()).collect();
    Ok((samples(fit), samples(holdout)))
}

/// Fails where a recording is of another rig or too short.
pub fn usable(robot: &Robot, run: &Recording) -> Result<(), RecordingError> {
    let rows = run.samples().len() as u64;
    let loaded = Loaded {
        recording: run.samples().clone(),
        metadata: run.known().clone(),
        kept: Kept { rows, kept: rows, stride: 1, outside: 0 },
        notes: Vec::new(),
    };
    require_same_rig(&loaded, robot.robot())?;
    run.samples().require_samples(FEWEST_SAMPLES)
}

/// An effect of the shaft by its name.
fn effect(name: &str) -> PyResult<Id> {
    let known = |id: &Id| !id.spec().acts.on_the_ground();
    Id::of(name).filter(known).ok_or_else(|| {
        let names: Vec<&str> = Id::all().filter(known).map(Id::name).collect();
        InputError::new_err(format!("no effect `{name}`\n  help: the effects of a shaft are {}", names.join(", ")))
    })
}
