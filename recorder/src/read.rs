//! Recordings read back: every token of a channel, bit for bit. A recording of a killed run has no footer and may end in
//! the middle of a message; what stands before is read.

use crate::RecorderError;
use crate::run::tick_at;
use crate::tokens::{TICK_ENTITY, TIMELINE, entity, field_names};
use anhyst_ipc::{Channel, Message};
use rerun::external::re_log_encoding::rrd::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use rerun_types::archetypes::{Scalars, SeriesLines, TextLog};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// A recording in memory.
pub struct Recording {
    path: PathBuf,
    tick_s: f64,
    chunks: BTreeMap<String, Vec<Chunk>>,
    closed: bool,
}

/// Every token of one channel, in order.
///
/// # Errors
/// If the file cannot be read, is no recording of a run, or was written with other fields.
pub fn read_tokens<M: Message>(path: &Path) -> Result<Vec<M>, RecorderError> {
    Recording::open(path)?.tokens()
}

impl Recording {
    /// Reads a recording.
    ///
    /// # Errors
    /// If the file cannot be read or holds no run.
    pub fn open(path: &Path) -> Result<Self, RecorderError> {
        let refuse = |cause: String| RecorderError::Read {
            path: path.into(),
            cause,
        };
        let file = File::open(path).map_err(|error| refuse(error.to_string()))?;
        let mut messages = DecoderApp::decode_eager(BufReader::with_capacity(1 << 20, file))
            .map_err(|error| refuse(error.to_string()))?;
        let mut chunks = BTreeMap::<String, Vec<Chunk>>::new();
        for message in messages.by_ref() {
            let LogMsg::ArrowMsg(store, arrow) = message.map_err(|error| refuse(error.to_string()))? else {
                continue;
            };
            if !store.is_recording() {
                continue;
            }
            let chunk = Chunk::from_arrow_msg(&arrow).map_err(|error| refuse(error.to_string()))?;
            let path = chunk.entity_path().to_string();
            let path = path.trim_start_matches('/');
            if path.starts_with("tokens/") || path.starts_with("events/") {
                chunks.entry(path.into()).or_default().push(chunk);
            }
        }
        // The writer that closes a file properly ends it with a manifest of its chunks.
        let closed = messages.rrd_manifests().is_ok_and(|manifests| !manifests.is_empty());
        let scalars = Scalars::descriptor_scalars().component;
        let tick = chunks.get(TICK_ENTITY).into_iter().flatten().find_map(|chunk| {
            chunk
                .iter_slices::<f64>(scalars)
                .next()
                .and_then(|values| values.first().copied())
        });
        let tick_s =
            tick.ok_or_else(|| refuse("it is no recording of a run: the length of a tick is missing".into()))?;
        Ok(Self {
            path: path.into(),
            tick_s,
            chunks,
            closed,
        })
    }

    /// Length of a tick.
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// True if the recorder closed the file; false if its process died.
    pub fn closed(&self) -> bool {
        self.closed
    }

    /// Every token of a channel, in order. The time of sending is not recorded and is 0.
    ///
    /// # Errors
    /// If there is none, or the fields were others.
    pub fn tokens<M: Message>(&self) -> Result<Vec<M>, RecorderError> {
        let channel = M::CHANNEL;
        let missing = || RecorderError::NoTokens {
            path: self.path.clone(),
            channel,
        };
        let chunks = self.chunks.get(&entity(channel)).ok_or_else(missing)?;
        self.check_fields::<M>(channel, chunks)?;
        let scalars = Scalars::descriptor_scalars().component;
        let mut tokens = Vec::new();
        for chunk in chunks {
            let indices = chunk.iter_component_indices(TIMELINE.into(), scalars);
            for ((time, _), values) in indices.zip(chunk.iter_slices::<f64>(scalars)) {
                tokens.push(M::from_values(tick_at(self.tick_s, time.as_i64()), values));
            }
        }
        if tokens.is_empty() {
            return Err(missing());
        }
        tokens.sort_by_key(Message::tick);
        Ok(tokens)
    }

    /// A message with permuted fields would be read without a complaint, so the names are compared.
    fn check_fields<M: Message>(&self, channel: Channel, chunks: &[Chunk]) -> Result<(), RecorderError> {
        let names = SeriesLines::descriptor_names().component;
        let recorded = chunks.iter().find_map(|chunk| {
            let texts = chunk.iter_slices::<String>(names).next()?;
            Some(texts.iter().map(|text| text.to_string()).collect::<Vec<_>>())
        });
        let (recorded, expected) = (recorded.unwrap_or_default(), field_names::<M>());
        if recorded == expected {
            return Ok(());
        }
        Err(RecorderError::OtherFields {
            path: self.path.clone(),
            channel,
            recorded,
            expected,
        })
    }

    /// The event table: seconds, source, text.
    pub fn events(&self) -> Vec<(f64, String, String)> {
        let text = TextLog::descriptor_text().component;
        let mut events = Vec::new();
        for (entity, chunks) in &self.chunks {
            let Some(source) = entity.strip_prefix("events/") else {
                continue;
            };
            for chunk in chunks {
                let indices = chunk.iter_component_indices(TIMELINE.into(), text);
                for ((time, _), texts) in indices.zip(chunk.iter_slices::<String>(text)) {
                    let seconds = time.as_i64() as f64 * 1e-9;
                    events.extend(texts.iter().map(|text| (seconds, source.to_owned(), text.to_string())));
                }
            }
        }
        events.sort_by(|a, b| a.0.total_cmp(&b.0));
        events
    }
}
