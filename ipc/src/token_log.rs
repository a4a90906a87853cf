//! What a node consumed and sent in every tick of a real-time run, in a memory-mapped file: enough to run it again bit for bit.
//!
//! Record of tick k, little-endian words of 8 bytes, at its place in the file: (start number << 48) | (k + 1), with bit 47 set
//! for a tick that was left out and followed later, 0 for one that was lost; the ticks of the tokens consumed, two a word, [`NO_TOKEN`] for none; the fields of those among them
//! whose sender keeps no log; the fields of the tokens sent.
//! The mapping is shared with the file: a process that is killed loses nothing, and no step makes a system call.

use crate::error::LinkError;
use crate::message::{Channel, MAX_FIELDS, Message, NodeId};
use crate::newest::NO_TOKEN;
use crate::wire::Wire;
use memmap2::{Mmap, MmapMut};
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

const START_SHIFT: u32 = 48;
const UNANSWERED: u64 = 1 << 47;
const TICK_MASK: u64 = UNANSWERED - 1;

/// What a record of a node holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordLayout {
    /// The channels consumed, in the order of the block's inputs.
    pub inputs: Vec<Channel>,
    /// Those among them whose tokens are kept whole, because their sender keeps no log: a foreign process.
    pub copied: Vec<Channel>,
    /// The channels sent.
    pub outputs: Vec<Channel>,
}

impl RecordLayout {
    /// The layout of `node` in a loop with these `wires`.
    pub fn of(node: NodeId, wires: &[Wire]) -> Self {
        let inputs = wires.iter().filter(|wire| wire.reader == node);
        let outputs = Channel::ALL.into_iter().filter(|channel| channel.producer() == node);
        Self {
            inputs: inputs.map(|wire| wire.channel).collect(),
            copied: Vec::new(),
            outputs: outputs.collect(),
        }
    }

    /// The same, with the tokens that come from `foreign` nodes kept whole.
    #[must_use]
    pub fn with_copies_of(mut self, foreign: &[NodeId]) -> Self {
        let inputs = self.inputs.iter().copied();
        self.copied = inputs.filter(|channel| foreign.contains(&channel.producer())).collect();
        self
    }

    fn input_words(&self) -> usize {
        self.inputs.len().div_ceil(2)
    }

    fn copied_words(&self) -> usize {
        self.copied.iter().map(|channel| channel.fields().len()).sum()
    }

    fn output_words(&self) -> usize {
        self.outputs.iter().map(|channel| channel.fields().len()).sum()
    }

    /// Words of a record.
    pub fn words(&self) -> usize {
        1 + self.input_words() + self.copied_words() + self.output_words()
    }

    /// Bytes of a run's file.
    pub fn bytes(&self, ticks: u64) -> u64 {
        8 * self.words() as u64 * ticks
    }
}

/// The file of a node's process while it runs.
#[derive(Debug)]
pub struct TokenLog {
    map: MmapMut,
    layout: RecordLayout,
    start_number: u64,
    tick: u64,
    next_input: usize,
    first_of_pair: u32,
    next_word: usize,
}

fn refused(path: &Path) -> impl Fn(std::io::Error) -> LinkError {
    let operation = format!("map the token log {}", path.display());
    move |cause| LinkError::System {
        operation: operation.clone(),
        cause: cause.to_string(),
    }
}

impl TokenLog {
    /// Makes the file of a run of `ticks`, or goes on with that of a process that died: then the start number is one higher.
    ///
    /// # Errors
    /// If the file cannot be made as large as it must be.
    pub fn open(path: &Path, layout: RecordLayout, ticks: u64, again: bool) -> Result<Self, LinkError> {
        let refused = refused(path);
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(!again)
            .open(path)
            .map_err(&refused)?;
        file.set_len(layout.bytes(ticks)).map_err(&refused)?;
        // SAFETY: the file belongs to this run's folder and to this process alone; who reads it waits for the run's end.
        let map = unsafe { MmapMut::map_mut(&file) }.map_err(&refused)?;
        let starts = if again { last_start(&map, layout.words()) + 1 } else { 0 };
        Ok(Self {
            map,
            layout,
            start_number: starts,
            tick: 0,
            next_input: 0,
            first_of_pair: NO_TOKEN,
            next_word: 0,
        })
    }

    /// Begins the record of `tick`.
    pub fn begin(&mut self, tick: u64) {
        self.tick = tick;
        self.next_input = 0;
        self.next_word = 1 + self.layout.input_words();
    }

