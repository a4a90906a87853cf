//! Recordings read back: every token of a channel, bit for bit. A recording of a killed run has no footer and may end in
//! the middle of a message; what stands before is read.

use crate::RecorderError;
use crate::pack;
use crate::run::tick_at;
use crate::tokens::{self, ENTITY, FIELDS, PACKED, PLANES, TICK_ENTITY, TIMELINE};
use anhyst_ipc::{Channel, Message};
use rerun::external::re_log_encoding::rrd::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use rerun_types::archetypes::{Scalars, TextLog};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Ticks of a recording without a gap, with all their tokens.
#[derive(Debug, Clone)]
pub struct Stretch {
    first: u64,
    /// Of every field those of all ticks, one field after the other.
    words: Vec<u64>,
}

impl Stretch {
    /// The tick that it begins with.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// How many ticks it has.
    pub fn ticks(&self) -> usize {
        tokens::ticks(&self.words)
    }

    /// The token of a channel in one of its ticks, counted from 0. The time of sending is not recorded and is 0.
    pub fn token<M: Message>(&self, at: usize) -> M {
        tokens::read(self.first, &self.words, at)
    }
}

/// What is in a file, in its order.
enum Piece {
    Tick(f64),
    Fields(Vec<String>),
    Stretch(Stretch),
    /// Seconds, source, text.
    Event(f64, String, String),
}

/// A recording, of one file or of several parts, in memory.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    tick_s: f64,
    fields: Vec<String>,
    stretches: Vec<Stretch>,
    events: Vec<(f64, String, String)>,
    closed: bool,
}

/// Every token of one channel, in order.
///
/// # Errors
/// If the file cannot be read, is no recording of a run, or was written with other fields.
pub fn read_tokens<M: Message>(path: &Path) -> Result<Vec<M>, RecorderError> {
    Recording::open(path)?.tokens()
}

/// Takes the stretches of a recording in parts one after the other, in the order of time: memory holds one of them.
///
/// # Errors
/// If a file cannot be read, is no recording of a run, or was written with other fields; whatever `take` says.
pub fn each_stretch<E: From<RecorderError>>(
    parts: &[PathBuf],
    mut take: impl FnMut(Stretch) -> Result<(), E>,
) -> Result<(), E> {
    for path in parts {
        pieces(path, |piece| match piece {
            Piece::Fields(fields) => Ok(check_fields(path, Channel::ALL, &fields)?),
            Piece::Stretch(stretch) => take(stretch),
            Piece::Tick(_) | Piece::Event(..) => Ok(()),
        })?;
    }
    Ok(())
}

/// Reads a file piece by piece; true if its writer closed it.
fn pieces<E: From<RecorderError>>(path: &Path, mut take: impl FnMut(Piece) -> Result<(), E>) -> Result<bool, E> {
    let refuse = |cause: String| RecorderError::Read {
        path: path.into(),
        cause,
    };
    let file = File::open(path).map_err(|error| refuse(error.to_string()))?;
    let mut messages =
        DecoderApp::decode_eager(BufReader::with_capacity(1 << 20, file)).map_err(|error| refuse(error.to_string()))?;
    let mut told = Told::default();
    for message in messages.by_ref() {
        let LogMsg::ArrowMsg(store, arrow) = message.map_err(|error| refuse(error.to_string()))? else {
            continue;
        };
        if !store.is_recording() {
            continue;
        }
        let chunk = Chunk::from_arrow_msg(&arrow).map_err(|error| refuse(error.to_string()))?;
        if is_of_an_earlier_version(&chunk) {
            return Err(E::from(refuse(
                "an earlier version wrote it, which kept each channel's tokens apart; make it again with `anhyst run` of the scenario.ron beside it"
                    .into(),
            )));
        }
        for piece in pieces_of(&chunk, &mut told) {
            take(piece.ok_or_else(|| refuse("a block of its tokens is damaged".into()))?)?;
        }
    }
    if told.tick_s.is_none() {
        return Err(E::from(refuse(
            "it is no recording of a run: the length of a tick is missing".into(),
        )));
    }
    // The writer that closes a file properly ends it with a manifest of its chunks.
    Ok(messages.rrd_manifests().is_ok_and(|manifests| !manifests.is_empty()))
}

fn is_of_an_earlier_version(chunk: &Chunk) -> bool {
    let entity = chunk.entity_path().to_string();
    let entity = entity.trim_start_matches('/');
    entity != TICK_ENTITY && entity.strip_prefix(ENTITY).is_some_and(|rest| rest.starts_with('/'))
}

/// What a file tells before its tokens.
#[derive(Default)]
struct Told {
    tick_s: Option<f64>,
    fields: usize,
}

