//! `scram.diagnose`: what the simulation of a recorded robot gets wrong.

use std::sync::Arc;

use ::diagnose::walk::{self, WalkOptions};
use ::diagnose::{FEWEST_SAMPLES, FittedParameter, Options};
use effects::Id;
use identify::robot::Held;
use plot::report::{About, WalkAbout, html, walk_html};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::{Kept, Loaded, RecordingError, Run, require_same_rig};
use robot_file::edit::Document;

use crate::arguments;
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
    #[pyo3(from_py_with = arguments::seed)] seed: u64,
    also_try: Vec<String>,
    #[pyo3(from_py_with = arguments::threads)] threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let also_try = also_try.iter().map(|name| effect(name)).collect::<PyResult<Vec<Id>>>()?;
    let (fit, holdout) = (runs(&fit), runs(&holdout));
    let model = robot.clone();
    let (diagnosis, page, models) = interruptible(py, move |stop| -> PyResult<_> {
        let (fit, holdout) = samples(&model, &fit, &holdout)?;
        let options = Options { seed, threads, also_try, progress: Some(stop.progress()), ..Options::default() };
        let diagnosis =
            ::diagnose::diagnose(model.robot(), &fit, &holdout, &options).map_err(|error| wrong_input(&error))?;
        let about = About {
            robot: model.robot().name.clone(),
            robot_file: model.path().display().to_string(),
            extended_file: None,
            tracking: Vec::new(),
        };
        let detail = &diagnosis.detail;
        let source = format!("scram diagnose, fitted on {}", detail.fit_runs.join(", "));
        let models: Vec<Robot> = std::iter::once(&detail.extended)
            .chain(&detail.rivals)
            .map(|fitted| extended(&model, fitted, &source))
            .collect::<PyResult<_>>()?;
        let page = html(&diagnosis, &about);
        Ok((diagnosis, page, models))
    })??;
    let result = PyDict::new(py);
    result.set_item("said", pythonize::pythonize(py, &diagnosis)?)?;
    result.set_item("summary", &diagnosis.detail.summary)?;
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
    #[pyo3(from_py_with = arguments::draws)] draws: usize,
    #[pyo3(from_py_with = arguments::seed)] seed: u64,
    #[pyo3(from_py_with = arguments::threads)] threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let measured = measured.table();
    let model = robot.clone();
    let (found, page, robot) = interruptible(py, move |stop| -> PyResult<_> {
        let name = measured.name();
        let measured = measured.read()?;
        let held = Held::named(&holdout, &measured).map_err(|error| wrong_input(&error))?;
        let progress = Some(stop.progress());
        let options = WalkOptions { held, window_s, draws, seed, threads, progress, ..WalkOptions::default() };
        let found = walk::diagnose_walk(model.document(), &measured, &options).map_err(|error| wrong_input(&error))?;
        let about = WalkAbout { robot: model.path().display().to_string(), measured: vec![name], extended_file: None };
        let page = walk_html(&found, &about).map_err(|error| failed(&error))?;
        let robot = model.with(found.document.clone())?;
        Ok((found, page, robot))
    })??;
    let result = PyDict::new(py);
    result.set_item("said", pythonize::pythonize(py, &found)?)?;
    result.set_item("summary", &found.summary)?;
    result.set_item("html", page)?;
    result.set_item("robot", robot)?;
    Ok(result)
}

/// The robot file with fitted numbers and the tables of effects.
pub fn extended(robot: &Robot, fitted: &[FittedParameter], source: &str) -> PyResult<Robot> {
    let mut document: Document = robot.document().clone();
    ::diagnose::extend(&mut document, fitted, source).map_err(|error| wrong_input(&error))?;
    robot.with(document)
}

/// What recordings hold, which is not copied.
pub fn runs(recordings: &[PyRef<'_, Recording>]) -> Vec<Arc<Run>> {
    recordings.iter().map(|recording| recording.run()).collect()
}

/// The samples to fit on and to judge by, as what fits wants them: copies.
pub fn samples(
    robot: &Robot,
    fit: &[Arc<Run>],
    holdout: &[Arc<Run>],
) -> PyResult<(Vec<recording::Recording>, Vec<recording::Recording>)> {
    let all: Vec<&Arc<Run>> = fit.iter().chain(holdout).collect();
    for (index, run) in all.iter().enumerate() {
        if let Some(first) = all[..index].iter().position(|other| have_same_samples(other, run)) {
            let place = |index: usize| match index.checked_sub(fit.len()) {
                None => format!("fit[{index}]"),
                Some(index) => format!("holdout[{index}]"),
            };
            return Err(InputError::new_err(format!(
                "{} is there twice: it is {} and {}\n  help: a model is judged on runs that it was not fitted to: give every run once",
                named(run),
                place(first),
                place(index)
            )));
        }
    }
    let usable = |runs: &[Arc<Run>]| {
        runs.iter().map(|run| usable(robot, run).map_err(|error| wrong_input(&error))).collect::<PyResult<_>>()
    };
    Ok((usable(fit)?, usable(holdout)?))
}

/// What a run is called; a simulated one has no name.
fn named(run: &Run) -> String {
    let path = run.recording.path.display().to_string();
    if path.is_empty() { "a run".to_owned() } else { path }
}

/// Whether two runs are one, wherever both come from.
fn have_same_samples(one: &Run, other: &Run) -> bool {
    let (one, other) = (&one.recording, &other.recording);
    one.t_s == other.t_s && one.angle == other.angle && one.drive == other.drive
}

/// A copy of a recording's samples; fails where it is of another rig or too short.
pub fn usable(robot: &Robot, run: &Run) -> Result<recording::Recording, RecordingError> {
    let rows = run.recording.len() as u64;
    let loaded = Loaded {
        recording: run.recording.clone(),
        metadata: run.metadata.clone(),
        kept: Kept { rows, kept: rows, stride: 1, outside: 0 },
        notes: Vec::new(),
    };
    require_same_rig(&loaded, robot.robot())?;
    loaded.recording.require_samples(FEWEST_SAMPLES)?;
    Ok(loaded.recording)
}

/// An effect of the shaft by its name.
fn effect(name: &str) -> PyResult<Id> {
    let known = |id: &Id| !id.spec().acts.on_the_ground();
    Id::of(name).filter(known).ok_or_else(|| {
        let names: Vec<&str> = Id::all().filter(known).map(Id::name).collect();
        InputError::new_err(format!("no effect `{name}`\n  help: the effects of a shaft are {}", names.join(", ")))
    })
}
