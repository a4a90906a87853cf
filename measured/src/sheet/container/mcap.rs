//! MCAP: messages on topics, each with the instant of its logging. Messages in JSON are read: a topic is a group, a number in its
//! messages a channel, and the time of logging, from the file's first message on, their clock.
//!
//! Other encodings (ROS, protobuf) need a schema's own decoder and are passed over; a file that holds nothing else is refused.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;

use mcap::parse_record;
use mcap::records::{ChunkHeader, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde_json::Value;

use super::numbers::Cursor;
use super::{Budget, Channel, Reason};

/// Numbers of one message.
const MOST_FIELDS: usize = 1000;

/// A topic's messages: when, and their numbers by name.
#[derive(Default)]
struct Topic {
    log_times_ns: Vec<u64>,
    series: BTreeMap<String, Vec<f64>>,
    /// Names in the order in which messages bring them.
    order: Vec<String>,
}

/// The largest record: a limit, so that a broken length asks for no memory.
const MOST_RECORD_BYTES: usize = 1 << 26;

/// The largest chunk, unpacked.
const MOST_CHUNK_BYTES: u64 = 1 << 28;

/// The channels of one file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Channel>, Reason> {
    let mut messages = Messages::default();
    let (mut left, mut ended) = (bytes, false);
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(MOST_RECORD_BYTES),
    );
    while let Some(event) = reader.next_event() {
        match event.map_err(|cause| cause.to_string())? {
            LinearReadEvent::ReadRequest(wanted) => {
                // The end was said once; who asks again would ask for ever.
                if std::mem::replace(&mut ended, left.is_empty()) && left.is_empty() {
                    return Err("it ends within a record: it is torn or was not written to the end".into());
                }
                let (given, rest) = left.split_at(wanted.min(left.len()));
                reader.insert(given.len()).copy_from_slice(given);
                reader.notify_read(given.len());
                left = rest;
            }
            LinearReadEvent::Record { opcode, data } => {
                let record = parse_record(opcode, data).map_err(|cause| cause.to_string())?;
                messages.take(record)?;
            }
        }
    }
    messages.channels()
}

/// What was heard.
#[derive(Default)]
struct Messages {
    /// Topic and encoding by number.
    announced: BTreeMap<u16, (String, String)>,
    topics: BTreeMap<String, Topic>,
    /// Encodings that were passed over.
    others: BTreeSet<String>,
    budget: Budget,
}

impl Messages {
    fn take(&mut self, record: Record) -> Result<(), Reason> {
        let (header, data) = match record {
            Record::Channel(channel) => {
                self.announced
                    .insert(channel.id, (channel.topic, channel.message_encoding));
                return Ok(());
            }
            Record::Chunk { header, data } => return self.chunk(&header, &data),
            Record::Message { header, data } => (header, data),
            _ => return Ok(()),
        };
        let announced = self.announced.get(&header.channel_id);
        let (name, encoding) = announced
            .ok_or_else(|| format!("a message is on channel {}, which nothing announces", header.channel_id))?;
        if encoding != "json" {
            self.others.insert(encoding.clone());
            return Ok(());
        }
        let broken = |cause: String| format!("a message of \"{name}\" is broken: {cause}");
        let value: Value = serde_json::from_slice(&data).map_err(|cause| broken(cause.to_string()))?;
        let mut fields = Vec::new();
        flatten("", &value, &mut fields).map_err(broken)?;
        let topic = self.topics.entry(name.clone()).or_default();
        self.budget
            .take(name, 1 + topic.series.len().max(fields.len()) as u64)?;
        topic.add(header.log_time, fields);
        if topic.series.len() > MOST_FIELDS {
            return Err(format!("\"{name}\" holds more than {MOST_FIELDS} numbers a message"));
        }
        Ok(())
    }

