//! From a table of numbers to a recording: units, sign, drive, time, and which rows are left out.

use super::mapping::{Mapping, Source};
use super::table::{Table, listed};
use super::units::Quantity;
use crate::builder::{Builder, Layout, Values};
use crate::{Kept, ReadOptions, Recording, RecordingError, Window};

/// A commanded voltage beyond the supply by no more than this share is the scatter of two measurements.
const VOLTAGE_SCATTER: f64 = 0.1;

/// A recording, and what became of the rest.
pub(super) struct Converted {
    pub(super) recording: Recording,
    pub(super) kept: Kept,
    pub(super) left_out: Vec<String>,
    pub(super) warnings: Vec<String>,
}

/// Where the drive comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DriveFrom {
    Duty,
    /// Voltage over supply.
    Voltage,
    /// Voltage as it is.
    Terminals,
    Goal,
}

/// Where the angle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AngleFrom {
    Angle,
    Speed,
}

/// A column with its unit.
struct Values64<'a> {
    source: &'a Source,
    numbers: &'a [f64],
}

impl Values64<'_> {
    /// The value of a row in the recording's unit; `None` where nothing was measured.
    fn at(&self, row: usize) -> Option<f64> {
        let number = self.numbers[row];
        (!number.is_nan()).then(|| self.source.value(number))
    }
}

/// A table and the mapping that reads it.
struct Mapped<'a> {
    table: &'a Table,
    mapping: &'a Mapping,
}

impl<'a> Mapped<'a> {
    fn column(&self, quantity: Quantity) -> Option<Values64<'a>> {
        let source = self.mapping.columns.get(&quantity)?;
        Some(Values64 { source, numbers: self.table.column(&source.column)? })
    }

    /// The column's name in the file.
    fn name(&self, quantity: Quantity) -> String {
        self.mapping.columns.get(&quantity).map_or_else(String::new, |source| source.column.clone())
    }

    fn incomplete(&self, problem: &str, help: &str) -> RecordingError {
        RecordingError::Format {
            path: self.table.path.clone(),
            problem: format!("{problem}; the file has: {}", listed(&self.table.names)),
            help: help.into(),
        }
    }

    fn cell(&self, row: usize, quantity: Quantity, problem: String, help: &str) -> RecordingError {
        RecordingError::Cell { place: self.table.place(row), column: self.name(quantity), problem, help: help.into() }
    }

    fn check_time(&self) -> Result<(), RecordingError> {
        match (self.mapping.has(Quantity::Time), self.mapping.rate_hz) {
            (true, None) | (false, Some(_)) => Ok(()),
            (false, None) => Err(self.incomplete(
                "no column is mapped to the time",
                "map one (--map time=NAME:ms), or say how many rows a second has (--rate HZ)",
            )),
            (true, Some(_)) => Err(self.incomplete(
                &format!(
                    "the time is in column \"{}\" and in the rate, which say the same thing twice",
                    self.name(Quantity::Time)
                ),
                "leave out the rate, or the column",
            )),
        }
    }

    fn angle_from(&self) -> Result<AngleFrom, RecordingError> {
        if self.mapping.has(Quantity::Angle) {
            return Ok(AngleFrom::Angle);
        }
        if self.mapping.has(Quantity::Speed) {
            return Ok(AngleFrom::Speed);
        }
        Err(self.incomplete(
            "no column is mapped to the angle",
            "map the shaft's angle (--map angle=NAME:deg), or its speed (--map speed=NAME:rpm)",
        ))
    }

    fn drive_from(&self) -> Result<DriveFrom, RecordingError> {
        let all = [Quantity::Duty, Quantity::Voltage, Quantity::TerminalVoltage, Quantity::Goal];
        // A goal beside a recorded drive says nothing more: the drive is what the servo made of it.
        let drives: Vec<Quantity> = all[..3].iter().copied().filter(|quantity| self.mapping.has(*quantity)).collect();
        let has_supply = self.mapping.has(Quantity::Supply) || self.mapping.supply_v.is_some();
        match drives[..] {
            [Quantity::Duty] => Ok(DriveFrom::Duty),
            [Quantity::Voltage] if has_supply => Ok(DriveFrom::Voltage),
            [Quantity::Voltage | Quantity::TerminalVoltage] => Ok(DriveFrom::Terminals),
            [first, second, ..] => Err(self.incomplete(
                &format!("both `{}` and `{}` are mapped, which say the drive twice", first.name(), second.name()),
                "keep the one that was commanded",
            )),
            _ if !self.mapping.has(Quantity::Goal) => Err(self.incomplete(
                "no column is mapped to the drive",
                "map the duty (--map duty=NAME:255) or the voltage (--map voltage=NAME:V), or of a servo its goal position \
                 with the gain (--map goal=NAME:deg --p-gain KP)",
            )),
            _ if self.mapping.control.gain.is_none() => Err(self.incomplete(
                "a goal position alone does not say how the motor was driven",
                "say the servo's gain: --p-gain KP, and with --p-full-scale gain times error (rad) that gives full duty",
            )),
            _ if !self.mapping.has(Quantity::Angle) => Err(self.incomplete(
                "the drive follows from goal and angle, and no column is mapped to the angle",
                "map the shaft's angle (--map angle=NAME:deg)",
            )),
            _ => Ok(DriveFrom::Goal),
        }
    }

    fn check_supply(&self) -> Result<(), RecordingError> {
        if self.mapping.has(Quantity::Supply) && self.mapping.supply_v.is_some() {
            return Err(self.incomplete(
                &format!(
                    "the supply is in column \"{}\" and a constant, which say the same thing twice",
                    self.name(Quantity::Supply)
                ),
                "leave out the constant (--supply), or the column",
            ));
        }
        Ok(())
    }
}

