//! A token without its type, for what carries tokens but does not read them: channel, tick, time of sending and the bits of
//! its fields.
//!
//! In a foreign program's memory it is tick, time of sending and fields, eight bytes each. On a wire the time of sending stays
//! behind, because it is of another machine's clock, and bytes are little-endian. Which fields they are, the two ends settle
//! beforehand ([`crate::layouts`]).

use crate::message::{Channel, HEAD, MAX_FIELDS, Message};

/// A token without its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawToken {
    channel: Channel,
    tick: u64,
    sent_ns: u64,
    words: [u64; MAX_FIELDS],
}

/// The most bytes that a token takes on a wire.
pub const MAX_BYTES: usize = 8 * (1 + MAX_FIELDS);
/// The most words that a token takes in a program's memory.
pub const MAX_WORDS: usize = HEAD + MAX_FIELDS;

impl RawToken {
    /// The bits of a token.
    pub fn of<M: Message>(token: &M) -> Self {
        let mut words = [0; MAX_FIELDS];
        token.write_words(&mut words);
        Self {
            channel: M::CHANNEL,
            tick: token.tick(),
            sent_ns: token.sent_ns(),
            words,
        }
    }

    /// The token again; `None` if it is of another channel.
    pub fn typed<M: Message>(&self) -> Option<M> {
        (self.channel == M::CHANNEL).then(|| {
            let mut token = M::from_words(self.tick, &self.words);
            token.stamp(self.tick, self.sent_ns);
            token
        })
    }

    /// Words of eight bytes that a token of `channel` has in a program's memory: tick, time of sending, fields.
    pub fn words_of(channel: Channel) -> usize {
        HEAD + channel.fields().len()
    }

    /// Reads it from a program's memory, [`RawToken::words_of`] long; words that are missing are 0.
    pub fn from_words(channel: Channel, words: &[u64]) -> Self {
        let mut own = [0; MAX_WORDS];
        for (own, word) in own.iter_mut().zip(words).take(Self::words_of(channel)) {
            *own = *word;
        }
        let [tick, sent_ns, words @ ..] = own;
        Self {
            channel,
            tick,
            sent_ns,
            words,
        }
    }

    /// Writes it into a program's memory, [`RawToken::words_of`] long.
    pub fn write_words(&self, words: &mut [u64]) {
        let own = [self.tick, self.sent_ns].into_iter().chain(self.words);
        for (word, own) in words.iter_mut().zip(own).take(Self::words_of(self.channel)) {
            *word = own;
        }
    }

    /// The bits of its fields; after the channel's own come zeros.
    pub fn fields(&self) -> &[u64; MAX_FIELDS] {
        &self.words
    }

    /// The same, sent at this moment of the monotonic clock.
    #[must_use]
    pub fn sent_at(self, sent_ns: u64) -> Self {
        Self { sent_ns, ..self }
    }

    /// When it was sent, monotonic clock, ns.
    pub fn sent_ns(&self) -> u64 {
        self.sent_ns
    }

    /// What it travels on.
    pub fn channel(&self) -> Channel {
        self.channel
    }

    /// The tick it belongs to.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Writes it into `buffer` and says how many bytes that took.
    pub fn write_bytes(&self, buffer: &mut [u8; MAX_BYTES]) -> usize {
        let used = 1 + self.channel.fields().len();
        let words = std::iter::once(self.tick).chain(self.words);
        for (chunk, word) in buffer.chunks_exact_mut(8).zip(words).take(used) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        8 * used
    }

    /// Reads what [`RawToken::write_bytes`] wrote; `None` if the length is not that of the channel's messages.
    pub fn from_bytes(channel: Channel, bytes: &[u8]) -> Option<Self> {
        let (chunks, rest) = bytes.as_chunks::<8>();
        let (tick, fields) = chunks.split_first()?;
        if !rest.is_empty() || fields.len() != channel.fields().len() {
            return None;
        }
        let mut words = [0; MAX_FIELDS];
        for (word, chunk) in words.iter_mut().zip(fields) {
            *word = u64::from_le_bytes(*chunk);
        }
        Some(Self {
            channel,
            tick: u64::from_le_bytes(*tick),
            sent_ns: 0,
            words,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Demand, SafeField};

    // Guards that every channel's token comes off the wire, and out of a program's memory, as it went in, the bits of a NaN
    // included.
    #[test]
    fn every_token_survives_the_wire() {
        for channel in Channel::ALL {
            let words = std::array::from_fn(|i| match i {
                0 => f64::NAN.to_bits() | 5,
                i if i < channel.fields().len() => (i as u64) << 50 | 1,
                _ => 0,
            });
            let token = RawToken {
                channel,
                tick: u64::MAX - 3,
                sent_ns: 0,
                words,
            };
            let mut buffer = [0; MAX_BYTES];
            let used = token.write_bytes(&mut buffer);
            assert_eq!(RawToken::from_bytes(channel, &buffer[..used]), Some(token));
            assert_eq!(RawToken::from_bytes(channel, &buffer[..used - 8]), None);
            assert_eq!(RawToken::from_bytes(channel, &buffer[..used - 1]), None);
            let mut memory = [0; MAX_WORDS];
            token.sent_at(7).write_words(&mut memory);
            assert_eq!(memory[..3], [u64::MAX - 3, 7, token.fields()[0]]);
            assert_eq!(RawToken::from_words(channel, &memory), token.sent_at(7));
        }
    }

    // Guards that bits and type find each other again, and only on the same channel.
    #[test]
    fn types_come_back() {
        let demand = Demand {
            tick: 9,
            sent_ns: 5,
            magnetization_a_per_m: -0.1,
            ..Demand::default()
        };
        let raw = RawToken::of(&demand);
        assert_eq!(raw.typed::<Demand>(), Some(demand));
        assert_eq!(raw.typed::<SafeField>(), None);
    }
}
