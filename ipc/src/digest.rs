//! The digest of what a node sent: a chain of hashes, one link a tick, so that two runs can be compared and the first tick
//! that differs found. Tick and fields enter, the time of sending does not.

use crate::message::{HEAD, MAX_FIELDS, Message};
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use xxhash_rust::xxh3::{xxh3_64_with_seed, xxh3_128};

/// Running hash over tokens.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Digest(pub u64);

impl Digest {
    /// Adds one token: its tick and the bits of its fields.
    pub fn add(&mut self, tick: u64, words: &[u64]) {
        let mut bytes = [0; 8 * (MAX_FIELDS + 1)];
        let used = words.len() + 1;
        for (chunk, word) in bytes
            .chunks_exact_mut(8)
            .zip(std::iter::once(tick).chain(words.iter().copied()))
        {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        self.0 = xxh3_64_with_seed(&bytes[..8 * used], self.0);
    }

    /// The same of a token as it lies in memory.
    #[inline]
    pub fn add_token<M: Message>(&mut self, token: &mut M) {
        let (tick, sent_ns) = (token.tick(), token.sent_ns());
        if cfg!(target_endian = "big") {
            return self.add(tick, token.field_words());
        }
        // The tick in the place of the time of sending: then it is followed by the fields.
        token.stamp(tick, tick);
        let words = &token.words()[HEAD - 1..];
        // SAFETY: the same memory, byte by byte.
        let bytes = unsafe { std::slice::from_raw_parts(words.as_ptr().cast(), size_of_val(words)) };
        self.0 = xxh3_64_with_seed(bytes, self.0);
        token.stamp(tick, sent_ns);
    }
}

/// The digest after every tick of one node.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DigestHistory {
    chain: Vec<u64>,
}

impl DigestHistory {
    /// Room for `ticks` ticks, taken now so that no step allocates.
    pub fn with_capacity(ticks: usize) -> Self {
        Self {
            chain: Vec::with_capacity(ticks),
        }
    }

    /// Notes the digest after the next tick.
    pub fn push(&mut self, digest: Digest) {
        self.chain.push(digest.0);
    }

    /// Notes the digest after `tick`; over ticks before it that were left out the digest stayed.
    #[inline]
    pub fn note(&mut self, tick: u64, digest: Digest) {
        if tick > self.chain.len() as u64 {
            self.chain.resize(tick as usize, self.last());
        }
        self.push(digest);
    }

    /// The digest after the last tick.
    pub fn last(&self) -> u64 {
        self.chain.last().copied().unwrap_or_default()
    }

    /// How many ticks it covers.
    pub fn len(&self) -> usize {
        self.chain.len()
    }

    /// True before the first tick.
    pub fn is_empty(&self) -> bool {
        self.chain.is_empty()
    }

    /// The first tick at which two runs of a node differ; a missing tick is a difference.
    pub fn first_difference(&self, other: &Self) -> Option<u64> {
        let common = self.len().min(other.len());
        let first = self.chain.iter().zip(&other.chain).take_while(|(a, b)| a == b).count();
        (first < common || self.len() != other.len()).then_some(first as u64)
    }

    /// Writes little-endian bytes, eight a tick.
    ///
    /// # Errors
    /// As the file's.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        let mut links = self.chain.iter();
        links.try_for_each(|link| file.write_all(&link.to_le_bytes()))?;
        file.flush()
    }

    /// What [`DigestHistory::write`] has written; trailing bytes that are no whole link are dropped.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let (links, _) = bytes.as_chunks::<8>();
        Self {
            chain: links.iter().map(|link| u64::from_le_bytes(*link)).collect(),
        }
    }
}

/// A fingerprint of a text: equal texts have equal ones.
pub fn fingerprint(text: &str) -> u64 {
    xxh3_64_with_seed(text.as_bytes(), 0)
}

/// The digest of a whole run, 32 hexadecimal digits, from the nodes' names and last digests in loop order.
pub fn combine<'a>(nodes: impl IntoIterator<Item = (&'a str, u64)>) -> String {
    let mut bytes = Vec::new();
    for (name, digest) in nodes {
        bytes.extend_from_slice(name.as_bytes());
        bytes.extend_from_slice(&digest.to_le_bytes());
    }
    format!("{:032x}", xxh3_128(&bytes))
}
