//! Reads MCAP as a stream, in bounded memory.

use std::path::Path;

use mcap::records::Record;
use serde_json::{Map, Value};

use super::builder::{Builder, Layout, UNREAD, Values};
use super::error::RowNumber;
use super::mcap_stream::{Choice, Contents, Ending, Kind, records};
use super::mcap_write::SAMPLE_TOPIC;
use super::{Loaded, Place, ReadOptions, RecordingError, Window};

/// Reads a file; the columns are those of the first sample.
pub(super) fn read(path: &Path, options: &ReadOptions) -> Result<Loaded, RecordingError> {
    let mut state = State {
        path,
        limit: options.limit,
        window: options.window,
        as_written: options.as_written,
        contents: Contents::default(),
        choice: Choice::new(options.robot.as_deref()),
        own_name: None,
        rows: None,
        messages: 0,
    };
    let ending = records(path, options.progress, &mut |record| state.take(&record))?;
    state.finish(ending)
}

struct State<'a> {
    path: &'a Path,
    limit: usize,
    window: Window,
    as_written: bool,
    contents: Contents,
    choice: Choice,
    /// Of the robot that is read, where the file is of several.
    own_name: Option<String>,
    rows: Option<(Layout, Builder)>,
    messages: u64,
}

impl State<'_> {
    fn take(&mut self, record: &Record<'_>) -> Result<(), RecordingError> {
        self.contents.learn(self.path, record)?;
        let Some((topic, data)) = self.contents.message(self.path, record)? else { return Ok(()) };
        if topic.kind != Kind::Sample || !self.choice.takes(topic, &self.contents.metadata) {
            return Ok(());
        }
        if self.own_name.is_none() {
            self.own_name.clone_from(&topic.own_name);
        }
        self.message(data)
    }

    fn message(&mut self, data: &[u8]) -> Result<(), RecordingError> {
        self.messages += 1;
        let row = RowNumber::Message(self.messages);
        let place = Place { path: self.path.to_owned(), row };
        let message: Map<String, Value> = serde_json::from_slice(data).map_err(|e| RecordingError::RowNumber {
            place: place.clone(),
            problem: format!("not a JSON object: {e}"),
            help: "docs/recordings.md describes the schema".into(),
        })?;
        if self.rows.is_none() {
            let layout = Layout::of(self.path, message.keys().cloned().collect())?;
            let builder = Builder::new(self.path, &layout, self.limit, self.window).judging_units(self.as_written);
            self.rows = Some((layout, builder));
        }
        let Some((layout, builder)) = &mut self.rows else { return Ok(()) };
        let mut values = Values::default();
        for (column, name) in layout.columns.iter().zip(&layout.names) {
            let Some(column) = column else { continue };
            let value = match message.get(name) {
                None | Some(Value::Null) => None,
                Some(Value::Number(number)) => number.as_f64(),
                Some(Value::Bool(on)) => Some(f64::from(u8::from(*on))),
                Some(other) => {
                    return Err(RecordingError::Cell {
                        place,
                        column: name.clone(),
                        problem: format!("{other} is not a number"),
                        help: "write numbers, or null for a missing value".into(),
                    });
                }
            };
            values.set(*column, value);
        }
        builder.push(row, &values)
    }

    fn finish(self, ending: Ending) -> Result<Loaded, RecordingError> {
        self.choice.check(self.path)?;
        let Some((layout, builder)) = self.rows else { return Err(self.no_rows(ending)) };
        let (recording, kept) = builder.finish()?;
        let mut notes = Vec::new();
        let ignored = layout.ignored();
        if !ignored.is_empty() {
            notes.push(format!("{UNREAD}{}", ignored.join(", ")));
        }
        notes.extend(kept.notes());
        notes.extend(ending.note());
        let mut metadata = self.contents.metadata;
        if self.own_name.is_some() {
            metadata.robot = self.own_name;
        }
        Ok(Loaded { recording, metadata, kept, notes })
    }

    fn no_rows(&self, ending: Ending) -> RecordingError {
        let path = self.path.to_owned();
        let (problem, help) = match ending {
            Ending::CutOff => ("the file was cut off before its first sample".to_owned(), "record the run again"),
            Ending::Whole if self.contents.has_samples() => return RecordingError::NoSamples { path },
            Ending::Whole => (
                format!("no topic {SAMPLE_TOPIC}; there is [{}]", self.contents.names().join(", ")),
                "docs/recordings.md describes topics and columns",
            ),
        };
        RecordingError::Format { path, problem, help: help.to_owned() }
    }
}
