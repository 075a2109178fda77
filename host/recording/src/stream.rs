//! Records a console session while it runs, several robots in one MCAP file.
//!
//! The records stand in the file one by one, not in chunks: a chunk is readable only once it is closed, and its index would
//! stay in memory for every chunk of the day. After [`SessionRecorder::flush`] the operating system has every byte, so
//! that `kill -9` loses nothing flushed; the readers need no end. What that costs (no index, no compression) is in
//! `docs/recordings.md`, with the command that makes up for it afterwards.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

use common::atomic::sync_directory;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use serde::Serialize;
use serde_json::Value;

use super::error::{Left, is_disk_full};
use super::mcap_write::{METADATA_NAME, into_io};
use super::schema::{event_schema, link_schema, sample_schema, state_schema};
use super::sink::Sink;
use super::telemetry::At;
use super::{LinkQuality, MeasuredPose, Metadata, RecordingError, SessionEvent, Stated, TelemetryRow};

/// What may wait in memory for a flush, bytes.
const MOST_WAITING: usize = 64 << 10;
/// Key of a channel's metadata: the robot's own name, before it was made unique.
pub(super) const ROBOT_KEY: &str = "robot";
/// Key of a channel's metadata: how exact the values are.
pub(super) const VALUES_KEY: &str = "values";
/// Value of [`VALUES_KEY`]: to the steps of `control::protocol::radio::PackedTick`.
pub(super) const RADIO_VALUES: &str = "radio";

/// A robot of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotChannel(usize);

/// Channels and last values of one robot.
struct Robot {
    name: String,
    sample: u16,
    state: u16,
    event: u16,
    link: u16,
    last_t_s: Option<f64>,
    last_stated: Option<Stated>,
    last_battery_v: Option<f32>,
}

/// A recording that grows. Nothing that it takes could hold a key.
pub struct SessionRecorder {
    path: PathBuf,
    writer: mcap::Writer<NoSeek<Sink>>,
    robots: Vec<Robot>,
    /// Channel of what concerns no single robot.
    event: u16,
    message: Vec<u8>,
    /// Bytes since the last flush.
    waiting: usize,
    /// Of messages, for viewers; comes round.
    sequence: u32,
    /// Why nothing is recorded any more.
    stopped: Option<Why>,
}

/// Why a recording stops.
#[derive(Clone, Debug, PartialEq)]
enum Why {
    DiskFull,
    Other(String),
}

impl Why {
    fn of(error: &std::io::Error) -> Self {
        if is_disk_full(error) { Self::DiskFull } else { Self::Other(error.to_string()) }
    }

    fn at(&self, path: &Path) -> RecordingError {
        let path = path.to_owned();
        match self {
            Self::DiskFull => RecordingError::DiskFull { path, kept: Left::Beginning },
            Self::Other(why) => RecordingError::Stopped { path, why: why.clone() },
        }
    }
}

/// `mcap` says of every error of the file that it is one "from writing, or reading a compression stream".
impl From<mcap::McapError> for Why {
    fn from(error: mcap::McapError) -> Self {
        Self::of(&into_io(error))
    }
}

/// `/NAME/sample`: what changes with every tick or so, under the names of the columns.
#[derive(Serialize)]
struct SampleMessage {
    t_s: f64,
    tick: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_us: Option<u64>,
    enable: u8,
    duty: f32,
    adc: u16,
    #[serde(skip_serializing_if = "Option::is_none")]
    adc_second: Option<u16>,
    estimate_angle_rad: Option<f32>,
    estimate_speed_rad_per_s: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    supply_v: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    battery_v: Option<f32>,
    #[serde(flatten)]
    pose: Option<MeasuredPose>,
}

impl SessionRecorder {
    /// Begins a file; directories are made.
    ///
    /// # Errors
    /// The file is there already, or cannot be written.
    pub fn create(path: &Path, metadata: &Metadata) -> Result<Self, RecordingError> {
        let toml = metadata.to_toml(path)?;
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(directory).map_err(|e| RecordingError::io(directory, e))?;
        let file = File::options().write(true).create_new(true).open(path).map_err(|e| match e.kind() {
            std::io::ErrorKind::AlreadyExists => RecordingError::Exists { path: path.to_owned() },
            _ => RecordingError::io(path, e),
        })?;
        // Its end is on disk when it is finished; so shall its name be.
        sync_directory(directory).map_err(|e| RecordingError::io(directory, e))?;
        Self::begin(file, path, toml).map_err(|e| {
            // It holds no row. Where it cannot be removed, it is there and empty.
            let _ = std::fs::remove_file(path);
            match Why::from(e) {
                Why::DiskFull => RecordingError::DiskFull { path: path.to_owned(), kept: Left::Before },
                other => other.at(path),
            }
        })
    }

