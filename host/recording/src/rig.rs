//! Whether a recording can be of the rig that a robot file describes.

use robot_file::robot::{Robot, Sensor};

use super::{AngleReading, Loaded, Recording, RecordingError};

/// A measured supply outside the file's range by more than this factor is another rig's.
const SUPPLY_FACTOR: f64 = 1.3;

/// Fails where recording and robot file cannot belong together: another name in the metadata, a column that this
/// rig's sensor cannot give, a supply that it does not have.
///
/// # Errors
/// [`RecordingError::OtherRig`].
pub fn require_same_rig(loaded: &Loaded, robot: &Robot) -> Result<(), RecordingError> {
    let recording = &loaded.recording;
    let other = |problem: String, help: &str| {
        Err(RecordingError::OtherRig { path: recording.path.clone(), problem, help: help.to_owned() })
    };
    if let Some(name) = &loaded.metadata.robot
        && *name != robot.name
    {
        return other(
            format!("recorded on `{name}`, but the robot file describes `{}`", robot.name),
            "name the file of the recorded robot with --robot, or correct `robot` in the recording's metadata",
        );
    }
    if let AngleReading::Adc(codes) = &recording.angle {
        let full_scale = match &robot.sensor {
            Sensor::Potentiometer(sensor) => 2f64.powf(sensor.adc.bits.value) - 1.0,
            Sensor::Encoder(_) | Sensor::Ideal => {
                return other(
                    format!("column `adc` holds raw codes of a potentiometer; robot `{}` has none", robot.name),
                    "name the file of the recorded robot with --robot",
                );
            }
        };
        let highest = codes.iter().flatten().max().copied().unwrap_or(0);
        if f64::from(highest) > full_scale {
            return other(
                format!("column `adc` goes up to {highest}; the converter of `{}` ends at {full_scale}", robot.name),
                "name the file of the recorded robot with --robot, or correct sensor.adc.bits",
            );
        }
    }
    if let Some(problem) = supply_problem(recording, robot) {
        return other(problem, "name the file of the recorded robot with --robot");
    }
    Ok(())
}

/// What is wrong with a measured supply that the robot file does not have; `None` where it fits or was not measured.
#[must_use]
pub fn supply_problem(recording: &Recording, robot: &Robot) -> Option<String> {
    let mean = mean_supply_v(recording)?;
    let rail = &robot.supply.rail_v;
    let fits = mean <= SUPPLY_FACTOR * rail.high && mean >= rail.low / SUPPLY_FACTOR;
    (!fits).then(|| {
        format!(
            "supply_v is {mean:.2} V on average; the supply of `{}` has {} V ({} … {})",
            robot.name, rail.value, rail.low, rail.high
        )
    })
}

/// Mean of the measured supply, V; `None` where it was not measured.
#[must_use]
pub fn mean_supply_v(recording: &Recording) -> Option<f64> {
    let supply = &recording.supply_v;
    (!supply.is_empty()).then(|| supply.iter().sum::<f64>() / supply.len() as f64)
}
