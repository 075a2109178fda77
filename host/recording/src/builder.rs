//! From rows of any file format to a [`Recording`]: the one place where rows are checked and long runs are thinned.

use std::path::{Path, PathBuf};

use super::error::RowNumber;
use super::plausible::{self, Range, Watch};
use super::{AngleReading, Drive, Place, Recording, RecordingError, Window};

/// Rows that are kept or dropped together when a recording is thinned: 1 s at 1 kHz.
pub(super) const BLOCK_ROWS: u64 = 1000;

/// A column of the exchange format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Time,
    Enable,
    Duty,
    Voltage,
    Supply,
    Angle,
    Adc,
    AdcSecond,
    Current,
    Temperature,
    X,
    Y,
    Yaw,
}

const COLUMNS: [(&str, Column); 13] = [
    ("t_s", Column::Time),
    ("enable", Column::Enable),
    ("duty", Column::Duty),
    ("voltage_v", Column::Voltage),
    ("supply_v", Column::Supply),
    ("angle_rad", Column::Angle),
    ("adc", Column::Adc),
    ("adc_second", Column::AdcSecond),
    ("current_a", Column::Current),
    ("temperature_c", Column::Temperature),
    ("x_m", Column::X),
    ("y_m", Column::Y),
    ("yaw_rad", Column::Yaw),
];

/// Columns that are known and have no place in a recording in memory: what a simulation adds, what a controller was told and said.
/// Not worth a note.
const KNOWN_UNREAD: [&str; 12] = [
    "blind",
    // Of a console that hears poses.
    "pose_t_s",
    // For `scram replay`: see [`super::entries`].
    "tick",
    "time_us",
    "battery_adc",
    "battery_v",
    "angle_code",
    "state",
    "fault",
    "tracking",
    "failed_sensor",
    "order",
];
const SIMULATION_PREFIXES: [&str; 3] = ["truth_", "estimate_", "reference_"];

/// Which columns a file has, in its own order.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// One entry a column of the file; `None` is ignored.
    pub(super) columns: Vec<Option<Column>>,
    /// Names as the file spells them.
    pub(super) names: Vec<String>,
}

/// How a note about columns that nobody reads begins.
pub(super) const UNREAD: &str = "columns that are not read: ";

impl Layout {
    /// Whether a [`Recording`] has this column.
    pub(super) fn is_standard(name: &str) -> bool {
        COLUMNS.iter().any(|(known, _)| *known == name)
    }

    /// Sorts the names of a header.
    pub(super) fn of(path: &Path, names: Vec<String>) -> Result<Self, RecordingError> {
        let columns: Vec<Option<Column>> =
            names.iter().map(|name| COLUMNS.iter().find(|(known, _)| known == name).map(|(_, c)| *c)).collect();
        for (index, name) in names.iter().enumerate() {
            if columns[index].is_some() && names[..index].contains(name) {
                return Err(RecordingError::Duplicate { path: path.to_owned(), column: name.clone() });
            }
        }
        let layout = Self { columns, names };
        let conflict = |first, second| RecordingError::Conflict { path: path.to_owned(), first, second };
        if layout.has(Column::Duty) && layout.has(Column::Voltage) {
            return Err(conflict("duty", "voltage_v"));
        }
        if layout.has(Column::Angle) && layout.has(Column::Adc) {
            return Err(conflict("angle_rad", "adc"));
        }
        let mut needed = Vec::new();
        if !layout.has(Column::Time) {
            needed.push("`t_s`");
        }
        if !layout.has(Column::Duty) && !layout.has(Column::Voltage) {
            needed.push("`duty` (or `voltage_v`)");
        }
        if !layout.has(Column::Angle) && !layout.has(Column::Adc) {
            needed.push("`angle_rad` (or `adc`)");
        }
        if !needed.is_empty() {
            let found: Vec<String> = layout.names.iter().map(|n| format!("`{}`", shortened(n))).collect();
            return Err(RecordingError::MissingColumns {
                path: path.to_owned(),
                needed: needed.join(", no column "),
                found: found.join(", "),
            });
        }
        Ok(layout)
    }

    pub(super) fn has(&self, column: Column) -> bool {
        self.columns.contains(&Some(column))
    }

    /// Columns that nobody reads, for a note.
    pub(super) fn ignored(&self) -> Vec<&str> {
        let is_known = |name: &str| {
            KNOWN_UNREAD.contains(&name) || SIMULATION_PREFIXES.iter().any(|prefix| name.starts_with(prefix))
        };
        let unread = self.columns.iter().zip(&self.names).filter(|(column, name)| column.is_none() && !is_known(name));
        unread.map(|(_, name)| name.as_str()).collect()
    }
}

