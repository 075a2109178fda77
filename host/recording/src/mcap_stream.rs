//! The records of an MCAP file from its begin to its end, or to where it was cut off.

use std::collections::{BTreeSet, HashMap};
use std::io::{BufReader, Read};
use std::path::Path;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::mcap_write::METADATA_NAME;
use super::stream::{RADIO_VALUES, ROBOT_KEY, VALUES_KEY};
use super::{Metadata, Progress, RecordingError, mcap_chunks, progress};

/// No record of a recording comes near this; a damaged length must not take all memory.
const LONGEST_RECORD: usize = 1 << 26;

/// How a file ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    Whole,
    /// Whoever wrote it did not come to its end; every whole record was read.
    CutOff,
}

impl Ending {
    /// A sentence for people; `None` for a whole file.
    pub(super) fn note(self) -> Option<String> {
        (self == Self::CutOff).then(|| {
            "the file has no end: its recorder was killed, or the copy was cut off; all up to there was read".into()
        })
    }
}

/// Gives every record to `each`, in bounded memory.
///
/// # Errors
/// The file cannot be read or is damaged, or `each` fails. A file that is cut off is no error.
pub(super) fn records(
    path: &Path,
    progress: Option<Progress>,
    each: &mut dyn FnMut(Record<'_>) -> Result<(), RecordingError>,
) -> Result<Ending, RecordingError> {
    mcap_chunks::check(path)?;
    let file = progress::open(path, progress).map_err(|e| RecordingError::io(path, e))?;
    let mut file = BufReader::with_capacity(1 << 16, file);
    let reading = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(reading);
    let (mut messages, mut read_any) = (0, false);
    let mut ending = Ending::Whole;
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let got = file.read(reader.insert(wanted)).map_err(|e| RecordingError::io(path, e))?;
                read_any |= got > 0;
                reader.notify_read(got);
            }
            // What a crash of the whole computer leaves behind the last write: zeros, which are no record.
            Ok(LinearReadEvent::Record { opcode: 0, .. }) => {
                ending = Ending::CutOff;
                break;
            }
            // Nothing of ours, and of one that is too short `mcap` 0.26.0 makes a panic.
            Ok(LinearReadEvent::Record { opcode: op::ATTACHMENT, .. }) => {}
            Ok(LinearReadEvent::Record { data, opcode }) => {
                let record = mcap::parse_record(opcode, data).map_err(|e| damaged(path, &e, messages))?;
                messages += u64::from(matches!(record, Record::Message { .. }));
                each(record)?;
            }
            Err(McapError::UnexpectedEof) if read_any => {
                ending = Ending::CutOff;
                break;
            }
            Err(McapError::UnexpectedEof) => return Err(RecordingError::Empty { path: path.to_owned() }),
            Err(error) => return Err(damaged(path, &error, messages)),
        }
    }
    Ok(ending)
}

fn damaged(path: &Path, error: &McapError, messages: u64) -> RecordingError {
    let (problem, help) = match error {
        McapError::BadMagic if messages == 0 => {
            ("this is not an MCAP file".to_owned(), "name it .csv if it is text".to_owned())
        }
        other => (
            format!("after message {messages}: {other}"),
            "the file is damaged: `mcap recover` (mcap.dev) saves its whole chunks".to_owned(),
        ),
    };
    RecordingError::Format { path: path.to_owned(), problem, help }
}

/// What a topic holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Sample,
    Simulation,
    State,
    Event,
    Link,
    Other,
}

/// A topic: `/KIND` of a file of one robot, `/NAME/KIND` of a session.
#[derive(Clone, Debug)]
pub(super) struct Topic {
    pub(super) name: String,
    /// Empty for `/KIND`.
    pub(super) robot: String,
    pub(super) kind: Kind,
    pub(super) encoding: String,
    /// The robot's own name, where the channel says so.
    pub(super) own_name: Option<String>,
    /// Values are rounded to the steps of the radio.
    pub(super) is_radio: bool,
}

/// Channels and metadata of a file, learnt as its records pass.
#[derive(Default)]
pub(super) struct Contents {
    topics: HashMap<u16, Topic>,
    pub(super) metadata: Metadata,
}

impl Contents {
    /// Learns from a record.
    pub(super) fn learn(&mut self, path: &Path, record: &Record<'_>) -> Result<(), RecordingError> {
        match record {
            Record::Channel(channel) => {
                self.topics.insert(channel.id, Topic::of(channel));
            }
            Record::Metadata(found) if found.name == METADATA_NAME => {
                let text = found.metadata.get("toml").map_or("", String::as_str);
                self.metadata = toml::from_str(text).map_err(|e| RecordingError::Format {
                    path: path.to_owned(),
                    problem: format!("metadata record `{METADATA_NAME}`: {}", e.message()),
                    help: Metadata::HELP.into(),
                })?;
            }
            _ => {}
        }
        Ok(())
    }

