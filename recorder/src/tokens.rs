//! Tokens at full rate: one entity a message, one wide row a tick, every field as a 64-bit number.

use crate::RecorderError;
use crate::error::Writing as _;
use anhyst_ipc::{Channel, Message};
use rerun::RecordingStream;
use rerun::log::TimeColumn;
use rerun_types::archetypes::{Scalars, SeriesLines};

/// The recording's timeline: simulated time since tick 0.
pub(crate) const TIMELINE: &str = "sim_time";
/// Where the length of a tick is written.
pub(crate) const TICK_ENTITY: &str = "tokens/tick_s";

/// The entity of a channel's tokens.
pub(crate) fn entity(channel: Channel) -> String {
    format!("tokens/{}", channel.name())
}

/// The field names of a message, as they are written and as they are compared when read.
pub(crate) fn field_names<M: Message>() -> Vec<String> {
    M::FIELDS.iter().map(|field| field.name.to_owned()).collect()
}

/// Writes the field names of a channel.
pub(crate) fn declare<M: Message>(stream: &RecordingStream) -> Result<(), RecorderError> {
    let names = SeriesLines::new().with_names(field_names::<M>());
    stream
        .log_static(entity(M::CHANNEL), &names)
        .writing("the names of the fields")
}

/// Writes tokens of consecutive rows.
pub(crate) fn send<M: Message>(
    stream: &RecordingStream,
    times: &TimeColumn,
    tokens: impl ExactSizeIterator<Item = M>,
) -> Result<(), RecorderError> {
    let width = M::FIELDS.len();
    let rows = tokens.len();
    let mut values = vec![0.0; rows * width];
    for (token, values) in tokens.zip(values.chunks_exact_mut(width)) {
        token.write_values(values);
    }
    send_wide(stream, &entity(M::CHANNEL), times, values, width)
}

/// Writes rows of `width` values.
pub(crate) fn send_wide(
    stream: &RecordingStream,
    entity: &str,
    times: &TimeColumn,
    values: Vec<f64>,
    width: usize,
) -> Result<(), RecorderError> {
    let rows = values.len() / width.max(1);
    let columns = Scalars::new(values)
        .columns(std::iter::repeat_n(width, rows))
        .writing(entity)?;
    stream.send_columns(entity, [times.clone()], columns).writing(entity)
}
