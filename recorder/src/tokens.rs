//! Tokens at full rate, bit for bit: a row of the recording is a stretch of ticks without a gap, at the time of its first one.
//!
//! It holds the fields of all channels, packed as [`crate::pack`] says. [`FIELDS`] names them in their order, that of [`Channel::ALL`].

use crate::RecorderError;
use crate::error::Writing as _;
use crate::pack::{Packer, Shape, Source};
use crate::row::Row;
use crate::run::RunInfo;
use anhyst_ipc::{Channel, Message};
use rerun::external::arrow::array::{ArrayRef, StringArray, UInt8Array};
use rerun::log::{Chunk, ChunkId, TimeColumn};
use rerun::{ComponentDescriptor, RecordingStream, SerializedComponentBatch, SerializedComponentColumn};
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
/// The component with the packed tokens.
pub(crate) const PACKED: &str = "packed";
/// What earlier versions wrote in its place: of each field the lowest byte of every tick, then the next one, up to the highest.
pub(crate) const PLANES: &str = "planes";

/// Bytes of a word.
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

/// The field of that name.
const fn field(channel: Channel, name: &str) -> usize {
    let fields = channel.fields();
    let mut at = 0;
    while !equal(fields[at].name.as_bytes(), name.as_bytes()) {
        at += 1;
    }
    places(channel).start + at
}

const fn equal(one: &[u8], other: &[u8]) -> bool {
    let mut at = 0;
    while at < one.len() && at < other.len() && one[at] == other[at] {
        at += 1;
    }
    at == one.len() && at == other.len()
}

/// Fields that others tell, exactly or nearly, as long as nothing is limited, disturbed or absent.
const FORETOLD: [(usize, Source); 18] = {
    use Channel::{CoilField, Demand, Estimate, FieldCommand, Measurement, SafeField, Truth};
    use Source::{Before, Difference, Same, Sum};
    const COMMAND: usize = field(FieldCommand, "field_a_per_m");
    const SAFE: usize = field(SafeField, "field_a_per_m");
    const COIL: usize = field(CoilField, "field_a_per_m");
    const NEXT: usize = field(Estimate, "next_field_a_per_m");
    const NOW: usize = field(Estimate, "field_a_per_m");
    const MEASURED: usize = field(Measurement, "displacement_m");
    const REFERENCE: usize = field(Demand, "reference_m");
    const PREDICTED: usize = field(Estimate, "predicted_output_m");
    const FORWARD: usize = field(Demand, "feedforward_a_per_m");
    const BACK: usize = field(Demand, "feedback_a_per_m");
    const DEMANDED: usize = field(Demand, "magnetization_a_per_m");
    const START: usize = field(FieldCommand, "start_magnetization_a_per_m");
    const MAGNETIZATION: usize = field(Estimate, "magnetization_a_per_m");
    [
        (SAFE, Same(COMMAND)),
        (field(FieldCommand, "coil_field_a_per_m"), Same(COMMAND)),
        (COIL, Before(SAFE)),
        (NEXT, Same(COIL)),
        (NOW, Before(NEXT)),
        (field(Truth, "coil_field_a_per_m"), Same(NOW)),
        (field(Measurement, "coil_field_a_per_m"), Same(NOW)),
        (DEMANDED, Sum(FORWARD, BACK)),
        (field(FieldCommand, "reached_magnetization_a_per_m"), Same(DEMANDED)),
        (START, Before(DEMANDED)),
        (MAGNETIZATION, Before(START)),
        (field(Truth, "magnetization_a_per_m"), Same(MAGNETIZATION)),
        (field(Demand, "error_m"), Difference(REFERENCE, MEASURED)),
        (REFERENCE, Same(PREDICTED)),
        (MEASURED, Same(PREDICTED)),
        (field(Truth, "displacement_m"), Same(PREDICTED)),
        (field(Estimate, "lower_cover_m"), Same(PREDICTED)),
        (field(Estimate, "upper_cover_m"), Same(PREDICTED)),
    ]
};

/// Where each field stands in a row's words, and what foretells it.
const SHAPE: Shape<WIDTH> = {
    let mut shape = Shape {
        places: [0; WIDTH],
        sources: [Source::Nothing; WIDTH],
    };
    let mut channel = 0;
    while channel < Channel::ALL.len() {
        let own = places(Channel::ALL[channel]);
        let mut at = 0;
        while own.start + at < own.end {
            shape.places[own.start + at] = Row::place(Channel::ALL[channel]) + at;
            at += 1;
        }
        channel += 1;
    }
    let mut at = 0;
    while at < FORETOLD.len() {
        let (field, source) = FORETOLD[at];
        shape.sources[field] = source;
        at += 1;
    }
    shape
};

