//! A whole run: the samples with everything that is written beside them, read back for whoever writes it again or looks at all of it.

use std::collections::HashMap;
use std::path::Path;

use mcap::records::Record;
use serde_json::{Map, Value};

use super::builder::Layout;
use super::csv_read::number_or_flag;
use super::entries::{event, stated};
use super::mcap_others::{Others, OthersReader};
use super::mcap_stream::{Choice, Contents, Kind, records};
use super::mcap_write::{COLUMNS_KEY, Written};
use super::telemetry::At;
use super::{
    ExtraColumn, LoggedCommand, Metadata, ReadOptions, RecordedEvent, Recording, RecordingError, RunLog, Scene,
    SessionEvent, Stated, load_with, write_csv_run,
};

/// Columns of a [`RunLog`], in the order in which they are written.
const LOGGED: [&str; 3] = ["time_us", "battery_adc", "angle_code"];
/// Columns that hold no numbers: what the controller was told and said.
const TOLD: [&str; 5] = ["state", "fault", "tracking", "failed_sensor", "order"];

/// A recording with all that a run writes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// The samples.
    pub recording: Recording,
    /// Further columns: truth and belief of a simulation, or what a file has beyond the format.
    pub extra: Vec<ExtraColumn>,
    /// What it takes to decide the run again, and what was decided.
    pub log: RunLog,
    /// What viewers draw of it, in MCAP. It is made of what a simulation knows beside the samples; of a run that was read it is
    /// among the [`Self::others`].
    pub scene: Option<Scene>,
    /// What an MCAP file holds beside these, written again as it was.
    pub others: Others,
    /// What is known beside the samples.
    pub metadata: Metadata,
    /// What a person should know of the file.
    pub notes: Vec<String>,
}

impl Run {
    /// Reads a CSV or MCAP recording with everything that it holds of one robot. Where rows are left out (a window, a limit) there are
    /// the samples only.
    ///
    /// # Errors
    /// As [`load_with`].
    pub fn load(path: &Path, options: &ReadOptions) -> Result<Self, RecordingError> {
        let robot = options.robot.clone();
        let loaded = load_with(path, options)?;
        let mut run = Self { recording: loaded.recording, metadata: loaded.metadata, ..Self::default() };
        run.notes = loaded.notes;
        if loaded.kept.kept == loaded.kept.rows && loaded.kept.outside == 0 {
            let mut beside = Beside::of(run.recording.len());
            let is_csv = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
            if is_csv {
                beside.read_csv(path)?
            } else {
                beside.read_mcap(path, robot.as_deref())?
            }
            run.notes.retain(|note| !note.starts_with(super::builder::UNREAD));
            beside.give(&mut run);
        }
        Ok(run)
    }

    /// Writes the run as MCAP or CSV, by the ending of the name; the file is whole or not there.
    ///
    /// # Errors
    /// The ending is neither, the columns do not fit together, or the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let Self { recording, extra, log, scene, others, metadata, .. } = self;
        match extension.as_str() {
            "csv" => write_csv_run(path, recording, extra, log, metadata),
            "mcap" => Written { recording, extra, log, scene: scene.as_ref(), others }.write(path, metadata),
            _ => Err(RecordingError::UnknownKind { path: path.to_owned() }),
        }
    }
}

/// What stands beside the samples, as it is read.
#[derive(Default)]
pub(super) struct Beside {
    /// Samples of the recording.
    rows: usize,
    /// Rows that were seen.
    pub(super) row: usize,
    /// In the order in which they were met.
    pub(super) columns: Vec<ExtraColumn>,
    index: HashMap<String, usize>,
    /// Columns with a cell that is no number.
    pub(super) words: Vec<String>,
    stated: Vec<Stated>,
    commands: Vec<LoggedCommand>,
    now: Option<Stated>,
    others: OthersReader,
    /// Columns in the order in which they were written, where the file says it.
    order: Vec<String>,
}

impl Beside {
    /// Of so many samples.
    pub(super) fn of(rows: usize) -> Self {
        Self { rows, ..Self::default() }
    }

    /// A cell of the present row.
    fn set(&mut self, name: &str, value: f64) {
        let rows = self.rows;
        let index = *self.index.entry(name.to_owned()).or_insert_with(|| {
            self.columns.push(ExtraColumn { name: name.to_owned(), values: vec![None; rows] });
            self.columns.len() - 1
        });
        if let Some(cell) = self.columns[index].values.get_mut(self.row) {
            *cell = Some(value);
        }
    }

    fn command(&mut self, text: String, command: Option<control::Command>, repeat: bool, gait: Option<control::Gait>) {
        self.commands.push(LoggedCommand { row: self.row, text, command, repeat, gait });
    }

