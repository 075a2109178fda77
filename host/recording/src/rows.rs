//! The rows of a recording under their column names, for both writers.

use std::path::Path;

use super::{AngleReading, Drive, ExtraColumn, Recording, RecordingError};

/// A value in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    Empty,
    Number(f64),
    Whole(u16),
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Self::Empty, Self::Number)
    }
}

/// The standard columns that a recording has, in the order in which they are written.
#[must_use]
pub fn standard_names(recording: &Recording) -> Vec<&'static str> {
    let mut names = vec!["t_s", "enable"];
    names.push(if matches!(recording.drive, Drive::Duty(_)) { "duty" } else { "voltage_v" });
    if !recording.supply_v.is_empty() {
        names.push("supply_v");
    }
    names.push(if matches!(recording.angle, AngleReading::Adc(_)) { "adc" } else { "angle_rad" });
    if !recording.adc_second.is_empty() {
        names.push("adc_second");
    }
    if !recording.current_a.is_empty() {
        names.push("current_a");
    }
    if !recording.temperature_c.is_empty() {
        names.push("temperature_c");
    }
    if !recording.pose.is_empty() {
        names.extend(["x_m", "y_m", "yaw_rad"]);
    }
    names
}

/// Fails unless every column has one finite value a sample: the fields are public, so the writers look.
pub(super) fn check_rectangular(
    path: &Path,
    recording: &Recording,
    extra: &[ExtraColumn],
) -> Result<(), RecordingError> {
    let n = recording.len();
    let drive = match &recording.drive {
        Drive::Duty(column) | Drive::Voltage(column) => column.len(),
    };
    let angle = match &recording.angle {
        AngleReading::Angle(column) => column.len(),
        AngleReading::Adc(column) => column.len(),
    };
    let optional = [
        recording.supply_v.len(),
        recording.adc_second.len(),
        recording.current_a.len(),
        recording.temperature_c.len(),
        recording.pose.len(),
    ];
    let even = recording.enable.len() == n
        && drive == n
        && angle == n
        && optional.iter().all(|&len| len == 0 || len == n)
        && extra.iter().all(|column| column.values.len() == n);
    if even {
        return Ok(());
    }
    Err(RecordingError::Format {
        path: path.to_owned(),
        problem: format!("not written: the recording's columns differ in length from its {n} times"),
        help: "give every column one value a sample, or leave an optional one empty".into(),
    })
}

/// The standard cells of one row, in the order of [`standard_names`].
pub(super) fn standard_cells(recording: &Recording, row: usize, cells: &mut Vec<Cell>) {
    cells.clear();
    cells.push(Cell::Number(recording.t_s[row]));
    cells.push(Cell::Whole(u16::from(recording.enable[row])));
    cells.push(match &recording.drive {
        Drive::Duty(column) | Drive::Voltage(column) => Cell::Number(column[row]),
    });
    if let Some(&supply) = recording.supply_v.get(row) {
        cells.push(Cell::Number(supply));
    }
    cells.push(match &recording.angle {
        AngleReading::Angle(column) => column[row].into(),
        AngleReading::Adc(column) => column[row].map_or(Cell::Empty, Cell::Whole),
    });
    if let Some(&second) = recording.adc_second.get(row) {
        cells.push(second.map_or(Cell::Empty, Cell::Whole));
    }
    if let Some(&current) = recording.current_a.get(row) {
        cells.push(current.into());
    }
    if let Some(&temperature) = recording.temperature_c.get(row) {
        cells.push(temperature.into());
    }
    if let Some(pose) = recording.pose.get(row) {
        cells.extend((0..3).map(|axis| Cell::from(pose.map(|pose| pose[axis]))));
    }
}