    fn begin(file: File, path: &Path, toml: String) -> mcap::McapResult<Self> {
        // No index of anything that grows with the session: the writer would hold it in memory.
        let options = mcap::WriteOptions::new()
            .compression(None)
            .use_chunks(false)
            .disable_seeking(true)
            .emit_metadata_indexes(false)
            .library(concat!("scram ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(NoSeek::new(Sink::new(file)))?;
        writer.write_metadata(&mcap::records::Metadata {
            name: METADATA_NAME.into(),
            metadata: BTreeMap::from([("toml".to_owned(), toml)]),
        })?;
        let event = channel(&mut writer, "/event", "scram.Event", &event_schema(), &BTreeMap::new())?;
        writer.flush()?;
        Ok(Self {
            path: path.to_owned(),
            writer,
            robots: Vec::new(),
            event,
            message: Vec::new(),
            waiting: 0,
            sequence: 0,
            stopped: None,
        })
    }

    /// Where it writes.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A robot's place in the file: topics `/NAME/sample`, `/NAME/state`, `/NAME/event`, `/NAME/link`. A second robot of
    /// one name gets `-2` behind it, and what a topic cannot hold becomes `-`: see [`SessionRecorder::robot_name`].
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn robot(&mut self, name: &str) -> Result<RobotChannel, RecordingError> {
        self.is_going_on()?;
        let unique = self.unique(name);
        let added = self.add(name, unique);
        let robot = added.map_err(|e| self.stop(e))?;
        self.robots.push(robot);
        self.flush()?;
        Ok(RobotChannel(self.robots.len() - 1))
    }

    /// The name under which a robot is found in the file.
    #[must_use]
    pub fn robot_name(&self, robot: RobotChannel) -> &str {
        self.robots.get(robot.0).map_or("", |robot| robot.name.as_str())
    }

    /// One tick. The state is written where it changes, the battery where it does.
    ///
    /// # Errors
    /// Its time is not after that of the robot's last row: this row is left out and the recording goes on. Or the
    /// recording has stopped.
    pub fn sample(&mut self, robot: RobotChannel, row: &TelemetryRow) -> Result<(), RecordingError> {
        self.is_going_on()?;
        let t_s = (row.t_s * 1e6).round() / 1e6;
        let known = self.known(robot)?;
        if !t_s.is_finite() || t_s < 0.0 || known.last_t_s.is_some_and(|last| t_s <= last) {
            let problem = format!("a row at {t_s} s was left out: it must come after the robot's last one");
            return Err(RecordingError::Format {
                path: self.path.clone(),
                problem,
                help: "telemetry that comes twice or late is not recorded".into(),
            });
        }
        let changed = known.last_stated != Some(row.stated);
        let battery_v = row.battery_v.filter(|volt| known.last_battery_v != Some(*volt) && volt.is_finite());
        known.last_t_s = Some(t_s);
        known.last_stated = Some(row.stated);
        known.last_battery_v = row.battery_v;
        let (sample, state) = (known.sample, known.state);
        if changed {
            self.write(state, t_s, &At { t_s, what: row.stated })?;
        }
        let finite = |value: f32| value.is_finite().then_some(value);
        let message = SampleMessage {
            t_s,
            tick: row.tick,
            time_us: row.time_us,
            enable: u8::from(row.duty.is_some()),
            duty: row.duty.and_then(finite).unwrap_or(0.0),
            adc: row.adc,
            adc_second: row.adc_second,
            estimate_angle_rad: finite(row.angle_rad),
            estimate_speed_rad_per_s: finite(row.speed_rad_per_s),
            supply_v: row.supply_v.and_then(finite),
            battery_v,
            pose: row.pose,
        };
        self.write(sample, t_s, &message)
    }

    /// Something that happened; of one robot, or of the whole session.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn event(&mut self, t_s: f64, robot: Option<RobotChannel>, event: &SessionEvent) -> Result<(), RecordingError> {
        self.is_going_on()?;
        let channel = match robot {
            Some(robot) => self.known(robot)?.event,
            None => self.event,
        };
        self.write(channel, t_s, &At { t_s, what: event })
    }

    /// How well a robot is heard.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn link(&mut self, t_s: f64, robot: RobotChannel, quality: &LinkQuality) -> Result<(), RecordingError> {
        self.is_going_on()?;
        let channel = self.known(robot)?.link;
        self.write(channel, t_s, &At { t_s, what: quality })
    }

