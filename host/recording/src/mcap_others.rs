//! What an MCAP file holds beside a run's own topics, kept as it was written: what viewers draw of it, what others have recorded.

use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};

use mcap::records::{Channel, MessageHeader, Record, SchemaHeader};

/// A larger load is not kept: a file may hold hours of pictures.
const MOST_BYTES: usize = 1 << 28;

/// Messages of topics that a [`super::Run`] does not read, in the file's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Others {
    /// By their numbers in the file, which are in its order.
    channels: BTreeMap<u16, OtherChannel>,
    messages: Vec<OtherMessage>,
    /// Log time of the first sample, ns: theirs count from it.
    start: u64,
}

#[derive(Clone, Debug, PartialEq)]
struct OtherChannel {
    topic: String,
    message_encoding: String,
    metadata: BTreeMap<String, String>,
    schema: Option<OtherSchema>,
}

#[derive(Clone, Debug, PartialEq)]
struct OtherSchema {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

#[derive(Clone, Debug, PartialEq)]
struct OtherMessage {
    /// Its channel's number in the file.
    channel: u16,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
    data: Vec<u8>,
}

impl Others {
    /// Names of the topics.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.channels.values().map(|channel| channel.topic.as_str())
    }
}

/// Collects [`Others`] as a file's records pass.
#[derive(Default)]
pub(super) struct OthersReader {
    schemas: HashMap<u16, OtherSchema>,
    channels: HashMap<u16, Channel>,
    others: Others,
    bytes: usize,
    /// Log time of the first sample, ns.
    start: Option<u64>,
}

impl OthersReader {
    /// Learns from a record that is no message.
    pub(super) fn learn(&mut self, record: &Record<'_>) {
        match record {
            Record::Schema { header: SchemaHeader { id, name, encoding }, data } => {
                let schema = OtherSchema { name: name.clone(), encoding: encoding.clone(), data: data.to_vec() };
                self.schemas.insert(*id, schema);
            }
            Record::Channel(channel) => {
                self.channels.insert(channel.id, channel.clone());
            }
            _ => {}
        }
    }

    /// A sample of the run.
    pub(super) fn sample(&mut self, header: &MessageHeader) {
        self.start.get_or_insert(header.log_time);
    }

    /// A message of another topic.
    pub(super) fn message(&mut self, header: &MessageHeader, data: &[u8]) {
        let Some(channel) = self.channels.get(&header.channel_id) else { return };
        self.others.channels.entry(channel.id).or_insert_with(|| OtherChannel {
            topic: channel.topic.clone(),
            message_encoding: channel.message_encoding.clone(),
            metadata: channel.metadata.clone(),
            schema: self.schemas.get(&channel.schema_id).cloned(),
        });
        self.bytes += data.len();
        if self.bytes > MOST_BYTES {
            self.others.messages = Vec::new();
            return;
        }
        let MessageHeader { channel_id: channel, sequence, log_time, publish_time } = *header;
        self.others.messages.push(OtherMessage { channel, sequence, log_time, publish_time, data: data.to_vec() });
    }

    /// What was collected, or of too large a load what is to be said.
    pub(super) fn finish(self) -> Result<Others, String> {
        if self.bytes > MOST_BYTES {
            let topics: Vec<&str> = self.others.topics().collect();
            return Err(format!("topics that are not kept, for their {} MB: {}", self.bytes >> 20, topics.join(", ")));
        }
        let start = if self.others.messages.is_empty() { 0 } else { self.start.unwrap_or(0) };
        Ok(Others { start, ..self.others })
    }
}

/// Writes [`Others`] as the samples pass.
pub(super) struct OthersWriter<'a> {
    others: &'a Others,
    /// Numbers of the channels as they are written now, by those of the file that was read.
    channels: HashMap<u16, u16>,
    given: usize,
    /// Log time of the first sample as it is written now, ns.
    start: u64,
}

impl<'a> OthersWriter<'a> {
    pub(super) fn begin<W: Write + Seek>(
        writer: &mut mcap::Writer<W>,
        others: &'a Others,
        start: u64,
    ) -> mcap::McapResult<Self> {
        let add = |(id, channel): (&u16, &OtherChannel)| {
            let schema = match &channel.schema {
                Some(schema) => writer.add_schema(&schema.name, &schema.encoding, &schema.data)?,
                None => 0,
            };
            Ok((*id, writer.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata)?))
        };
        let channels = others.channels.iter().map(add).collect::<mcap::McapResult<_>>()?;
        Ok(Self { others, channels, given: 0, start })
    }

    /// Writes the messages up to a log time, ns.
    pub(super) fn until<W: Write + Seek>(&mut self, writer: &mut mcap::Writer<W>, time: u64) -> mcap::McapResult<()> {
        let moved = |time: u64| (time + self.start).saturating_sub(self.others.start);
        while let Some(message) = self.others.messages.get(self.given).filter(|one| moved(one.log_time) <= time) {
            let header = MessageHeader {
                channel_id: self.channels[&message.channel],
                sequence: message.sequence,
                log_time: moved(message.log_time),
                publish_time: moved(message.publish_time),
            };
            writer.write_to_known_channel(&header, &message.data)?;
            self.given += 1;
        }
        Ok(())
    }
}
