//! Reads MCAP as a stream, in bounded memory.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde_json::{Map, Value};

use super::builder::{Builder, Layout, Values};
use super::error::Row;
use super::mcap_write::{METADATA_NAME, SAMPLE_TOPIC};
use super::{Loaded, Metadata, Place, ReadOptions, RecordingError, progress};

/// No record of a recording comes near this; a damaged length must not take all memory.
const LONGEST_RECORD: usize = 1 << 26;

/// Reads a file; the columns are those of the first message on `/sample`.
pub(super) fn read(path: &Path, options: &ReadOptions) -> Result<Loaded, RecordingError> {
    let (bar, mut file) = progress::open(path, options.progress).map_err(|e| RecordingError::io(path, e))?;
    let reading =
        LinearReaderOptions::default().with_validate_chunk_crcs(true).with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(reading);
    let mut state =
        State { path, limit: options.limit, topics: HashMap::new(), metadata: None, rows: None, messages: 0 };
    let mut read_any = false;
    while let Some(event) = reader.next_event() {
        match event.map_err(|e| damaged(path, &e, state.messages, read_any))? {
            LinearReadEvent::ReadRequest(wanted) => {
                let got = file.read(reader.insert(wanted)).map_err(|e| RecordingError::io(path, e))?;
                read_any |= got > 0;
                reader.notify_read(got);
            }
            LinearReadEvent::Record { data, opcode } => {
                let record =
                    mcap::parse_record(opcode, data).map_err(|e| damaged(path, &e, state.messages, read_any))?;
                state.take(record)?;
            }
        }
    }
    bar.finish_and_clear();
    state.finish()
}

struct State<'a> {
    path: &'a Path,
    limit: usize,
    topics: HashMap<u16, (String, String)>,
    metadata: Option<Metadata>,
    rows: Option<(Layout, Builder)>,
    messages: u64,
}

impl State<'_> {
    fn take(&mut self, record: Record<'_>) -> Result<(), RecordingError> {
        match record {
            Record::Channel(channel) => {
                self.topics.insert(channel.id, (channel.topic, channel.message_encoding));
            }
            Record::Metadata(found) if found.name == METADATA_NAME => {
                let text = found.metadata.get("toml").map_or("", String::as_str);
                self.metadata = Some(toml::from_str(text).map_err(|e| RecordingError::Format {
                    path: self.path.to_owned(),
                    problem: format!("metadata record `{METADATA_NAME}`: {}", e.message()),
                    help: "allowed keys: robot, excitation, notes, temperature_c, surface, tilt_deg, seed".into(),
                })?);
            }
            Record::Message { header, data } => {
                let Some((topic, encoding)) = self.topics.get(&header.channel_id) else {
                    return Ok(());
                };
                if topic == SAMPLE_TOPIC {
                    if encoding != "json" {
                        return Err(RecordingError::Format {
                            path: self.path.to_owned(),
                            problem: format!("topic {SAMPLE_TOPIC} is encoded as `{encoding}`, expected `json`"),
                            help: "docs/recordings.md describes the schema".into(),
                        });
                    }
                    self.message(&data)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, data: &[u8]) -> Result<(), RecordingError> {
        self.messages += 1;
        let row = Row::Message(self.messages);
        let place = Place { path: self.path.to_owned(), row };
        let message: Map<String, Value> = serde_json::from_slice(data).map_err(|e| RecordingError::Row {
            place: place.clone(),
            problem: format!("not a JSON object: {e}"),
            help: "docs/recordings.md describes the schema".into(),
        })?;
        if self.rows.is_none() {
            let layout = Layout::of(self.path, message.keys().cloned().collect())?;
            let builder = Builder::new(self.path, &layout, self.limit);
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

    fn finish(self) -> Result<Loaded, RecordingError> {
        let Some((layout, builder)) = self.rows else {
            if self.topics.values().any(|(topic, _)| topic == SAMPLE_TOPIC) {
                return Err(RecordingError::NoSamples { path: self.path.to_owned() });
            }
            let mut topics: Vec<&str> = self.topics.values().map(|(topic, _)| topic.as_str()).collect();
            topics.sort_unstable();
            return Err(RecordingError::Format {
                path: self.path.to_owned(),
                problem: format!("no topic {SAMPLE_TOPIC}; there is [{}]", topics.join(", ")),
                help: "docs/recordings.md describes topics and columns".into(),
            });
        };
        let (recording, kept) = builder.finish()?;
        let mut notes = Vec::new();
        let ignored = layout.ignored();
        if !ignored.is_empty() {
            notes.push(format!("columns that are not read: {}", ignored.join(", ")));
        }
        notes.extend(kept.note());
        Ok(Loaded { recording, metadata: self.metadata.unwrap_or_default(), kept, notes })
    }
}

fn damaged(path: &Path, error: &mcap::McapError, messages: u64, read_any: bool) -> RecordingError {
    if !read_any {
        return RecordingError::Empty { path: path.to_owned() };
    }
    let (problem, help) = match error {
        mcap::McapError::BadMagic if messages == 0 => {
            ("this is not an MCAP file".to_owned(), "name it .csv if it is text".to_owned())
        }
        other => (
            format!("after message {messages}: {other}"),
            "the file was cut off or damaged: `mcap recover` (mcap.dev) saves its whole chunks".to_owned(),
        ),
    };
    RecordingError::Format { path: path.to_owned(), problem, help }
}