/// What a chunk holds; none of what cannot be read.
fn pieces_of(chunk: &Chunk, told: &mut Told) -> Vec<Option<Piece>> {
    let entity = chunk.entity_path().to_string();
    let entity = entity.trim_start_matches('/');
    if entity == TICK_ENTITY {
        let values = chunk.iter_slices::<f64>(Scalars::descriptor_scalars().component).next();
        told.tick_s = values.and_then(|values| values.first().copied()).or(told.tick_s);
        return told.tick_s.iter().map(|tick_s| Some(Piece::Tick(*tick_s))).collect();
    }
    if entity == ENTITY {
        let names = chunk.iter_slices::<String>(FIELDS.into()).next();
        let names: Option<Vec<String>> = names.map(|names| names.iter().map(|name| name.to_string()).collect());
        told.fields = names.as_ref().map_or(told.fields, Vec::len);
        let (tick_s, fields) = (told.tick_s, told.fields);
        let stretches = |component: &'static str, words: fn(&[u8], usize) -> Option<Vec<u64>>| {
            let indices = chunk.iter_component_indices(TIMELINE.into(), component.into());
            let stretches = indices.zip(chunk.iter_slices::<u8>(component.into()));
            stretches.map(move |((time, _), bytes)| {
                Some(Piece::Stretch(Stretch {
                    first: tick_s.map_or(0, |tick_s| tick_at(tick_s, time.as_i64())),
                    words: words(bytes, fields)?,
                }))
            })
        };
        return names
            .map(|names| Some(Piece::Fields(names)))
            .into_iter()
            .chain(stretches(PACKED, pack::unpack))
            .chain(stretches(PLANES, tokens::of_planes))
            .collect();
    }
    let Some(source) = entity.strip_prefix("events/") else {
        return Vec::new();
    };
    let text = TextLog::descriptor_text().component;
    let indices = chunk.iter_component_indices(TIMELINE.into(), text);
    let events = indices
        .zip(chunk.iter_slices::<String>(text))
        .flat_map(|((time, _), texts)| {
            let seconds = time.as_i64() as f64 * 1e-9;
            texts
                .into_iter()
                .map(move |text| Some(Piece::Event(seconds, source.to_owned(), text.to_string())))
        });
    events.collect()
}

/// A message with permuted fields would be read without a complaint, so the names are compared.
fn check_fields(
    path: &Path,
    channels: impl IntoIterator<Item = Channel>,
    recorded: &[String],
) -> Result<(), RecorderError> {
    let expected = tokens::field_names();
    for channel in channels {
        let of = |names: &[String]| -> Vec<String> {
            let start = format!("{}.", channel.name());
            let own = names.iter().filter_map(|name| name.strip_prefix(&start));
            own.map(str::to_owned).collect()
        };
        // Another channel with other fields moves the planes of this one.
        if of(recorded) != of(&expected) || recorded.len() != expected.len() {
            return Err(RecorderError::OtherFields {
                path: path.into(),
                channel,
                recorded: of(recorded),
                expected: of(&expected),
            });
        }
    }
    Ok(())
}

impl Recording {
    /// Reads a recording of one file.
    ///
    /// # Errors
    /// If the file cannot be read or holds no run.
    pub fn open(path: &Path) -> Result<Self, RecorderError> {
        Self::of_parts(&[path.into()])
    }

    /// Reads a recording in parts.
    ///
    /// # Errors
    /// If a file cannot be read or holds no run, or there is none.
    pub fn of_parts(parts: &[PathBuf]) -> Result<Self, RecorderError> {
        let mut recording = Self {
            path: parts.first().cloned().unwrap_or_default(),
            tick_s: 0.0,
            fields: Vec::new(),
            stretches: Vec::new(),
            events: Vec::new(),
            closed: true,
        };
        for path in parts {
            let closed = pieces::<RecorderError>(path, |piece| {
                match piece {
                    Piece::Tick(tick_s) => recording.tick_s = tick_s,
                    Piece::Fields(fields) => recording.fields = fields,
                    Piece::Stretch(stretch) => recording.stretches.push(stretch),
                    Piece::Event(seconds, source, text) => recording.events.push((seconds, source, text)),
                }
                Ok(())
            })?;
            recording.closed &= closed;
        }
        recording.stretches.sort_by_key(|stretch| stretch.first);
        recording.events.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(recording)
    }

    /// Length of a tick.
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// True if the recorder closed its files; false if its process died.
    pub fn closed(&self) -> bool {
        self.closed
    }

    /// Every token of a channel, in order. The time of sending is not recorded and is 0.
    ///
    /// # Errors
    /// If there is none, or the fields were others.
    pub fn tokens<M: Message>(&self) -> Result<Vec<M>, RecorderError> {
        if self.stretches.is_empty() {
            return Err(RecorderError::NoTokens {
                path: self.path.clone(),
                channel: M::CHANNEL,
            });
        }
        check_fields(&self.path, [M::CHANNEL], &self.fields)?;
        let all = self.stretches.iter();
        Ok(all.flat_map(|own| (0..own.ticks()).map(|at| own.token(at))).collect())
    }

    /// The event table: seconds, source, text.
    pub fn events(&self) -> &[(f64, String, String)] {
        &self.events
    }
}
