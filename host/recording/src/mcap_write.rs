//! Writes MCAP: self-describing JSON messages with a JSON schema, which the field's viewers open.
//!
//! Topic `/sample` holds what a robot measured, `/simulation` what only a simulation knows, `/event` what the controller was
//! told and `/state` what it said; a scene for viewers has topics of its own ([`super::mcap_scene`]). Uncompressed chunks with
//! indexes; the metadata comes first, so that even a file that was cut off tells what it is.

use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use serde_json::{Map, Value, json};

use super::rows::{self, Cell};
use common::atomic::write_atomically;

use super::mcap_others::{Others, OthersWriter};
use super::mcap_scene::SceneWriter;
use super::schema::{event_schema, state_schema};
use super::telemetry::At;
use super::{ExtraColumn, LoggedCommand, Metadata, Recording, RecordingError, RunLog, Scene, SessionEvent};

/// Topic of the standard columns.
pub(super) const SAMPLE_TOPIC: &str = "/sample";
/// Topic of the extra columns.
const EXTRA_TOPIC: &str = "/simulation";
/// Key of a channel's metadata: its columns in their order, with commas between them. The members of a message have none.
pub(super) const COLUMNS_KEY: &str = "columns";
/// Name of the metadata record.
pub(super) const METADATA_NAME: &str = "run";

/// Writes a recording; the file is whole or not there.
///
/// # Errors
/// The file system refuses, or the recording's columns differ in length.
pub fn write_mcap(path: &Path, recording: &Recording) -> Result<(), RecordingError> {
    write_mcap_with(path, recording, &[], &Metadata::default())
}

/// [`write_mcap`] with further columns and metadata.
///
/// # Errors
/// As [`write_mcap`].
pub fn write_mcap_with(
    path: &Path,
    recording: &Recording,
    extra: &[ExtraColumn],
    metadata: &Metadata,
) -> Result<(), RecordingError> {
    let run = Written { recording, extra, log: &RunLog::default(), scene: None, others: &Others::default() };
    run.write(path, metadata)
}

/// What of a run is written beside its metadata.
pub(super) struct Written<'a> {
    pub(super) recording: &'a Recording,
    pub(super) extra: &'a [ExtraColumn],
    pub(super) log: &'a RunLog,
    /// Its states after the last sample are left out.
    pub(super) scene: Option<&'a Scene>,
    pub(super) others: &'a Others,
}

impl Written<'_> {
    /// The file is whole or not there. Fails as [`write_mcap`] does, and where the log does not fit the samples, or the scene's frames
    /// not its states.
    pub(super) fn write(&self, path: &Path, metadata: &Metadata) -> Result<(), RecordingError> {
        rows::check_rectangular(path, self.recording, self.extra)?;
        self.log.check(path, self.recording)?;
        self.scene.map_or(Ok(()), |scene| scene.check(path))?;
        let metadata = metadata.to_toml(path)?;
        write_atomically::<io::Error>(path, |file| write_watched(file, self, &metadata))
            .map_err(|e| RecordingError::io(path, e))
    }
}

/// Writes, and fails with the file's own error.
fn write_watched(file: impl Write + Seek, run: &Written<'_>, metadata: &str) -> io::Result<()> {
    let mut file = Watched { file, error: None };
    let written = write(&mut file, run, metadata);
    written.map_err(|error| file.error.take().unwrap_or_else(|| into_io(error)))
}

/// A file that keeps its first error. `mcap` wraps the errors of some writes so that neither their kind nor their source can be
/// asked for, and a full disk would not be known as one.
struct Watched<W> {
    file: W,
    error: Option<io::Error>,
}

impl<W> Watched<W> {
    fn watch<R>(&mut self, operation: impl FnOnce(&mut W) -> io::Result<R>) -> io::Result<R> {
        operation(&mut self.file).inspect_err(|error| {
            // An interrupted write is tried again.
            if error.kind() != io::ErrorKind::Interrupted {
                // An error cannot be copied, but what it says can.
                let copy = || error.raw_os_error().map_or_else(|| error.kind().into(), io::Error::from_raw_os_error);
                self.error.get_or_insert_with(copy);
            }
        })
    }
}