/// A name that fits into a message, whatever a broken file has in its first line.
fn shortened(name: &str) -> String {
    if name.chars().count() <= 40 { name.to_owned() } else { name.chars().take(40).chain(['…']).collect() }
}

/// One row's values; `None` where the cell is empty or the column is not there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Values {
    pub(super) t_s: Option<f64>,
    pub(super) enable: Option<f64>,
    pub(super) drive: Option<f64>,
    pub(super) supply_v: Option<f64>,
    /// rad, or a code.
    pub(super) angle: Option<f64>,
    pub(super) adc_second: Option<f64>,
    pub(super) current_a: Option<f64>,
    pub(super) temperature_c: Option<f64>,
    /// x, y, heading.
    pub(super) pose: [Option<f64>; 3],
}

impl Values {
    /// Puts a cell where it belongs.
    pub(super) fn set(&mut self, column: Column, value: Option<f64>) {
        match column {
            Column::Time => self.t_s = value,
            Column::Enable => self.enable = value,
            Column::Duty | Column::Voltage => self.drive = value,
            Column::Supply => self.supply_v = value,
            Column::Angle | Column::Adc => self.angle = value,
            Column::AdcSecond => self.adc_second = value,
            Column::Current => self.current_a = value,
            Column::Temperature => self.temperature_c = value,
            Column::X => self.pose[0] = value,
            Column::Y => self.pose[1] = value,
            Column::Yaw => self.pose[2] = value,
        }
    }
}

/// How much of a file is in memory. A file with more samples than the limit is thinned by dropping whole blocks of 1000
/// rows at a doubling stride, so what is kept is still sampled as finely as before; the time column shows the holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Rows in the file.
    pub rows: u64,
    /// Rows in memory.
    pub kept: u64,
    /// Every how many-th block was kept; 1: all.
    pub stride: u64,
    /// Rows of the file outside the window that was asked for; they are not among [`Kept::rows`].
    pub outside: u64,
}

/// Collects rows.
pub(super) struct Builder {
    path: PathBuf,
    recording: Recording,
    limit: usize,
    stride: u64,
    rows: u64,
    window: Window,
    outside: u64,
    /// Of the whole file.
    first_t: Option<f64>,
    last_t: Option<f64>,
    last_row: RowNumber,
    last_supply: Option<f64>,
    has_supply: bool,
    has_second: bool,
    has_current: bool,
    has_temperature: bool,
    has_pose: bool,
    duty_name: &'static str,
    angle_name: &'static str,
    /// `None` takes values as they are written.
    watch: Option<Watch>,
}

impl Builder {
    pub(super) fn new(path: &Path, layout: &Layout, limit: usize, window: Window) -> Self {
        let is_duty = layout.has(Column::Duty);
        let is_adc = layout.has(Column::Adc);
        let recording = Recording {
            path: path.to_owned(),
            drive: if is_duty { Drive::Duty(Vec::new()) } else { Drive::Voltage(Vec::new()) },
            angle: if is_adc { AngleReading::Adc(Vec::new()) } else { AngleReading::Angle(Vec::new()) },
            ..Recording::default()
        };
        Self {
            path: path.to_owned(),
            recording,
            // Below two blocks there would be nothing left to drop.
            limit: limit.max(2 * BLOCK_ROWS as usize),
            stride: 1,
            rows: 0,
            window,
            outside: 0,
            first_t: None,
            last_t: None,
            last_row: RowNumber::Line(1),
            last_supply: None,
            has_supply: layout.has(Column::Supply),
            has_second: layout.has(Column::AdcSecond),
            has_current: layout.has(Column::Current),
            has_temperature: layout.has(Column::Temperature),
            has_pose: [Column::X, Column::Y, Column::Yaw].into_iter().all(|column| layout.has(column)),
            duty_name: if is_duty { "duty" } else { "voltage_v" },
            angle_name: if is_adc { "adc" } else { "angle_rad" },
            watch: Some(Watch::default()),
        }
    }

    /// Judges no unit where values are taken as they are written ([`super::ReadOptions::as_written`]).
    pub(super) fn judging_units(mut self, as_written: bool) -> Self {
        self.watch = (!as_written).then(Watch::default);
        self
    }

    fn cell(&self, row: RowNumber, column: &str, problem: String, help: impl Into<String>) -> RecordingError {
        let place = Place { path: self.path.clone(), row };
        RecordingError::Cell { place, column: column.into(), problem, help: help.into() }
    }