    /// Notes the tick of the token taken from the next input; `fields` writes its fields, if they are to be kept.
    pub fn consume(&mut self, tick: u32, fields: &dyn Fn(&mut [u64])) {
        let (word, half) = (1 + self.next_input / 2, self.next_input % 2);
        self.first_of_pair = if half == 0 { tick } else { self.first_of_pair };
        let second = if half == 0 { NO_TOKEN } else { tick };
        self.put(word, u64::from(self.first_of_pair) | u64::from(second) << 32);
        let channel = self.layout.inputs.get(self.next_input).copied();
        self.next_input += 1;
        if let Some(channel) = channel.filter(|channel| self.layout.copied.contains(channel)) {
            let mut words = [0; MAX_FIELDS];
            fields(&mut words);
            for word in &words[..channel.fields().len()] {
                self.put(self.next_word, *word);
                self.next_word += 1;
            }
        }
    }

    /// Adds the fields of one token; the last one completes the record, which is before that token is sent.
    pub fn add(&mut self, words: &[u64]) {
        for word in words {
            self.put(self.next_word, *word);
            self.next_word += 1;
        }
        if self.next_word == self.layout.words() {
            self.end(0);
        }
    }

    /// Completes the record of a tick in which nothing is sent.
    pub fn end_unanswered(&mut self) {
        self.end(UNANSWERED);
    }

    fn end(&mut self, mark: u64) {
        std::sync::atomic::fence(std::sync::atomic::Ordering::Release);
        self.put(0, self.start_number << START_SHIFT | mark | (self.tick + 1));
    }

    fn put(&mut self, word: usize, value: u64) {
        let place = 8 * (self.tick as usize * self.layout.words() + word);
        if let Some(bytes) = self.map.get_mut(place..place + 8) {
            bytes.copy_from_slice(&value.to_le_bytes());
        }
    }
}

fn words_before(channels: &[Channel], channel: Channel) -> usize {
    let before = channels.iter().take_while(|known| **known != channel);
    before.map(|known| known.fields().len()).sum()
}

fn word_at(bytes: &[u8], index: usize) -> u64 {
    let found = bytes.get(8 * index..).and_then(|rest| rest.first_chunk::<8>());
    found.map_or(0, |word| u64::from_le_bytes(*word))
}

fn last_start(bytes: &[u8], words: usize) -> u64 {
    let records = bytes.len() / (8 * words);
    let starts = (0..records).map(|record| word_at(bytes, record * words) >> START_SHIFT);
    starts.max().unwrap_or_default()
}

/// One tick of a node as its log tells it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TokenRecord {
    /// The tick.
    pub tick: u64,
    /// 0 for the process that the run began with, one more for each restart.
    pub start_number: u64,
    /// False for a tick that was left out, and followed later: what was consumed then is told, and nothing was sent.
    pub answered: bool,
    /// The ticks of the tokens consumed, in the order of the layout; none before the first.
    pub consumed: Vec<Option<u64>>,
}

/// A node's log after the run.
#[derive(Debug)]
pub struct TokenLogFile {
    map: Mmap,
    layout: RecordLayout,
    path: PathBuf,
}

