//! How far each channel has come: every token must be the next of its channel.

use crate::error::BridgeError;
use crate::partition::Partition;
use anhyst_ipc::Channel;
use std::sync::atomic::{AtomicU64, Ordering};

/// The next tick of every channel that crosses, in the order in which a tick sends them. Two threads count in it, each its
/// own channels.
#[derive(Debug)]
pub struct Crossing {
    next: Vec<(Channel, AtomicU64)>,
    ticks: u64,
}

impl Crossing {
    /// Nothing has crossed yet.
    pub fn new(partition: &Partition, ticks: u64) -> Self {
        let crosses = |channel: &Channel| partition.leaving.contains(channel) || partition.coming.contains(channel);
        let channels = Channel::ALL.into_iter().filter(crosses);
        Self {
            next: channels.map(|channel| (channel, AtomicU64::new(0))).collect(),
            ticks,
        }
    }

    /// Counts a token of `channel`.
    ///
    /// # Errors
    /// If it is not the next one.
    pub fn count(&self, channel: Channel, tick: u64) -> Result<(), BridgeError> {
        let Some((_, next)) = self.next.iter().find(|(known, _)| *known == channel) else {
            return Ok(());
        };
        let expected = next.load(Ordering::Relaxed);
        if tick != expected {
            return Err(BridgeError::Gap {
                channel,
                expected,
                got: tick,
            });
        }
        next.store(tick + 1, Ordering::Relaxed);
        Ok(())
    }

    /// How many tokens have crossed.
    pub fn total(&self) -> u64 {
        self.next.iter().map(|(_, next)| next.load(Ordering::Relaxed)).sum()
    }

    /// How many tokens of `channels` have crossed.
    pub fn total_of(&self, channels: &[Channel]) -> u64 {
        let wanted = self.next.iter().filter(|(channel, _)| channels.contains(channel));
        wanted.map(|(_, next)| next.load(Ordering::Relaxed)).sum()
    }

    /// The first token that has not crossed yet: channel and tick; `None` at the end.
    pub fn first_missing(&self) -> Option<(Channel, u64)> {
        let next = self
            .next
            .iter()
            .map(|(channel, next)| (*channel, next.load(Ordering::Relaxed)));
        // Of channels that wait for the same tick, min_by_key takes the first: the one that a tick sends first.
        next.min_by_key(|(_, tick)| *tick)
            .filter(|(_, tick)| *tick < self.ticks)
    }

    /// Checks that all has crossed.
    ///
    /// # Errors
    /// The first channel that has not come to its end.
    pub fn complete(&self) -> Result<(), BridgeError> {
        match self.first_missing() {
            Some((channel, got)) => Err(BridgeError::Lost {
                channel,
                got,
                ticks: self.ticks,
            }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossing() -> Crossing {
        let partition = Partition {
            here: Vec::new(),
            remote: Vec::new(),
            leaving: vec![Channel::Measurement, Channel::CoilField],
            coming: vec![Channel::SafeField],
        };
        Crossing::new(&partition, 2)
    }

    // Guards the tick check: a token that is lost, repeated or of another tick ends the run by name.
    #[test]
    fn only_the_next_token_may_cross() {
        let crossing = crossing();
        crossing.count(Channel::SafeField, 0).unwrap();
        for wrong in [0, 2] {
            assert_eq!(
                crossing.count(Channel::SafeField, wrong),
                Err(BridgeError::Gap {
                    channel: Channel::SafeField,
                    expected: 1,
                    got: wrong
                })
            );
        }
    }

    // Guards who is named when the loop stands still: the producer of the first token that is missing.
    #[test]
    fn the_first_missing_token_is_found() {
        let crossing = crossing();
        assert_eq!(crossing.first_missing(), Some((Channel::Measurement, 0)));
        crossing.count(Channel::Measurement, 0).unwrap();
        assert_eq!(crossing.first_missing(), Some((Channel::SafeField, 0)));
        crossing.count(Channel::SafeField, 0).unwrap();
        crossing.count(Channel::CoilField, 0).unwrap();
        assert_eq!(crossing.first_missing(), Some((Channel::Measurement, 1)));
        assert!(crossing.complete().is_err());
        for channel in [Channel::Measurement, Channel::SafeField, Channel::CoilField] {
            crossing.count(channel, 1).unwrap();
        }
        crossing.complete().unwrap();
        assert_eq!(crossing.total(), 6);
        assert_eq!(crossing.total_of(&[Channel::SafeField]), 2);
    }
}
