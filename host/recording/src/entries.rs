//! Everything that a recording holds of one robot, in the file's order and without thinning: for `scram replay`.

use std::path::Path;

use control::supervisor::{FAULTS, STATES};
use control::{Fault, Sensor, State};
use mcap::records::Record;
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer};

use super::csv_read::number_or_flag;
use super::error::RowNumber;
use super::mcap_stream::{Choice, Contents, Kind, records};
use super::telemetry::At;
use super::{LinkQuality, Place, Progress, RecordedEvent, RecordingError, SessionEvent, Stated};

/// One of the things that a recording holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// Row of samples.
    Row(FullRow),
    /// Something that happened before the next tick.
    Event(RecordedEvent),
    /// How well the robot was heard.
    Link {
        /// Seconds, on the samples' clock.
        t_s: f64,
        /// Rate, losses, delay, strength.
        quality: LinkQuality,
    },
}

/// A tick with all its columns; `None` for what the file does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct FullRow {
    /// Time since the recording's zero, s.
    pub t_s: f64,
    /// Exact time of the sample on the robot's clock, µs.
    pub time_us: Option<f64>,
    /// Number of the control period.
    pub tick: Option<u64>,
    /// 1 while the bridge drives.
    #[serde(deserialize_with = "of_number_or_flag")]
    pub enable: Option<f64>,
    /// Duty, −1 … 1.
    pub duty: Option<f64>,
    /// Voltage at the motor, V, of a recording without a duty.
    pub voltage_v: Option<f64>,
    /// Raw code of the angle sensor's converter.
    pub adc: Option<f64>,
    /// Raw code of the second angle sensor's converter.
    pub adc_second: Option<f64>,
    /// Code of a digital angle sensor.
    pub angle_code: Option<f64>,
    /// Angle from the sensor, rad.
    pub angle_rad: Option<f64>,
    /// Raw code of the battery's converter.
    pub battery_adc: Option<f64>,
    /// Battery cell, V; where it is written on change only, the last one.
    pub battery_v: Option<f64>,
    /// The bridge's supply, V; the last one, too.
    pub supply_v: Option<f64>,
    /// The controller's angle, rad, once it is tracking.
    pub estimate_angle_rad: Option<f64>,
    /// The controller's speed, rad/s.
    pub estimate_speed_rad_per_s: Option<f64>,
    /// Where the controller wants the shaft to be, rad.
    pub reference_angle_rad: Option<f64>,
    /// True supply of the bridge in a simulation, V.
    pub truth_bridge_supply_v: Option<f64>,
    /// What the supervisor and the estimator said.
    #[serde(skip)]
    pub stated: Option<Stated>,
    /// Duty and estimates are rounded to the steps of `control::protocol::radio::PackedTick`.
    #[serde(skip)]
    pub is_radio: bool,
}

fn of_number_or_flag<'de, D: Deserializer<'de>>(cell: D) -> Result<Option<f64>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Cell {
        Number(f64),
        Flag(bool),
    }
    Ok(Option::<Cell>::deserialize(cell)?.map(|cell| match cell {
        Cell::Number(number) => number,
        Cell::Flag(on) => f64::from(u8::from(on)),
    }))
}

/// Gives every entry of a robot to `each`. What [`load_with`](super::load_with) checks is not checked again.
///
/// # Errors
/// The file cannot be read, or has several robots and none was named.
pub fn entries(path: &Path, robot: Option<&str>, each: &mut dyn FnMut(Entry)) -> Result<(), RecordingError> {
    entries_with(path, robot, None, each)
}

/// [`entries`], with somebody who watches the reading of an MCAP file.
///
/// # Errors
/// As [`entries`].
pub fn entries_with(
    path: &Path,
    robot: Option<&str>,
    progress: Option<Progress>,
    each: &mut dyn FnMut(Entry),
) -> Result<(), RecordingError> {
    let is_csv = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    if is_csv { csv_entries(path, each) } else { mcap_entries(path, robot, progress, each) }
}