    fn within(&self, row: RowNumber, column: &str, value: f64, range: &Range) -> Result<f64, RecordingError> {
        if !value.is_finite() {
            let help = "leave the cell empty where nothing was measured";
            return Err(self.cell(row, column, format!("{value} is not a number"), help));
        }
        if self.watch.is_some() && (value < range.low || value > range.high) {
            let expected = format!("{value} is outside {:.0} … {:.0}", range.low, range.high);
            return Err(self.cell(row, column, expected, range.suspicion));
        }
        Ok(value)
    }

    fn needed(&self, row: RowNumber, column: &str, value: Option<f64>) -> Result<f64, RecordingError> {
        value.ok_or_else(|| self.cell(row, column, "the cell is empty".into(), "every row needs this value"))
    }

    /// Takes a row, checks it, and keeps it unless its block is thinned out.
    pub(super) fn push(&mut self, row: RowNumber, values: &Values) -> Result<(), RecordingError> {
        let t_s = self.check_time(row, values.t_s)?;
        let enable = self.check_enable(row, values.enable)?;
        let drive = self.needed(row, self.duty_name, values.drive)?;
        let is_duty = matches!(self.recording.drive, Drive::Duty(_));
        let drive =
            self.within(row, self.duty_name, drive, if is_duty { &plausible::DUTY } else { &plausible::VOLTAGE })?;
        let angle = self.check_angle(row, t_s, values.angle)?;
        let second = values.adc_second.map(|code| self.check_code(row, "adc_second", code)).transpose()?;
        if self.has_supply {
            // A supply measured more slowly than the rows holds until its next value.
            let supply = self.needed(row, "supply_v", values.supply_v.or(self.last_supply))?;
            self.last_supply = Some(self.within(row, "supply_v", supply, &plausible::SUPPLY)?);
        }
        let optional = |value: Option<f64>, column: &str, range: &Range| {
            value.map(|v| self.within(row, column, v, range)).transpose()
        };
        let current_a = optional(values.current_a, "current_a", &plausible::CURRENT)?;
        let temperature_c = optional(values.temperature_c, "temperature_c", &plausible::TEMPERATURE)?;
        let [x, y, yaw] = values.pose;
        let pose = x.zip(y).zip(yaw).map(|((x, y), yaw)| [x, y, yaw]);
        if let Some(value) = pose.into_iter().flatten().find(|value| !value.is_finite()) {
            let help = "leave the cells empty where nothing was measured";
            return Err(self.cell(row, "x_m, y_m, yaw_rad", format!("{value} is not a number"), help));
        }

        self.last_row = row;
        if self.window.is_before(t_s) || self.window.is_after(t_s) {
            self.outside += 1;
            return Ok(());
        }
        let block = self.rows / BLOCK_ROWS;
        self.rows += 1;
        if !block.is_multiple_of(self.stride) {
            return Ok(());
        }
        let kept = &mut self.recording;
        kept.t_s.push(t_s);
        kept.enable.push(enable);
        match &mut kept.drive {
            Drive::Duty(column) | Drive::Voltage(column) => column.push(drive),
        }
        match &mut kept.angle {
            AngleReading::Angle(column) => column.push(angle),
            // Checked to be a code.
            AngleReading::Adc(column) => column.push(angle.map(|code| code as u16)),
        }
        if let Some(supply) = self.last_supply {
            kept.supply_v.push(supply);
        }
        if self.has_second {
            kept.adc_second.push(second);
        }
        if self.has_current {
            kept.current_a.push(current_a);
        }
        if self.has_temperature {
            kept.temperature_c.push(temperature_c);
        }
        if self.has_pose {
            kept.pose.push(pose);
        }
        if kept.len() > self.limit {
            self.stride *= 2;
            thin(kept);
        }
        Ok(())
    }

    fn check_time(&mut self, row: RowNumber, value: Option<f64>) -> Result<f64, RecordingError> {
        let t_s = self.needed(row, "t_s", value)?;
        if !t_s.is_finite() {
            return Err(self.cell(row, "t_s", format!("{t_s} is not a time"), "every row needs its time in seconds"));
        }
        if let Some(last) = self.last_t {
            if t_s <= last {
                let problem = format!("time does not increase: {t_s} after {last}");
                let help = "sort the rows by time, or cut the file where the recorder started again";
                return Err(self.cell(row, "t_s", problem, help));
            }
            let judged = self.watch.as_mut().map_or(Ok(()), |watch| watch.time_step(t_s - last));
            judged.map_err(|(column, problem, help)| self.cell(row, column, problem, help))?;
        }
        self.first_t = self.first_t.or(Some(t_s));
        self.last_t = Some(t_s);
        Ok(t_s)
    }