impl<W: Write> Write for Watched<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.watch(|file| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.watch(Write::flush)
    }
}

impl<W: Seek> Seek for Watched<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.watch(|file| file.seek(to))
    }
}

pub(super) fn into_io(error: mcap::McapError) -> io::Error {
    match error {
        mcap::McapError::Io(source) => source,
        other => io::Error::other(other),
    }
}

fn write<W: Write + Seek>(file: W, run: &Written<'_>, metadata: &str) -> mcap::McapResult<()> {
    let &Written { recording, extra, log, scene, others } = run;
    let options = mcap::WriteOptions::new().compression(None).library(concat!("scram ", env!("CARGO_PKG_VERSION")));
    let mut writer = options.create(file)?;
    writer.write_metadata(&mcap::records::Metadata {
        name: METADATA_NAME.into(),
        metadata: BTreeMap::from([("toml".to_owned(), metadata.to_owned())]),
    })?;
    let names = rows::standard_names(recording);
    let columns = names.iter().copied().chain(log.numbers.iter().map(|column| column.name.as_str()));
    let sample = channel(&mut writer, SAMPLE_TOPIC, "scram.Sample", columns)?;
    let simulation = if extra.is_empty() {
        None
    } else {
        let columns = std::iter::once("t_s").chain(extra.iter().map(|column| column.name.as_str()));
        Some(channel(&mut writer, EXTRA_TOPIC, "scram.Simulation", columns)?)
    };
    let told = EventChannels::begin(&mut writer, log, !recording.adc_second.is_empty())?;
    let start = recording.t_s.first().copied().unwrap_or(0.0);
    // The log time is for viewers and cannot be negative; t_s in the message is the time.
    let log_time = |t_s: f64| ((if start < 0.0 { t_s - start } else { t_s }) * 1e9).round() as u64;
    let mut scene = scene.map(|scene| SceneWriter::begin(&mut writer, scene, log_time(start))).transpose()?;
    let mut others = OthersWriter::begin(&mut writer, others, log_time(start))?;
    let mut cells = Vec::new();
    let mut given = 0;
    for row in 0..recording.len() {
        let t_s = recording.t_s[row];
        let time = log_time(t_s);
        // The counter may wrap: a viewer's hint, 32 bit by the format.
        let header = |channel_id| mcap::records::MessageHeader {
            channel_id,
            sequence: row as u32,
            log_time: time,
            publish_time: time,
        };
        if let Some(scene) = &mut scene {
            scene.until(&mut writer, t_s, log_time)?;
        }
        others.until(&mut writer, time)?;
        // Commands and states before the sample of their tick.
        for command in log.commands_before(row, &mut given) {
            told.command(&mut writer, &header(told.event), t_s, command)?;
        }
        told.state(&mut writer, &header(told.state), t_s, log, row)?;
        rows::standard_cells(recording, row, &mut cells);
        let mut message: Map<String, Value> =
            names.iter().zip(&cells).map(|(name, cell)| ((*name).to_owned(), value(cell))).collect();
        message.extend(log.numbers.iter().map(|c| (c.name.clone(), value(&Cell::from(c.values[row])))));
        writer.write_to_known_channel(&header(sample), Value::Object(message).to_string().as_bytes())?;
        if let Some(channel) = simulation {
            let mut message = Map::new();
            message.insert("t_s".into(), json!(t_s));
            message.extend(extra.iter().map(|c| (c.name.clone(), value(&Cell::from(c.values[row])))));
            writer.write_to_known_channel(&header(channel), Value::Object(message).to_string().as_bytes())?;
        }
    }
    others.until(&mut writer, u64::MAX)?;
    writer.finish()?;
    Ok(())
}

/// Channels of what a controller was told and said; 0, which is no channel, where there is nothing to tell.
struct EventChannels {
    event: u16,
    state: u16,
}