/// Rows and cells that did not become what they could have.
#[derive(Default)]
struct LeftOut {
    no_time: u64,
    no_drive: u64,
    no_supply: u64,
    no_enable: u64,
    before: u64,
    after: u64,
    no_angle: u64,
    limited: u64,
}

impl LeftOut {
    fn words(&self, window: &Window) -> Vec<String> {
        let seconds = |at: Option<f64>| at.unwrap_or_default();
        let said = [
            (self.before, format!("before {} s", seconds(window.from_s))),
            (self.after, format!("after {} s", seconds(window.to_s))),
            (self.no_time, "left out: no time".into()),
            (self.no_drive, "left out: no drive".into()),
            (self.no_enable, "left out: no word on whether the bridge drives".into()),
            (self.no_supply, "left out: no supply yet".into()),
            (self.no_angle, "without an angle: kept for their drive, the angle's cell is empty".into()),
        ];
        let said = said.into_iter().filter(|(count, _)| *count > 0);
        said.map(|(count, what)| format!("{count} {} {what}", if count == 1 { "row" } else { "rows" })).collect()
    }

    fn warnings(&self) -> Vec<String> {
        let limited = self.limited;
        (limited > 0)
            .then(|| format!("rows whose voltage is above the supply: {limited}; their duty is 1 or -1"))
            .into_iter()
            .collect()
    }
}

