//! Tokens at full rate, bit for bit: a row of the recording is a stretch of ticks without a gap, at the time of its first one.
//!
//! It holds the fields of all channels one after the other, each field's words as eight planes of bytes: first the lowest byte of every
//! tick, at last the highest one. Rerun's LZ4 finds what repeats, and in planes the exponents and signs of a signal do; as rows of
//! numbers only what is constant would. [`FIELDS`] names the fields in their order, that of [`Channel::ALL`].

use crate::RecorderError;
use crate::error::Writing as _;
use crate::row::Row;
use crate::run::RunInfo;
use anhyst_ipc::{Channel, CoilField, Demand, Estimate, FieldCommand, Measurement, Message, SafeField, Truth};
use rerun::external::arrow::array::{ArrayRef, StringArray, UInt8Array};
use rerun::log::TimeColumn;
use rerun::{ComponentDescriptor, RecordingStream, SerializedComponentBatch};
use std::ops::Range;
use std::sync::Arc;

/// The recording's timeline: simulated time since tick 0.
pub(crate) const TIMELINE: &str = "sim_time";
/// Where the length of a tick is written.
pub(crate) const TICK_ENTITY: &str = "tokens/tick_s";
/// Where the tokens are.
pub(crate) const ENTITY: &str = "tokens";
/// The component with the names of the fields.
pub(crate) const FIELDS: &str = "fields";
/// The component with the planes.
pub(crate) const PLANES: &str = "planes";

/// Bytes of a word, and so planes of a field.
const WORD: usize = size_of::<u64>();

/// Fields of all channels.
pub(crate) const WIDTH: usize = places(Channel::CoilField).end;

/// Which of all fields those of a channel are.
pub(crate) const fn places(channel: Channel) -> Range<usize> {
    let (mut at, mut start) = (0, 0);
    while Channel::ALL[at] as usize != channel as usize {
        start += Channel::ALL[at].fields().len();
        at += 1;
    }
    start..start + channel.fields().len()
}

/// The names of all fields, as they are written and as they are compared when read.
pub(crate) fn field_names() -> Vec<String> {
    let of = |channel: &Channel| {
        let name = channel.name();
        channel
            .fields()
            .iter()
            .map(move |field| format!("{name}.{}", field.name))
    };
    Channel::ALL.iter().flat_map(of).collect()
}

fn batch(component: &'static str, values: ArrayRef) -> SerializedComponentBatch {
    SerializedComponentBatch::new(values, ComponentDescriptor::partial(component))
}

/// Writes the names of the fields.
pub(crate) fn declare(stream: &RecordingStream) -> Result<(), RecorderError> {
    let names = batch(FIELDS, Arc::new(StringArray::from(field_names())));
    stream
        .log_serialized_batches(ENTITY, true, [names])
        .writing("the names of the fields")
}

/// Writes the tokens of rows whose ticks grow.
pub(crate) fn send(stream: &RecordingStream, run: &RunInfo, rows: &[Row]) -> Result<(), RecorderError> {
    let stretches = || rows.chunk_by(|row, next| row.tick + 1 == next.tick);
    let mut planes = vec![0; rows.len() * WIDTH * WORD];
    let mut rest = planes.as_mut_slice();
    for stretch in stretches() {
        let (own, others) = rest.split_at_mut(stretch.len() * WIDTH * WORD);
        write_planes(stretch, own);
        rest = others;
    }
    let lengths = stretches().map(|stretch| stretch.len() * WIDTH * WORD);
    let column = batch(PLANES, Arc::new(UInt8Array::from(planes)))
        .partitioned(lengths)
        .writing("tokens")?;
    let times = stretches().map(|stretch| run.time_ns(stretch[0].tick));
    let times = TimeColumn::new_duration_nanos(TIMELINE, times);
    stream.send_columns(ENTITY, [times], [column]).writing("tokens")
}

/// Ticks that are turned into planes at a time: their words stay in the nearest cache.
const TILE: usize = 32;

fn write_planes(rows: &[Row], planes: &mut [u8]) {
    let mut words = [[0; WIDTH]; TILE];
    for (tile, rows_of_tile) in rows.chunks(TILE).enumerate() {
        for (row, words) in rows_of_tile.iter().zip(&mut words) {
            write_words(row, words);
        }
        let begun = tile * TILE;
        for (field, planes) in planes.chunks_exact_mut(rows.len() * WORD).enumerate() {
            let column: [u64; TILE] = std::array::from_fn(|at| words[at][field]);
            for (place, plane) in planes.chunks_exact_mut(rows.len()).enumerate() {
                let plane = &mut plane[begun..begun + rows_of_tile.len()];
                for (byte, word) in plane.iter_mut().zip(&column) {
                    *byte = (word >> (8 * place)) as u8;
                }
            }
        }
    }
}

fn write_words(row: &Row, words: &mut [u64]) {
    fn write<M: Message>(token: &M, words: &mut [u64]) {
        token.write_words(&mut words[const { places(M::CHANNEL).start }..]);
    }
    write::<Measurement>(&row.measurement, words);
    write::<Truth>(&row.truth, words);
    write::<Estimate>(&row.estimate, words);
    write::<Demand>(&row.demand, words);
    write::<FieldCommand>(&row.field_command, words);
    write::<SafeField>(&row.safe_field, words);
    write::<CoilField>(&row.coil_field, words);
}

/// The tokens of one channel in a stretch that begins at `first`; the inverse of [`send`]. The time of sending is 0.
pub(crate) fn read<M: Message>(first: u64, planes: &[u8]) -> Vec<M> {
    let ticks = planes.len() / (WIDTH * WORD);
    let width = M::FIELDS.len();
    let mut words = vec![0; ticks * width];
    for (at, field) in places(M::CHANNEL).enumerate() {
        for place in 0..WORD {
            let plane = &planes[(field * WORD + place) * ticks..][..ticks];
            for (word, byte) in words[at..].iter_mut().step_by(width).zip(plane) {
                *word |= u64::from(*byte) << (8 * place);
            }
        }
    }
    (first..)
        .zip(words.chunks_exact(width))
        .map(|(tick, words)| M::from_words(tick, words))
        .collect()
}