/// What happened in a recording, of all its robots.
///
/// # Errors
/// The file cannot be read.
pub fn events(path: &Path) -> Result<Vec<RecordedEvent>, RecordingError> {
    let mut found = Vec::new();
    let is_csv = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    if is_csv {
        csv_entries(path, &mut |entry| found.extend(event_of(entry)))?;
        return Ok(found);
    }
    let mut contents = Contents::default();
    records(path, None, &mut |record| {
        contents.learn(path, &record)?;
        if let Some((topic, data)) = contents.message(path, &record)?
            && topic.kind == Kind::Event
        {
            found.push(event(&topic.robot, data));
        }
        Ok(())
    })?;
    Ok(found)
}

fn event_of(entry: Entry) -> Option<RecordedEvent> {
    if let Entry::Event(event) = entry { Some(event) } else { None }
}

/// An event of a kind that is not known, of a newer version, is a note.
pub(super) fn event(robot: &str, data: &[u8]) -> RecordedEvent {
    let robot = (!robot.is_empty()).then(|| robot.to_owned());
    if let Ok(At { t_s, what }) = serde_json::from_slice::<At<SessionEvent>>(data) {
        return RecordedEvent { t_s, robot, event: what };
    }
    #[derive(Deserialize, Default)]
    #[serde(default)]
    struct Time {
        t_s: f64,
    }
    let Time { t_s } = serde_json::from_slice(data).unwrap_or_default();
    RecordedEvent { t_s, robot, event: SessionEvent::Note { text: String::from_utf8_lossy(data).into_owned() } }
}

fn mcap_entries(
    path: &Path,
    robot: Option<&str>,
    progress: Option<Progress>,
    each: &mut dyn FnMut(Entry),
) -> Result<(), RecordingError> {
    let mut contents = Contents::default();
    let mut rows = Rows { choice: Choice::new(robot), pending: None, stated: None, supply_v: None, battery_v: None };
    let mut count = 0;
    records(path, progress, &mut |record: Record<'_>| {
        contents.learn(path, &record)?;
        let Some((topic, data)) = contents.message(path, &record)? else { return Ok(()) };
        count += 1;
        let place = || Place { path: path.to_owned(), row: RowNumber::Message(count) };
        if topic.kind == Kind::Sample {
            if !rows.choice.takes(topic, &contents.metadata) {
                return Ok(());
            }
            rows.next(FullRow { is_radio: topic.is_radio, ..parsed(data, place)? }, each);
            return Ok(());
        }
        if !rows.choice.concerns(topic) {
            return Ok(());
        }
        match topic.kind {
            Kind::Simulation => rows.simulated(&parsed(data, place)?),
            Kind::State => {
                rows.emit(each);
                let At { what, .. } = parsed::<At<Stated>>(data, place)?;
                rows.stated = Some(what);
            }
            Kind::Event => {
                rows.emit(each);
                each(Entry::Event(event(&topic.robot, data)));
            }
            Kind::Link => {
                let At { t_s, what: quality } = parsed(data, place)?;
                each(Entry::Link { t_s, quality });
            }
            Kind::Sample | Kind::Other => {}
        }
        Ok(())
    })?;
    rows.emit(each);
    rows.choice.check(path)
}

fn parsed<T: DeserializeOwned>(data: &[u8], place: impl Fn() -> Place) -> Result<T, RecordingError> {
    serde_json::from_slice(data).map_err(|e| RecordingError::RowNumber {
        place: place(),
        problem: format!("not a message of this topic: {e}"),
        help: "docs/recordings.md describes the schemas".into(),
    })
}

/// The row that waits for what a simulation says about it, and what holds from row to row.
struct Rows {
    choice: Choice,
    pending: Option<FullRow>,
    stated: Option<Stated>,
    supply_v: Option<f64>,
    battery_v: Option<f64>,
}

impl Rows {
    fn next(&mut self, mut row: FullRow, each: &mut dyn FnMut(Entry)) {
        self.emit(each);
        row.stated = self.stated;
        self.supply_v = row.supply_v.or(self.supply_v);
        self.battery_v = row.battery_v.or(self.battery_v);
        (row.supply_v, row.battery_v) = (self.supply_v, self.battery_v);
        self.pending = Some(row);
    }