    fn check_enable(&self, row: RowNumber, value: Option<f64>) -> Result<bool, RecordingError> {
        match value {
            None => Ok(true),
            Some(1.0) => Ok(true),
            Some(0.0) => Ok(false),
            Some(other) => {
                let help = "1: the bridge drives; 0: it is open and the shaft coasts";
                Err(self.cell(row, "enable", format!("{other} is neither 0 nor 1"), help))
            }
        }
    }

    fn check_angle(&mut self, row: RowNumber, t_s: f64, value: Option<f64>) -> Result<Option<f64>, RecordingError> {
        let Some(angle) = value else { return Ok(None) };
        let column = self.angle_name;
        if !angle.is_finite() {
            let help = "leave the cell empty where the sensor is blind";
            return Err(self.cell(row, column, format!("{angle} is not an angle"), help));
        }
        if matches!(self.recording.angle, AngleReading::Adc(_)) {
            self.check_code(row, column, angle)?;
        } else {
            let judged = self.watch.as_mut().map_or(Ok(()), |watch| watch.angle(t_s, angle));
            judged.map_err(|(column, problem, help)| self.cell(row, column, problem, help))?;
        }
        Ok(Some(angle))
    }

    fn check_code(&self, row: RowNumber, column: &str, code: f64) -> Result<u16, RecordingError> {
        if code.fract() != 0.0 || !(0.0..=65535.0).contains(&code) {
            let help = format!("{column} is the raw code; angles go into angle_rad");
            return Err(self.cell(row, column, format!("{code} is not a code of 0 … 65535"), help));
        }
        Ok(code as u16)
    }

    /// The recording, with at least one sample.
    pub(super) fn finish(self) -> Result<(Recording, Kept), RecordingError> {
        if let (0, Some(first), Some(last)) = (self.rows, self.first_t, self.last_t) {
            return Err(RecordingError::Format {
                path: self.path,
                problem: format!(
                    "no sample is within the times that were asked for: the recording goes from {first} s to {last} s"
                ),
                help: "choose them within the recording's own time, in s".into(),
            });
        }
        if self.rows == 0 {
            return Err(RecordingError::NoSamples { path: self.path });
        }
        let judged = self.watch.as_ref().map_or(Ok(()), Watch::finish);
        judged.map_err(|(column, problem, help)| self.cell(self.last_row, column, problem, help))?;
        let kept =
            Kept { rows: self.rows, kept: self.recording.len() as u64, stride: self.stride, outside: self.outside };
        Ok((self.recording, kept))
    }
}

impl Kept {
    /// Sentences for people; none when everything was kept.
    pub(super) fn notes(&self) -> Vec<String> {
        let outside =
            (self.outside > 0).then(|| format!("{} rows are outside --from and --to (from_s and to_s)", self.outside));
        let thinned = (self.stride > 1).then(|| {
            format!(
                "{} of {} rows were kept to bound memory and time: every {} block of {BLOCK_ROWS} rows",
                self.kept,
                self.rows,
                ordinal(self.stride)
            )
        });
        outside.into_iter().chain(thinned).collect()
    }
}

fn ordinal(n: u64) -> String {
    let suffix = match (n % 10, n % 100) {
        (1, r) if r != 11 => "st",
        (2, r) if r != 12 => "nd",
        (3, r) if r != 13 => "rd",
        _ => "th",
    };
    format!("{n}{suffix}")
}

/// Drops every second block of those that are there.
fn thin(recording: &mut Recording) {
    fn halve<T>(column: &mut Vec<T>) {
        let mut row = 0;
        column.retain(|_| {
            row += 1;
            ((row - 1) / BLOCK_ROWS).is_multiple_of(2)
        });
    }
    halve(&mut recording.t_s);
    halve(&mut recording.enable);
    match &mut recording.drive {
        Drive::Duty(column) | Drive::Voltage(column) => halve(column),
    }
    match &mut recording.angle {
        AngleReading::Angle(column) => halve(column),
        AngleReading::Adc(column) => halve(column),
    }
    halve(&mut recording.adc_second);
    halve(&mut recording.supply_v);
    halve(&mut recording.current_a);
    halve(&mut recording.temperature_c);
    halve(&mut recording.pose);
}