    /// Topic and text of a message of ours.
    pub(super) fn message<'r>(
        &self,
        path: &Path,
        record: &'r Record<'_>,
    ) -> Result<Option<(&Topic, &'r [u8])>, RecordingError> {
        let Record::Message { header, data } = record else { return Ok(None) };
        match self.topics.get(&header.channel_id) {
            None => Ok(None),
            Some(topic) if topic.kind == Kind::Other => Ok(None),
            Some(topic) if topic.encoding != "json" => Err(RecordingError::Format {
                path: path.to_owned(),
                problem: format!("topic {} is encoded as `{}`, expected `json`", topic.name, topic.encoding),
                help: "docs/recordings.md describes the schema".into(),
            }),
            Some(topic) => Ok(Some((topic, data.as_ref()))),
        }
    }

    /// Topic of a message that is not ours.
    pub(super) fn other(&self, record: &Record<'_>) -> Option<&Topic> {
        let Record::Message { header, .. } = record else { return None };
        self.topics.get(&header.channel_id).filter(|topic| topic.kind == Kind::Other)
    }

    /// Every topic, sorted.
    pub(super) fn names(&self) -> Vec<&str> {
        let names: BTreeSet<&str> = self.topics.values().map(|topic| topic.name.as_str()).collect();
        names.into_iter().collect()
    }

    /// Whether there is a topic for samples.
    pub(super) fn has_samples(&self) -> bool {
        self.topics.values().any(|topic| topic.kind == Kind::Sample)
    }
}

impl Topic {
    fn of(channel: &mcap::records::Channel) -> Self {
        let name = channel.topic.clone();
        let (robot, kind) = name.strip_prefix('/').unwrap_or(&name).rsplit_once('/').unwrap_or(("", &name[..]));
        let kind = match kind.trim_start_matches('/') {
            "sample" => Kind::Sample,
            "simulation" => Kind::Simulation,
            "state" => Kind::State,
            "event" => Kind::Event,
            "link" => Kind::Link,
            _ => Kind::Other,
        };
        Self {
            robot: robot.to_owned(),
            kind,
            encoding: channel.message_encoding.clone(),
            own_name: channel.metadata.get(ROBOT_KEY).cloned(),
            is_radio: channel.metadata.get(VALUES_KEY).is_some_and(|values| values == RADIO_VALUES),
            name,
        }
    }
}

/// Which robot of a file is read.
pub(super) struct Choice {
    wanted: Option<String>,
    chosen: Option<String>,
    seen: BTreeSet<String>,
}

impl Choice {
    pub(super) fn new(wanted: Option<&str>) -> Self {
        Self { wanted: wanted.map(str::to_owned), chosen: None, seen: BTreeSet::new() }
    }

    /// Whether this sample is of the robot that is read. A file of one unnamed robot goes by the name in its metadata.
    pub(super) fn takes(&mut self, topic: &Topic, metadata: &Metadata) -> bool {
        if self.chosen.as_ref() == Some(&topic.robot) {
            return true;
        }
        let name = if topic.robot.is_empty() { metadata.robot.as_deref().unwrap_or_default() } else { &topic.robot };
        if !self.seen.contains(name) {
            self.seen.insert(name.to_owned());
        }
        if self.chosen.is_some() || self.wanted.as_deref().is_some_and(|wanted| wanted != name) {
            return false;
        }
        self.chosen = Some(topic.robot.clone());
        true
    }

    /// Whether the robot that is read is the only one of its file, with topics without its name.
    pub(super) fn is_unnamed(&self) -> bool {
        self.chosen.as_deref() == Some("")
    }

    /// Whether an event, state or link message concerns the robot that is read: of a robot without samples before it,
    /// it may.
    pub(super) fn concerns(&self, topic: &Topic) -> bool {
        match (&self.chosen, &self.wanted) {
            _ if topic.robot.is_empty() => true,
            (Some(chosen), _) => *chosen == topic.robot,
            (None, Some(wanted)) => *wanted == topic.robot,
            (None, None) => true,
        }
    }

    /// Fails where the choice was none.
    pub(super) fn check(&self, path: &Path) -> Result<(), RecordingError> {
        let names = || self.seen.iter().cloned().collect();
        match &self.wanted {
            None if self.seen.len() > 1 => Err(RecordingError::SeveralRobots { path: path.to_owned(), names: names() }),
            Some(wanted) if self.chosen.is_none() && !self.seen.is_empty() => {
                Err(RecordingError::NoSuchRobot { path: path.to_owned(), wanted: wanted.clone(), names: names() })
            }
            _ => Ok(()),
        }
    }
}