impl EventChannels {
    fn begin<W: Write + Seek>(writer: &mut mcap::Writer<W>, log: &RunLog, two_sensors: bool) -> mcap::McapResult<Self> {
        let mut add = |topic: &str, name: &str, schema: Value| {
            let schema = writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
            writer.add_channel(schema, topic, "json", &BTreeMap::new())
        };
        Ok(Self {
            event: if log.commands.is_empty() { 0 } else { add("/event", "scram.Event", event_schema())? },
            state: if log.stated.is_empty() { 0 } else { add("/state", "scram.State", state_schema(two_sensors))? },
        })
    }

    fn command<W: Write + Seek>(
        &self,
        writer: &mut mcap::Writer<W>,
        header: &mcap::records::MessageHeader,
        t_s: f64,
        command: &LoggedCommand,
    ) -> mcap::McapResult<()> {
        let LoggedCommand { text, command, repeat, gait, .. } = command.clone();
        let message = At { t_s, what: SessionEvent::Command { text, command, repeat, gait: gait.map(Box::new) } };
        writer.write_to_known_channel(header, json!(message).to_string().as_bytes())
    }

    /// Where it changes.
    fn state<W: Write + Seek>(
        &self,
        writer: &mut mcap::Writer<W>,
        header: &mcap::records::MessageHeader,
        t_s: f64,
        log: &RunLog,
        row: usize,
    ) -> mcap::McapResult<()> {
        match log.stated.get(row) {
            Some(now) if row == 0 || log.stated[row - 1] != *now => {
                writer.write_to_known_channel(header, json!(At { t_s, what: *now }).to_string().as_bytes())
            }
            _ => Ok(()),
        }
    }
}

fn value(cell: &Cell) -> Value {
    match cell {
        Cell::Empty => Value::Null,
        Cell::Number(number) => json!(number),
        Cell::Whole(number) => json!(number),
    }
}

fn channel<'a, W: std::io::Write + std::io::Seek>(
    writer: &mut mcap::Writer<W>,
    topic: &str,
    name: &str,
    columns: impl Iterator<Item = &'a str>,
) -> mcap::McapResult<u16> {
    let columns: Vec<&str> = columns.collect();
    let properties: Map<String, Value> = columns
        .iter()
        .map(|&column| {
            let kind = match column {
                "t_s" | "duty" | "voltage_v" | "supply_v" => json!({ "type": "number" }),
                "enable" => json!({ "type": "integer" }),
                "adc" | "adc_second" => json!({ "type": ["integer", "null"] }),
                _ => json!({ "type": ["number", "null"] }),
            };
            (column.to_owned(), kind)
        })
        .collect();
    let schema = json!({ "title": name, "type": "object", "properties": properties });
    let schema = writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
    let about = BTreeMap::from([(COLUMNS_KEY.to_owned(), columns.join(","))]);
    writer.add_channel(schema, topic, "json", &about)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// A file on a disk with so many bytes left.
    struct Small {
        file: Cursor<Vec<u8>>,
        room: usize,
    }

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let room = self.room.saturating_sub(self.file.position() as usize);
            if room == 0 && !bytes.is_empty() {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.file.write(&bytes[..bytes.len().min(room)])
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Small {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.file.seek(to)
        }
    }

    #[test]
    fn wherever_the_disk_is_full_the_error_says_so() {
        let recording = Recording {
            t_s: vec![0.0, 1e-3, 2e-3],
            drive: crate::Drive::Duty(vec![0.0, 0.5, 1.0]),
            enable: vec![true; 3],
            angle: crate::AngleReading::Adc(vec![Some(1), None, Some(3)]),
            ..Recording::default()
        };
        let run = Written {
            recording: &recording,
            extra: &[],
            log: &RunLog::default(),
            scene: None,
            others: &Others::default(),
        };
        let mut small = Small { file: Cursor::default(), room: usize::MAX };
        write_watched(&mut small, &run, "").unwrap();
        let whole = small.file.get_ref().len();
        for room in 0..whole {
            let mut small = Small { file: Cursor::default(), room };
            let written = write_watched(&mut small, &run, "");
            assert_eq!(written.unwrap_err().kind(), io::ErrorKind::StorageFull, "{room} of {whole} bytes");
        }
    }
}