/// Makes a recording of at most so many samples as the options say.
pub(super) fn convert(table: &Table, mapping: &Mapping, options: &ReadOptions) -> Result<Converted, RecordingError> {
    let window = &options.window;
    let mapped = Mapped { table, mapping };
    mapped.check_time()?;
    mapped.check_supply()?;
    let (angle_from, drive_from) = (mapped.angle_from()?, mapped.drive_from()?);
    let has_supply = mapping.has(Quantity::Supply) || mapping.supply_v.is_some();
    let mut names = vec!["t_s", "enable", "angle_rad"];
    names.push(if drive_from == DriveFrom::Terminals { "voltage_v" } else { "duty" });
    names.extend(has_supply.then_some("supply_v"));
    names.extend(mapping.has(Quantity::Current).then_some("current_a"));
    names.extend(mapping.has(Quantity::Temperature).then_some("temperature_c"));
    let layout = Layout::of(&table.path, names.into_iter().map(String::from).collect())?;
    let mut builder =
        Builder::new(&table.path, &layout, options.limit, Window::default()).judging_units(options.as_written);

    let column = |quantity| mapped.column(quantity);
    let (time, enable, supply) = (column(Quantity::Time), column(Quantity::Enable), column(Quantity::Supply));
    let (current, temperature) = (column(Quantity::Current), column(Quantity::Temperature));
    let mut angle = Angle {
        column: column(if angle_from == AngleFrom::Angle { Quantity::Angle } else { Quantity::Speed }),
        integral: (angle_from == AngleFrom::Speed).then(Integral::default),
    };
    let drive = Drive { mapped: &mapped, from: drive_from, column: column(drive_from.quantity(mapping)) };
    let value = |column: &Option<Values64>, row: usize| column.as_ref().and_then(|column| column.at(row));

    let (mut left_out, mut last_t, mut last_supply, mut samples) = (LeftOut::default(), None, mapping.supply_v, 0_u64);
    for row in 0..table.rows.len() {
        let t_s = match mapping.rate_hz {
            Some(rate_hz) => Some(row as f64 / rate_hz),
            None => value(&time, row),
        };
        let Some(t_s) = t_s else {
            left_out.no_time += 1;
            continue;
        };
        if window.is_before(t_s) {
            left_out.before += 1;
            continue;
        }
        if window.is_after(t_s) {
            left_out.after += 1;
            continue;
        }
        check_increases(&mapped, row, t_s, &mut last_t)?;
        // Before rows are left out: a speed that was measured belongs to the angle whether or not the drive is known.
        let angle_rad = angle.at(row, t_s);
        last_supply = value(&supply, row).or(last_supply);
        if has_supply && last_supply.is_none() {
            left_out.no_supply += 1;
            continue;
        }
        let enabled = value(&enable, row);
        let driven = drive.at(row, angle_rad, last_supply, &mut left_out.limited)?;
        // An open bridge drives nothing, whatever it was told.
        let Some(drive) = driven.or((enabled == Some(0.0)).then_some(0.0)) else {
            left_out.no_drive += 1;
            continue;
        };
        if enable.is_some() && enabled.is_none() {
            left_out.no_enable += 1;
            continue;
        }
        left_out.no_angle += u64::from(angle_rad.is_none());
        let values = Values {
            t_s: Some(t_s),
            enable: enabled,
            drive: Some(drive),
            supply_v: last_supply,
            angle: angle_rad,
            adc_second: None,
            current_a: value(&current, row),
            temperature_c: value(&temperature, row),
            pose: [None; 3],
        };
        builder
            .push(table.rows[row], &values)
            .map_err(|error| in_their_words(error, &mapped, angle_from, drive_from))?;
        samples += 1;
    }
    if samples == 0 {
        return Err(nothing_left(&mapped, &left_out, window));
    }
    let (recording, kept) = builder.finish().map_err(|error| in_their_words(error, &mapped, angle_from, drive_from))?;
    let mut said = left_out.words(window);
    if angle_from == AngleFrom::Angle && mapping.has(Quantity::Speed) {
        said.push(format!(
            "column \"{}\" is only compared with the angle: a recording has no column for a speed",
            mapped.name(Quantity::Speed)
        ));
    }
    if drive_from != DriveFrom::Goal && mapping.has(Quantity::Goal) {
        said.push(format!("column \"{}\" is not used: the drive itself is mapped", mapped.name(Quantity::Goal)));
    }
    let mut warnings = left_out.warnings();
    if angle_from == AngleFrom::Speed {
        warnings.push(format!(
            "the angle is the integral of \"{}\" from 0: it drifts, and what depends on the shaft's true angle cannot be found",
            mapped.name(Quantity::Speed)
        ));
    }
    Ok(Converted { recording, kept, left_out: said, warnings })
}

fn nothing_left(mapped: &Mapped, left_out: &LeftOut, window: &Window) -> RecordingError {
    let why = left_out.words(window).join(", ");
    let help = if left_out.before + left_out.after > 0 {
        "choose --from and --to within the file's own time, in s, after units and offset"
    } else {
        "are the right columns mapped? A row needs its time and its drive"
    };
    RecordingError::Format {
        path: mapped.table.path.clone(),
        problem: format!("no row is left of {}: {why}", mapped.table.rows.len()),
        help: help.into(),
    }
}

/// Fails where the time stands still or goes back.
fn check_increases(mapped: &Mapped, row: usize, t_s: f64, last: &mut Option<f64>) -> Result<(), RecordingError> {
    let Some(before) = last.replace(t_s) else { return Ok(()) };
    if t_s > before {
        return Ok(());
    }
    if t_s == before {
        return Err(mapped.cell(
            row,
            Quantity::Time,
            format!("the time stamp of the row before is repeated: {t_s} s"),
            "the clock is coarser than the rows: delete all but one row of each time, or, where the rows are evenly spaced, \
             map no time and say --rate HZ",
        ));
    }
    Err(mapped.cell(
        row,
        Quantity::Time,
        format!("time goes backwards: {t_s} s after {before} s"),
        "cut the file where the recorder started again, and import both parts; or sort the rows by time",
    ))
}