    /// Hands everything to the operating system: what was recorded until now survives the end of this process, whatever
    /// that is. Some times a second is often enough.
    ///
    /// # Errors
    /// The disk is full or gone; what was recorded until then stays readable.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.is_going_on()?;
        self.waiting = 0;
        self.writer.flush().map_err(|e| self.stop(e))
    }

    /// Writes the end and waits until all of it is on the disk.
    ///
    /// # Errors
    /// As [`SessionRecorder::flush`].
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.flush()?;
        self.writer.finish().map_err(|e| self.stop(e))?;
        self.writer.into_inner().into_inner().sync().map_err(|e| Why::of(&e).at(&self.path))
    }

    fn write(&mut self, channel_id: u16, t_s: f64, message: &impl Serialize) -> Result<(), RecordingError> {
        self.message.clear();
        let text = serde_json::to_writer(&mut self.message, message);
        text.map_err(|e| self.stop(Why::Other(e.to_string())))?;
        self.sequence = self.sequence.wrapping_add(1);
        // Saturates: a time that is NaN is still in the file.
        let log_time = (t_s * 1e9).round() as u64;
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        let written = self.writer.write_to_known_channel(&header, &self.message);
        written.map_err(|e| self.stop(e))?;
        self.waiting += self.message.len();
        if self.waiting > MOST_WAITING { self.flush() } else { Ok(()) }
    }

    fn is_going_on(&self) -> Result<(), RecordingError> {
        self.stopped.as_ref().map_or(Ok(()), |why| Err(why.at(&self.path)))
    }

    /// The first reason stays.
    fn stop(&mut self, why: impl Into<Why>) -> RecordingError {
        self.stopped.get_or_insert_with(|| why.into()).at(&self.path)
    }

    fn known(&mut self, robot: RobotChannel) -> Result<&mut Robot, RecordingError> {
        self.robots.get_mut(robot.0).ok_or_else(|| RecordingError::Format {
            path: self.path.clone(),
            problem: "a robot of another recording".into(),
            help: "this is a defect of scram: please report the command that led here".into(),
        })
    }

    fn unique(&self, name: &str) -> String {
        let plain: String = name.trim().chars().map(|c| if c == '/' || c.is_whitespace() { '-' } else { c }).collect();
        let plain = if plain.is_empty() { "robot".to_owned() } else { plain };
        let is_free = |name: &String| self.robots.iter().all(|robot| robot.name != *name);
        let numbered = (2..).map(|n: u32| format!("{plain}-{n}"));
        std::iter::once(plain.clone()).chain(numbered).find(is_free).unwrap_or(plain)
    }

    fn add(&mut self, own_name: &str, name: String) -> mcap::McapResult<Robot> {
        let mut about = BTreeMap::from([(ROBOT_KEY.to_owned(), own_name.to_owned())]);
        let writer = &mut self.writer;
        let mut add = |kind: &str, schema: &str, what: &Value, about: &BTreeMap<String, String>| {
            channel(writer, &format!("/{name}/{kind}"), schema, what, about)
        };
        let state = add("state", "scram.State", &state_schema(true), &about)?;
        let event = add("event", "scram.Event", &event_schema(), &about)?;
        let link = add("link", "scram.Link", &link_schema(), &about)?;
        about.insert(VALUES_KEY.to_owned(), RADIO_VALUES.to_owned());
        let sample = add("sample", "scram.Sample", &sample_schema(), &about)?;
        Ok(Robot { name, sample, state, event, link, last_t_s: None, last_stated: None, last_battery_v: None })
    }
}

fn channel<W: std::io::Write + std::io::Seek>(
    writer: &mut mcap::Writer<W>,
    topic: &str,
    name: &str,
    schema: &Value,
    about: &BTreeMap<String, String>,
) -> mcap::McapResult<u16> {
    let schema = writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
    writer.add_channel(schema, topic, "json", about)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// On a device that is always full.
    fn recorder() -> mcap::McapResult<SessionRecorder> {
        let file = File::options().write(true).open("/dev/full")?;
        SessionRecorder::begin(file, Path::new("out/session.mcap"), String::new())
    }

    #[test]
    fn a_full_disk_is_called_so() {
        assert_eq!(recorder().err().map(Why::from), Some(Why::DiskFull));
        let said = Why::DiskFull.at(Path::new("out/session.mcap")).to_string();
        assert!(said.starts_with("out/session.mcap: the disk is full: what was recorded until then is kept"), "{said}");
        let quota = std::io::Error::from(std::io::ErrorKind::QuotaExceeded);
        assert_eq!(Why::from(mcap::McapError::Io(quota)), Why::DiskFull);
    }

    #[test]
    fn the_first_reason_stays() {
        let directory = tempfile::tempdir().unwrap();
        let mut recorder =
            SessionRecorder::create(&directory.path().join("session.mcap"), &Metadata::default()).unwrap();
        let full = mcap::McapError::Io(std::io::ErrorKind::StorageFull.into());
        for why in [Why::from(full), Why::Other("an earlier write failed".into())] {
            assert!(matches!(recorder.stop(why), RecordingError::DiskFull { .. }));
        }
        assert!(matches!(recorder.flush(), Err(RecordingError::DiskFull { .. })));
    }
}