    /// The records of a chunk. They are unpacked here, because the crate's own way never ends where packed data end too early.
    fn chunk(&mut self, header: &ChunkHeader, data: &[u8]) -> Result<(), Reason> {
        let size = header.uncompressed_size;
        if size > MOST_CHUNK_BYTES {
            return Err(format!(
                "a chunk takes {size} bytes once unpacked, at most {MOST_CHUNK_BYTES} are read"
            ));
        }
        let mut records = Vec::new();
        let unpacked = match header.compression.as_str() {
            "" => data.take(size + 1).read_to_end(&mut records),
            "zstd" => zstd::stream::read::Decoder::new(data)
                .and_then(|unpacking| unpacking.take(size + 1).read_to_end(&mut records)),
            "lz4" => lz4::Decoder::new(data).and_then(|unpacking| unpacking.take(size + 1).read_to_end(&mut records)),
            other => return Err(format!("a chunk is packed by \"{other}\", but zstd and lz4 are read")),
        };
        unpacked.map_err(|cause| format!("a chunk is broken: {cause}"))?;
        let sum = header.uncompressed_crc;
        if records.len() as u64 != size || sum != 0 && sum != crc32fast::hash(&records) {
            return Err("a chunk does not hold what its size and its check sum say: it is torn or was changed".into());
        }
        let mut cursor = Cursor::new(&records);
        while cursor.left() > 0 {
            let (opcode, length) = (cursor.u8()?, cursor.u64()?);
            let record = parse_record(opcode, cursor.take(length)?).map_err(|cause| cause.to_string())?;
            if matches!(record, Record::Chunk { .. }) {
                return Err("a chunk stands in a chunk".into());
            }
            self.take(record)?;
        }
        Ok(())
    }

    fn channels(self) -> Result<Vec<Channel>, Reason> {
        let topics = self.topics;
        if topics.is_empty() {
            let encodings: Vec<&str> = self.others.iter().map(String::as_str).collect();
            return Err(match encodings.is_empty() {
                true => "it holds no messages".into(),
                false => format!(
                    "its messages are encoded as {}, but JSON is read: convert it, or export its numbers as CSV or Parquet",
                    encodings.join(" and ")
                ),
            });
        }
        let first_ns = topics
            .values()
            .flat_map(|topic| &topic.log_times_ns)
            .min()
            .copied()
            .unwrap_or(0);
        Ok(topics
            .into_iter()
            .flat_map(|(name, topic)| topic.channels(&name, first_ns))
            .collect())
    }
}

impl Topic {
    fn add(&mut self, log_time_ns: u64, fields: Vec<(String, f64)>) {
        let before = self.log_times_ns.len();
        self.log_times_ns.push(log_time_ns);
        for (name, value) in fields {
            let series = self.series.entry(name).or_insert_with_key(|name| {
                self.order.push(name.clone());
                // What begins later was not known before.
                vec![f64::NAN; before]
            });
            series.push(value);
        }
        for series in self.series.values_mut() {
            series.resize(before + 1, f64::NAN);
        }
    }

    fn channels(mut self, topic: &str, first_ns: u64) -> Vec<Channel> {
        // A recorder may write what it hears late.
        let mut order: Vec<usize> = (0..self.log_times_ns.len()).collect();
        order.sort_by_key(|index| self.log_times_ns[*index]);
        let time_s = order
            .iter()
            .map(|index| (self.log_times_ns[*index] - first_ns) as f64 * 1e-9);
        let clock = Channel {
            implied: true,
            ..Channel::stored(topic, "time_s", None, time_s.collect())
        };
        let named = self.order.iter().filter_map(|name| {
            let series = self.series.remove(name)?;
            let values = order.iter().map(|index| series[*index]).collect();
            Some(Channel::stored(topic, name, None, values))
        });
        std::iter::once(clock).chain(named).collect()
    }
}

/// The numbers of a message, by the path to them.
fn flatten(path: &str, value: &Value, fields: &mut Vec<(String, f64)>) -> Result<(), String> {
    let inner = |name: &str| {
        if path.is_empty() {
            name.to_owned()
        } else {
            format!("{path}/{name}")
        }
    };
    match value {
        Value::Number(number) => fields.push((path.to_owned(), number.as_f64().unwrap_or(f64::NAN))),
        Value::Bool(flag) => fields.push((path.to_owned(), f64::from(u8::from(*flag)))),
        Value::Object(members) => {
            for (name, value) in members {
                flatten(&inner(name), value, fields)?;
            }
        }
        Value::Array(elements) => {
            for (index, value) in elements.iter().enumerate() {
                flatten(&format!("{path}_{index}"), value, fields)?;
            }
        }
        Value::Null | Value::String(_) => (),
    }
    if fields.len() > MOST_FIELDS {
        return Err(format!("it holds more than {MOST_FIELDS} numbers"));
    }
    Ok(())
}
