//! The tokens at an FMU's boundary: last heard and last said, as words.

use anhyst_ipc::{Channel, MAX_FIELDS, Message};

/// One token a channel, of which the fields' bits are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tokens {
    words: Vec<[u64; MAX_FIELDS]>,
}

impl Default for Tokens {
    fn default() -> Self {
        Self {
            words: vec![[0; MAX_FIELDS]; Channel::ALL.len()],
        }
    }
}

impl Tokens {
    /// The token of a channel, stamped with `tick`.
    pub fn get<M: Message>(&self, tick: u64) -> M {
        M::from_words(tick, &self.words[M::CHANNEL.number()])
    }

    /// Keeps a token.
    pub fn put<M: Message>(&mut self, token: &M) {
        token.write_words(&mut self.words[M::CHANNEL.number()]);
    }

    /// The bits of a field.
    pub fn word(&self, channel: Channel, field: usize) -> u64 {
        self.words[channel.number()][field]
    }

    /// Sets the bits of a field.
    pub fn set_word(&mut self, channel: Channel, field: usize, word: u64) {
        self.words[channel.number()][field] = word;
    }
}
