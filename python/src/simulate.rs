//! `scram.simulate`: a run of the firmware's decisions on a simulated robot.

use std::path::Path;

use pyo3::prelude::*;
use serde_json::{Map, Value};
use simulation::{Drive, DriveError, LONGEST_S, Place, Plan, Ran, Scheduled, SimError, USUAL_S};

use crate::arguments;
use crate::errors::{InputError, MissingFileError, failed, text, wrong_input};
use crate::interrupt::interruptible;
use crate::recording::Recording;
use crate::robot::Robot;

/// Run the firmware's decisions on a simulated robot, as ``scram sim`` does: the same bits for the same seed.
///
/// Parameters
/// ----------
/// robot
///     One with a body walks, one without turns its shaft.
/// drive
///     ``freq:HZ`` (positive clockwise), ``oscillate:FROM..TO`` (degrees), ``position:DEG``, ``duty:SHARE``, ``gait:NAME`` or
///     ``gait:FILE``, or ``script:FILE``. A gait by its name is looked for in robots/gaits of the working directory, of the robot file's
///     folder and of the one above.
/// seconds
///     Length of the run, s; 2, or what the script or the gait says, where nothing is said.
/// seed
///     Seed of the specimen and of the noise. Different seeds are different specimens of the robot: recordings that are to be
///     diagnosed together need one seed and different drives.
/// bench
///     The shaft alone, without the body.
/// faults
///     What breaks and when, s, as ``sensor-open@1.0,stall@1.5``: ``sensor-open``, ``sensor-short-low``, ``sensor-short-high``,
///     ``sensor-frozen``, ``sensor-noisy``, ``sensor-drifting``, ``adc-saturated``, ``stalled`` (or ``stall``), ``motor-reversed``,
///     ``motor-open``, ``battery-low``, ``rail-low``, ``link-lost``; of the second of two sensors with ``second-`` before its name.
/// designed_from
///     The robot whose file the controller is designed from, where that is another.
///
/// Raises
/// ------
/// MissingFileError
///     There is no such script or gait.
/// InputError
///     The drive or a fault is not understood, the robot refuses it, or it has no controller.
/// ScramError
///     The body's state diverged.
#[pyfunction]
#[pyo3(signature = (robot, drive = "freq:7", seconds = None, seed = 1, *, bench = false, faults = "", designed_from = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn simulate(
    py: Python<'_>,
    robot: &Robot,
    drive: &str,
    seconds: Option<f64>,
    #[pyo3(from_py_with = arguments::seed)] seed: u64,
    bench: bool,
    faults: &str,
    designed_from: Option<&Robot>,
) -> PyResult<Recording> {
    let plan = plan(robot, drive, seconds, faults)?;
    let place = if robot.robot().body.is_some() && !bench { Place::Ground } else { Place::Bench };
    let (robot, designed_from) = (robot.clone(), designed_from.unwrap_or(robot).clone());
    let drive = drive.to_owned();
    let ran = interruptible(py, move |stop| -> Result<Recording, SimError> {
        let ran = simulation::simulate(designed_from.robot(), robot.robot(), place, seed, &plan, stop.flag())?;
        ran.require_accepted()?;
        Ok(Recording::new(ran.recorded(robot.robot(), &drive, seed), figures(&ran)))
    })?;
    ran.map_err(|error| match error {
        SimError::BlowUp(_) | SimError::Stopped => failed(&error),
        _ => wrong_input(&error),
    })
}

fn plan(robot: &Robot, drive: &str, seconds: Option<f64>, faults: &str) -> PyResult<Plan> {
    let drive = parsed(drive, robot.path())?;
    let seconds = seconds.or(drive.end_s.map(|end_s| end_s.min(LONGEST_S))).unwrap_or(USUAL_S);
    if !(seconds > 0.0 && seconds <= LONGEST_S) {
        return Err(InputError::new_err(format!("seconds must be a number above 0 and up to {LONGEST_S}")));
    }
    let faults = Scheduled::parse_list_within(faults, seconds).map_err(|error| wrong_input(&error))?;
    Scheduled::check_parts(&faults, robot.robot()).map_err(|error| wrong_input(&error))?;
    Ok(Plan { drive, seconds, faults })
}

/// A drive of the robot of a file.
pub fn parsed(drive: &str, robot_file: &Path) -> PyResult<Drive> {
    Drive::parse_for(drive, Some(robot_file)).map_err(|error| match &error {
        DriveError::Io { path, .. } if !path.exists() => MissingFileError::new_err(text(&error)),
        DriveError::NoGait { .. } => MissingFileError::new_err(text(&error)),
        _ => wrong_input(&error),
    })
}

/// What was measured of a run, by the names of `scram sim --json`.
fn figures(ran: &Ran) -> Map<String, Value> {
    let object = |value: Result<Value, serde_json::Error>| match value {
        Ok(Value::Object(object)) => object,
        _ => Map::new(),
    };
    let mut figures = object(serde_json::to_value(simulation::metrics(&ran.trace)));
    let track = ran.walk.as_ref().map(|walk| &walk.track);
    if let Some(walk) = track.and_then(simulation::walk_metrics) {
        figures.insert("walk".into(), Value::Object(object(serde_json::to_value(walk))));
    }
    if let Some(clamped) = track.and_then(simulation::clamped_metrics) {
        figures.insert("clamped".into(), Value::Object(object(serde_json::to_value(clamped))));
    }
    figures
}