impl TokenLogFile {
    /// Opens a log.
    ///
    /// # Errors
    /// If it is not there or its size is not that of whole records.
    pub fn open(path: &Path, layout: RecordLayout) -> Result<Self, LinkError> {
        let file = std::fs::File::open(path).map_err(refused(path))?;
        // SAFETY: the run is over; nobody writes the file any more.
        let map = unsafe { Mmap::map(&file) }.map_err(refused(path))?;
        if map.len() % (8 * layout.words()) != 0 {
            let sentence = format!(
                "{} bytes are no whole number of records of {} words",
                map.len(),
                layout.words()
            );
            return Err(refused(path)(std::io::Error::other(sentence)));
        }
        Ok(Self {
            map,
            layout,
            path: path.to_owned(),
        })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What a record holds.
    pub fn layout(&self) -> &RecordLayout {
        &self.layout
    }

    /// Ticks of the run, also those that were left out.
    pub fn ticks(&self) -> u64 {
        (self.map.len() / (8 * self.layout.words())) as u64
    }

    /// The record of a tick; none if the node left it out.
    pub fn record(&self, tick: u64) -> Option<TokenRecord> {
        self.followed(tick).filter(|record| record.answered)
    }

    /// The same, also of a tick that the node left out and followed later.
    pub fn followed(&self, tick: u64) -> Option<TokenRecord> {
        let first = tick as usize * self.layout.words();
        let head = word_at(&self.map, first);
        if head & TICK_MASK != tick + 1 {
            return None;
        }
        let consumed = (0..self.layout.inputs.len()).map(|input| {
            let noted = (word_at(&self.map, first + 1 + input / 2) >> (32 * (input % 2))) as u32;
            (noted != NO_TOKEN).then_some(u64::from(noted))
        });
        Some(TokenRecord {
            tick,
            start_number: head >> START_SHIFT,
            answered: head & UNANSWERED == 0,
            consumed: consumed.collect(),
        })
    }

    /// The token that the node sent on `M`'s channel in `tick`.
    pub fn token<M: Message>(&self, tick: u64) -> Option<M> {
        self.record(tick)?;
        let place = self.layout.copied_words() + words_before(&self.layout.outputs, M::CHANNEL);
        Some(M::from_words(tick, &self.fields::<M>(tick, place)))
    }

    /// The token of a foreign process that the node consumed on `M`'s channel in `tick`; none if it is not kept whole, or if
    /// there was none yet.
    pub fn consumed<M: Message>(&self, tick: u64) -> Option<M> {
        let input = self.layout.inputs.iter().position(|channel| *channel == M::CHANNEL)?;
        let sent = self.followed(tick)?.consumed.get(input).copied().flatten()?;
        if !self.layout.copied.contains(&M::CHANNEL) {
            return None;
        }
        let place = words_before(&self.layout.copied, M::CHANNEL);
        Some(M::from_words(sent, &self.fields::<M>(tick, place)))
    }

    /// The fields that stand `place` words behind the ticks of the tokens consumed in `tick`.
    fn fields<M: Message>(&self, tick: u64, place: usize) -> [u64; MAX_FIELDS] {
        let first = tick as usize * self.layout.words() + 1 + self.layout.input_words() + place;
        let mut words = [0; MAX_FIELDS];
        for (index, word) in words.iter_mut().enumerate().take(M::FIELDS.len()) {
            *word = word_at(&self.map, first + index);
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Measurement, SafeField};

    fn layout() -> RecordLayout {
        let wire = |channel| Wire {
            channel,
            reader: NodeId::Guard,
            delay: 0,
        };
        RecordLayout::of(
            NodeId::Guard,
            &[wire(Channel::FieldCommand), wire(Channel::Measurement)],
        )
    }

    fn write(log: &mut TokenLog, tick: u64, second: u32, field: f64) {
        log.begin(tick);
        // What the second input has heard would be its first field, if its tokens are kept.
        log.consume(tick as u32, &|_| panic!("is not kept"));
        log.consume(second, &|words| words[0] = 42);
        log.add(&[field.to_bits(), 3, 0]);
    }

    // Guards the format: what was written comes back to the bit, ticks left out are known as such, a restart is told.
    #[test]
    fn records_come_back_and_restarts_are_told() {
        for layout in [layout(), layout().with_copies_of(&[NodeId::Plant])] {
            records_come_back(&layout);
        }
    }

    fn records_come_back(layout: &RecordLayout) {
        let path = std::env::temp_dir().join(format!("anhyst-token-log-{}.bin", std::process::id()));
        let mut log = TokenLog::open(&path, layout.clone(), 10, false).unwrap();
        write(&mut log, 2, NO_TOKEN, f64::from_bits(0x7ff8_dead_beef_0001));
        drop(log);
        let mut log = TokenLog::open(&path, layout.clone(), 10, true).unwrap();
        log.begin(6);
        log.consume(5, &|_| panic!("is not kept"));
        log.consume(6, &|words| words[0] = 41);
        log.end_unanswered();
        write(&mut log, 7, 6, -0.0);
        let file = TokenLogFile::open(&path, layout.clone()).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(file.ticks(), 10);
        assert_eq!(file.record(3), None);
        let expected = TokenRecord {
            tick: 2,
            start_number: 0,
            answered: true,
            consumed: vec![Some(2), None],
        };
        assert_eq!(file.record(2), Some(expected));
        assert_eq!(file.record(7).unwrap().start_number, 1);
        assert_eq!((file.record(6), file.token::<SafeField>(6)), (None, None));
        let followed = file.followed(6).unwrap();
        assert_eq!((followed.start_number, followed.answered), (1, false));
        assert_eq!(followed.consumed, [Some(5), Some(6)]);
        assert!(file.followed(7).unwrap().answered);
        assert_eq!(file.consumed::<Measurement>(2), None);
        let heard = file
            .consumed::<Measurement>(7)
            .map(|token| (token.tick, token.displacement_m.to_bits()));
        assert_eq!(heard, (!layout.copied.is_empty()).then_some((6, 42)));
        let token = file.token::<SafeField>(2).unwrap();
        assert_eq!(
            (token.field_a_per_m.to_bits(), token.status),
            (0x7ff8_dead_beef_0001, 3)
        );
    }
}