/// A value that no recording may hold, told with the column and unit of the foreign file.
fn in_their_words(
    error: RecordingError,
    mapped: &Mapped,
    angle_from: AngleFrom,
    drive_from: DriveFrom,
) -> RecordingError {
    let RecordingError::Cell { place, column, problem, help } = error else { return error };
    let quantity = match column.as_str() {
        "t_s" => Quantity::Time,
        "enable" => Quantity::Enable,
        "duty" | "voltage_v" => drive_from.quantity(mapped.mapping),
        "supply_v" => Quantity::Supply,
        "angle_rad" if angle_from == AngleFrom::Speed => Quantity::Speed,
        "angle_rad" => Quantity::Angle,
        "current_a" => Quantity::Current,
        _ => Quantity::Temperature,
    };
    let Some(source) = mapped.mapping.columns.get(&quantity) else {
        return RecordingError::Cell { place, column, problem, help };
    };
    let unit = match source.unit.name.parse::<f64>() {
        Ok(full_scale) => format!(" of full scale {full_scale}"),
        Err(_) if source.unit.name.is_empty() => String::new(),
        Err(_) => format!(" in `{}`", source.unit),
    };
    RecordingError::Cell {
        place,
        column: source.column.clone(),
        problem: format!("as {}{unit}: {problem}", quantity.name()),
        help: format!("is the unit right? Units of `{}` are {}", quantity.name(), quantity.units()),
    }
}

/// The angle's column, or the integral of the speed's.
struct Angle<'a> {
    column: Option<Values64<'a>>,
    integral: Option<Integral>,
}

impl Angle<'_> {
    fn at(&mut self, row: usize, t_s: f64) -> Option<f64> {
        let value = self.column.as_ref()?.at(row)?;
        Some(match &mut self.integral {
            Some(integral) => integral.add(t_s, value),
            None => value,
        })
    }
}

/// An integral by the trapezoid rule, over rows without a value, too.
#[derive(Default)]
struct Integral {
    last: Option<(f64, f64)>,
    sum: f64,
}

impl Integral {
    fn add(&mut self, t_s: f64, speed: f64) -> f64 {
        if let Some((last_t, last_speed)) = self.last.replace((t_s, speed)) {
            self.sum += 0.5 * (speed + last_speed) * (t_s - last_t);
        }
        self.sum
    }
}

/// The drive's column.
struct Drive<'a> {
    mapped: &'a Mapped<'a>,
    from: DriveFrom,
    column: Option<Values64<'a>>,
}

impl DriveFrom {
    fn quantity(self, mapping: &Mapping) -> Quantity {
        match self {
            Self::Duty => Quantity::Duty,
            Self::Voltage => Quantity::Voltage,
            Self::Terminals if mapping.has(Quantity::Voltage) => Quantity::Voltage,
            Self::Terminals => Quantity::TerminalVoltage,
            Self::Goal => Quantity::Goal,
        }
    }
}

impl Drive<'_> {
    /// Duty or terminal voltage of a row; `None` where it is not known.
    fn at(
        &self,
        row: usize,
        angle_rad: Option<f64>,
        supply_v: Option<f64>,
        limited: &mut u64,
    ) -> Result<Option<f64>, RecordingError> {
        let Some(value) = self.column.as_ref().and_then(|column| column.at(row)) else { return Ok(None) };
        match self.from {
            DriveFrom::Duty | DriveFrom::Terminals => Ok(Some(value)),
            DriveFrom::Goal => Ok(angle_rad.and_then(|angle| self.mapped.mapping.control.duty(value, angle))),
            DriveFrom::Voltage => {
                let Some(supply) = supply_v else { return Ok(None) };
                self.share(row, value, supply, limited).map(Some)
            }
        }
    }

    /// Voltage over supply.
    fn share(&self, row: usize, volts: f64, supply: f64, limited: &mut u64) -> Result<f64, RecordingError> {
        if supply <= 0.0 {
            return Err(self.mapped.cell(
                row,
                Quantity::Supply,
                format!("a supply of {supply} V gives no duty"),
                "cut the run with --from and --to to where the supply is on, or map `terminal_voltage` instead of `voltage`",
            ));
        }
        let duty = volts / supply;
        if duty.abs() > 1.0 + VOLTAGE_SCATTER {
            return Err(self.mapped.cell(
                row,
                Quantity::Voltage,
                format!("{volts} V is more than the supply of {supply} V"),
                "are both units right? Units are V and mV",
            ));
        }
        *limited += u64::from(duty.abs() > 1.0);
        Ok(duty.clamp(-1.0, 1.0))
    }
}
