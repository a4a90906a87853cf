//! A token without its type, for what carries tokens but does not read them: channel, tick and the bits of its fields.
//!
//! On a wire it is its tick and then its fields, eight bytes each, little-endian. The time of sending stays behind: it is of
//! another machine's clock. Which fields they are, the two ends settle beforehand ([`crate::layouts`]).

use crate::message::MOST_FIELDS;
use crate::{Channel, Message};

/// A token without its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawToken {
    channel: Channel,
    tick: u64,
    words: [u64; MOST_FIELDS],
}

/// The most bytes that a token takes on a wire.
pub const MOST_BYTES: usize = 8 * (1 + MOST_FIELDS);

impl RawToken {
    /// The bits of a token.
    pub fn of<M: Message>(token: &M) -> Self {
        let mut words = [0; MOST_FIELDS];
        token.write_words(&mut words);
        Self {
            channel: M::CHANNEL,
            tick: token.tick(),
            words,
        }
    }

    /// The token again; `None` if it is of another channel.
    pub fn typed<M: Message>(&self) -> Option<M> {
        (self.channel == M::CHANNEL).then(|| M::from_words(self.tick, &self.words))
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
    pub fn write_bytes(&self, buffer: &mut [u8; MOST_BYTES]) -> usize {
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
        let mut words = [0; MOST_FIELDS];
        for (word, chunk) in words.iter_mut().zip(fields) {
            *word = u64::from_le_bytes(*chunk);
        }
        Some(Self {
            channel,
            tick: u64::from_le_bytes(*tick),
            words,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Demand, SafeField};

    // Guards that every channel's token comes off the wire as it went on, the bits of a NaN included.
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
                words,
            };
            let mut buffer = [0; MOST_BYTES];
            let used = token.write_bytes(&mut buffer);
            assert_eq!(RawToken::from_bytes(channel, &buffer[..used]), Some(token));
            assert_eq!(RawToken::from_bytes(channel, &buffer[..used - 8]), None);
            assert_eq!(RawToken::from_bytes(channel, &buffer[..used - 1]), None);
        }
    }

    // Guards that bits and type find each other again, and only on the same channel.
    #[test]
    fn types_come_back() {
        let demand = Demand {
            tick: 9,
            magnetization_a_per_m: -0.1,
            ..Demand::default()
        };
        let raw = RawToken::of(&demand);
        assert_eq!(raw.typed::<Demand>(), Some(demand));
        assert_eq!(raw.typed::<SafeField>(), None);
    }
}