    fn simulated(&mut self, told: &FullRow) {
        if let Some(row) = &mut self.pending
            && row.t_s == told.t_s
        {
            row.estimate_angle_rad = told.estimate_angle_rad;
            row.estimate_speed_rad_per_s = told.estimate_speed_rad_per_s;
            row.reference_angle_rad = told.reference_angle_rad;
            row.truth_bridge_supply_v = told.truth_bridge_supply_v;
        }
    }

    fn emit(&mut self, each: &mut dyn FnMut(Entry)) {
        if let Some(row) = self.pending.take() {
            each(Entry::Row(row));
        }
    }
}

fn csv_entries(path: &Path, each: &mut dyn FnMut(Entry)) -> Result<(), RecordingError> {
    let wrong = |e: csv::Error| RecordingError::Format {
        path: path.to_owned(),
        problem: e.to_string(),
        help: "docs/recordings.md describes the format".into(),
    };
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_path(path).map_err(wrong)?;
    let names = reader.headers().map_err(wrong)?.clone();
    let columns: Vec<String> = names.iter().map(|name| name.trim_start_matches('\u{feff}').to_owned()).collect();
    let mut rows = Rows { choice: Choice::new(None), pending: None, stated: None, supply_v: None, battery_v: None };
    let mut record = csv::StringRecord::new();
    let mut last_order = String::new();
    while reader.read_record(&mut record).map_err(wrong)? {
        let cell = |name: &str| {
            let index = columns.iter().position(|column| column == name)?;
            record.get(index).filter(|cell| !cell.is_empty())
        };
        let row = csv_row(&cell);
        let orders = cell("order").into_iter().flat_map(|orders| orders.split(';')).map(str::trim);
        for text in orders {
            rows.emit(each);
            // The file has no repeats apart from the text.
            let repeat = text == last_order;
            text.clone_into(&mut last_order);
            let event = SessionEvent::Command { text: text.to_owned(), command: None, repeat, gait: None };
            each(Entry::Event(RecordedEvent { t_s: row.t_s, robot: None, event }));
        }
        rows.stated = stated(&cell);
        rows.next(row, each);
    }
    rows.emit(each);
    Ok(())
}

fn csv_row<'c>(cell: &impl Fn(&str) -> Option<&'c str>) -> FullRow {
    let number = |name: &str| number_or_flag(cell(name)?);
    FullRow {
        t_s: number("t_s").unwrap_or_default(),
        time_us: number("time_us"),
        tick: cell("tick").and_then(|tick| tick.parse().ok()),
        enable: number("enable"),
        duty: number("duty"),
        voltage_v: number("voltage_v"),
        adc: number("adc"),
        adc_second: number("adc_second"),
        angle_code: number("angle_code"),
        angle_rad: number("angle_rad"),
        battery_adc: number("battery_adc"),
        battery_v: number("battery_v"),
        supply_v: number("supply_v"),
        estimate_angle_rad: number("estimate_angle_rad"),
        estimate_speed_rad_per_s: number("estimate_speed_rad_per_s"),
        reference_angle_rad: number("reference_angle_rad"),
        truth_bridge_supply_v: number("truth_bridge_supply_v"),
        stated: None,
        is_radio: false,
    }
}

pub(super) fn stated<'c>(cell: &impl Fn(&str) -> Option<&'c str>) -> Option<Stated> {
    /// Spelled as `Debug` and serde do.
    fn find<T: std::fmt::Debug>(all: impl IntoIterator<Item = T>, name: &str) -> Option<T> {
        all.into_iter().find(|one| format!("{one:?}") == name)
    }
    let state: State = find(STATES, cell("state")?)?;
    let fault: Option<Fault> = cell("fault").and_then(|name| find(FAULTS, name));
    let failed_sensor = cell("failed_sensor").and_then(|name| find([Sensor::First, Sensor::Second], name));
    let tracking = cell("tracking").and_then(number_or_flag) == Some(1.0);
    Some(Stated { state, fault, tracking, failed_sensor })
}