/// Tokens on their way into a recording.
pub(crate) struct Tokens {
    packer: Packer<WIDTH>,
    /// The tick that would go on with the stretch that is being packed.
    next: Option<u64>,
    /// First ticks of stretches, and how many bytes those take that are packed.
    firsts: Vec<u64>,
    lengths: Vec<usize>,
    packed: Vec<u8>,
}

impl Tokens {
    pub fn new() -> Self {
        Self {
            packer: Packer::new(SHAPE),
            next: None,
            firsts: Vec::new(),
            lengths: Vec::new(),
            packed: Vec::new(),
        }
    }

    /// Packs rows whose ticks grow.
    pub fn add(&mut self, rows: &[Row]) {
        for stretch in rows.chunk_by(|row, next| row.tick + 1 == next.tick) {
            let (Some(first), Some(last)) = (stretch.first(), stretch.last()) else {
                continue;
            };
            if self.next != Some(first.tick) {
                self.end_stretch();
                self.firsts.push(first.tick);
            }
            self.packer.add(Row::words(stretch));
            self.next = Some(last.tick + 1);
        }
    }

    fn end_stretch(&mut self) {
        if self.next.take().is_none() {
            return;
        }
        let packed = self.packer.take();
        self.lengths.push(packed.len());
        if self.packed.is_empty() {
            self.packed = packed;
        } else {
            self.packed.extend(packed);
        }
    }

    /// What was packed, to be written.
    pub fn take(&mut self, run: &RunInfo) -> Result<Chunk, RecorderError> {
        self.end_stretch();
        let packed = std::mem::take(&mut self.packed);
        let column = batch(PACKED, Arc::new(UInt8Array::from(packed)))
            .partitioned(self.lengths.drain(..))
            .writing("tokens")?;
        let times = self.firsts.drain(..).map(|tick| run.time_ns(tick));
        chunk(ENTITY, TimeColumn::new_duration_nanos(TIMELINE, times), column)
    }
}

/// One column at some times.
pub(crate) fn chunk(
    entity: &str,
    times: TimeColumn,
    column: SerializedComponentColumn,
) -> Result<Chunk, RecorderError> {
    let times = [(*times.timeline().name(), times)].into_iter().collect();
    let columns = [(column.descriptor, column.list_array)].into_iter().collect();
    Chunk::from_auto_row_ids(ChunkId::new(), entity.into(), times, columns).writing(entity)
}

/// The words of a stretch as earlier versions wrote it, those of one field after those of the other; none if it is none.
pub(crate) fn of_planes(planes: &[u8], fields: usize) -> Option<Vec<u64>> {
    let ticks = planes.len().checked_div(fields * WORD).filter(|ticks| *ticks > 0)?;
    let mut words = vec![0; ticks * fields];
    for (words, planes) in words.chunks_exact_mut(ticks).zip(planes.chunks_exact(ticks * WORD)) {
        for (place, plane) in planes.chunks_exact(ticks).enumerate() {
            for (word, byte) in words.iter_mut().zip(plane) {
                *word |= u64::from(*byte) << (8 * place);
            }
        }
    }
    Some(words)
}

/// The token of one channel in tick `at` of a stretch that begins at `first`. The time of sending is 0.
pub(crate) fn read<M: Message>(first: u64, words: &[u64], at: usize) -> M {
    let ticks = ticks(words);
    let own = &words[places(M::CHANNEL).start * ticks + at..];
    let mut fields = [0; WIDTH];
    let fields = &mut fields[..M::FIELDS.len()];
    for (field, word) in fields.iter_mut().zip(own.iter().step_by(ticks)) {
        *field = *word;
    }
    M::from_words(first + at as u64, fields)
}

/// How many ticks a stretch has.
pub(crate) fn ticks(words: &[u64]) -> usize {
    words.len() / WIDTH
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards recordings of earlier versions: their planes are the words' bytes, the lowest first.
    #[test]
    fn planes_of_earlier_versions_are_read() {
        let words: Vec<u64> = (1..=6).map(|own| own * 0x0123_4567_89AB_CDEF).collect();
        let planes = words.chunks(3).flat_map(|ticks| {
            let byte = |place: usize| ticks.iter().map(move |word| (word >> (8 * place)) as u8);
            (0..WORD).flat_map(byte).collect::<Vec<u8>>()
        });
        assert_eq!(of_planes(&planes.collect::<Vec<u8>>(), 2), Some(words));
    }

    /// Guards the names by which fields are told: each foretells only others, and none of them in a circle.
    #[test]
    fn what_foretells_a_field_can_be_told_before_it() {
        let mut told = [false; WIDTH];
        for _ in 0..WIDTH {
            for field in 0..WIDTH {
                told[field] |= SHAPE.sources[field].fields().all(|own| told[own]);
            }
        }
        assert_eq!(told, [true; WIDTH]);
    }
}