    /// What the present row of a table says of the controller.
    pub(super) fn told<'c>(&mut self, cell: &impl Fn(&str) -> Option<&'c str>) {
        for text in cell("order").into_iter().flat_map(|orders| orders.split(';')).map(str::trim) {
            // A table has no repeats apart from the text.
            let repeat = self.commands.last().is_some_and(|last| last.text == text);
            self.command(text.to_owned(), None, repeat, None);
        }
        self.stated.extend(stated(cell));
    }

    fn read_csv(&mut self, path: &Path) -> Result<(), RecordingError> {
        let wrong = |e: csv::Error| RecordingError::Format {
            path: path.to_owned(),
            problem: e.to_string(),
            help: "docs/recordings.md describes the format".into(),
        };
        let mut reader =
            csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_path(path).map_err(wrong)?;
        let header = reader.headers().map_err(wrong)?.clone();
        let names: Vec<String> = header.iter().map(|name| name.trim_start_matches('\u{feff}').to_owned()).collect();
        let layout = Layout::of(path, names.clone())?;
        let further = |index: &usize| layout.columns[*index].is_none() && !is_told(&names[*index]);
        let further: Vec<usize> = (0..names.len()).filter(further).collect();
        for index in &further {
            // A column that is empty throughout is one all the same.
            self.columns.push(ExtraColumn { name: names[*index].clone(), values: vec![None; self.rows] });
            self.index.insert(names[*index].clone(), self.columns.len() - 1);
        }
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(wrong)? {
            let cell = |name: &str| {
                let index = names.iter().position(|column| column == name)?;
                record.get(index).filter(|cell| !cell.is_empty())
            };
            self.told(&cell);
            for index in &further {
                match record.get(*index).unwrap_or_default() {
                    "" => {}
                    text => match number_or_flag(text) {
                        Some(value) => self.set(&names[*index], value),
                        None if self.words.contains(&names[*index]) => {}
                        None => self.words.push(names[*index].clone()),
                    },
                }
            }
            self.row += 1;
        }
        Ok(())
    }

    fn read_mcap(&mut self, path: &Path, robot: Option<&str>) -> Result<(), RecordingError> {
        let mut contents = Contents::default();
        let mut choice = Choice::new(robot);
        let (mut next, mut t_s) = (0, f64::NAN);
        records(path, None, &mut |record: Record<'_>| {
            contents.learn(path, &record)?;
            self.others.learn(&record);
            if let Record::Channel(channel) = &record {
                let columns = channel.metadata.get(COLUMNS_KEY).into_iter().flat_map(|columns| columns.split(','));
                self.order.extend(columns.map(str::to_owned));
            }
            if let (Some(topic), Record::Message { header, data }) = (contents.other(&record), &record) {
                if choice.concerns(topic) || choice.is_unnamed() {
                    self.others.message(header, data);
                }
                return Ok(());
            }
            let Some((topic, data)) = contents.message(path, &record)? else { return Ok(()) };
            match topic.kind {
                Kind::Sample if choice.takes(topic, &contents.metadata) => {
                    (self.row, next) = (next, next + 1);
                    if let Record::Message { header, .. } = &record {
                        self.others.sample(header);
                    }
                    let message = numbers(data);
                    t_s = message.get("t_s").and_then(Value::as_f64).unwrap_or(f64::NAN);
                    self.further(&message);
                    self.stated.extend(self.now);
                }
                Kind::Simulation if choice.concerns(topic) => {
                    let message = numbers(data);
                    if message.get("t_s").and_then(Value::as_f64) == Some(t_s) {
                        self.further(&message);
                    }
                }
                Kind::State if choice.concerns(topic) => {
                    self.now = serde_json::from_slice::<At<Stated>>(data).ok().map(|at| at.what);
                }
                Kind::Event if choice.concerns(topic) => {
                    let RecordedEvent { event, .. } = event(&topic.robot, data);
                    if let SessionEvent::Command { text, command, repeat, gait } = event {
                        self.row = next;
                        self.command(text, command, repeat, gait.map(|gait| *gait));
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
        Ok(())
    }

    /// The columns of a message that a [`Recording`] does not have.
    fn further(&mut self, message: &Map<String, Value>) {
        for (name, value) in message.iter().filter(|(name, _)| !Layout::is_standard(name)) {
            let number = match value {
                Value::Number(number) => number.as_f64(),
                Value::Bool(on) => Some(f64::from(u8::from(*on))),
                _ => None,
            };
            match number {
                Some(number) => self.set(name, number),
                None if self.index.contains_key(name) => {}
                None if value.is_null() => {
                    self.columns.push(ExtraColumn { name: name.clone(), values: vec![None; self.rows] });
                    self.index.insert(name.clone(), self.columns.len() - 1);
                }
                None if self.words.contains(name) => {}
                None => self.words.push(name.clone()),
            }
        }
    }

    /// Sorts what was read into a run.
    pub(super) fn give(self, run: &mut Run) {
        let Self { mut columns, words, mut stated, mut commands, others, order, .. } = self;
        columns.sort_by_key(|column| order.iter().position(|name| *name == column.name).unwrap_or(usize::MAX));
        let place = |name: &str| LOGGED.iter().position(|logged| *logged == name);
        let numbers = columns.into_iter().filter(|column| !words.contains(&column.name));
        let (mut logged, extra): (Vec<_>, Vec<_>) = numbers.partition(|column| place(&column.name).is_some());
        logged.sort_by_key(|column| place(&column.name));
        if !words.is_empty() {
            run.notes.push(format!("{}{}", super::builder::UNREAD, words.join(", ")));
        }
        // Of a session that began before its first state, and of orders after the last sample, nothing is left to write them beside.
        if stated.len() != self.rows {
            stated = Vec::new();
        }
        commands.retain(|command| command.row < self.rows);
        (run.extra, run.log) = (extra, RunLog { numbers: logged, stated, commands });
        match others.finish() {
            Ok(others) => run.others = others,
            Err(note) => run.notes.push(note),
        }
    }
}

/// Whether a column says what the controller was told or said.
pub(super) fn is_told(name: &str) -> bool {
    TOLD.contains(&name)
}

/// The members of a JSON object; none where it is not one, which [`load_with`] has refused in a sample.
fn numbers(data: &[u8]) -> Map<String, Value> {
    serde_json::from_slice(data).unwrap_or_default()
}
