//! The newest token that is not newer than a tick: what a reader of a real-time loop takes.
//!
//! Tokens come in order. The reader takes them until one belongs to a later tick; that one is kept for later. So a reader
//! never hears of the future, a token that comes late is passed over, and a backlog is worked off in one go.

use crate::Message;

/// Stands for "no token yet" where a tick is noted.
pub const NO_TOKEN: u32 = u32::MAX;

/// The reading end's memory of one channel.
#[derive(Debug, Default)]
pub struct Newest<M: Message> {
    held: Option<M>,
    ahead: Option<M>,
    /// The tick that was asked for first: who takes the place of one that died has missed nothing before.
    first_due: Option<u64>,
    /// Ticks of the channel that no token came for.
    missing: u64,
}

impl<M: Message> Newest<M> {
    /// Brings the memory to `due` with what `poll` gives; true if nothing newer can come for `due`: its token is there, or
    /// one of a later tick.
    ///
    /// # Errors
    /// What `poll` says.
    pub fn advance<E>(&mut self, due: u64, mut poll: impl FnMut() -> Result<Option<M>, E>) -> Result<bool, E> {
        self.first_due.get_or_insert(due);
        if let Some(token) = self.ahead.take_if(|token| token.tick() <= due) {
            self.hold(token);
        }
        while self.ahead.is_none() {
            let Some(token) = poll()? else { break };
            if token.tick() <= due {
                self.hold(token);
            } else {
                self.ahead = Some(token);
            }
        }
        Ok(self.ahead.is_some() || self.is_of(due))
    }

    fn hold(&mut self, token: M) {
        let expected = self.held.as_ref().map_or(0, |held| held.tick() + 1);
        let expected = expected.max(self.first_due.unwrap_or_default());
        self.missing += token.tick().saturating_sub(expected);
        self.held = Some(token);
    }

    /// True if the token of `due` itself is held.
    pub fn is_of(&self, due: u64) -> bool {
        self.held.as_ref().is_some_and(|held| held.tick() == due)
    }

    /// For how many ticks up to `due`, since it was asked first, there was no token: one of a later tick does not count,
    /// however long it waits.
    pub fn behind(&self, due: u64) -> u64 {
        let asked_for = due + 1 - self.first_due.unwrap_or(due).min(due);
        let without = (due + 1).saturating_sub(self.held.as_ref().map_or(0, |held| held.tick() + 1));
        without.min(asked_for)
    }

    /// The held token; the default token before the first.
    pub fn token(&self) -> M {
        self.held.unwrap_or_default()
    }

    /// The tick of the held token for a log, [`NO_TOKEN`] before the first.
    pub fn noted_tick(&self) -> u32 {
        noted(self.held.as_ref())
    }

    /// The tick of the token that waits for its time.
    pub fn ahead_tick(&self) -> Option<u64> {
        self.ahead.as_ref().map(Message::tick)
    }

    /// Ticks that no token came for, up to the one that is held.
    pub fn missing(&self) -> u64 {
        self.missing
    }
}

/// A token's tick in 32 bits; runs are shorter than 4e9 ticks.
pub fn noted<M: Message>(token: Option<&M>) -> u32 {
    token.map_or(NO_TOKEN, |token| u32::try_from(token.tick()).unwrap_or(NO_TOKEN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CoilField;
    use std::collections::VecDeque;

    fn token(tick: u64) -> CoilField {
        CoilField {
            tick,
            field_a_per_m: tick as f64,
            ..CoilField::default()
        }
    }

    /// Takes at `due` from a queue of tokens; gives what is held, and whether it was final.
    fn take(newest: &mut Newest<CoilField>, queue: &mut VecDeque<CoilField>, due: u64) -> (u32, bool) {
        let settled = newest.advance(due, || Ok::<_, ()>(queue.pop_front())).unwrap();
        (newest.noted_tick(), settled)
    }

    // Guards causality and freshness: never a later token, always the newest that has come.
    #[test]
    fn the_newest_not_newer_than_the_tick() {
        let mut newest = Newest::default();
        let mut queue = VecDeque::new();
        assert_eq!(take(&mut newest, &mut queue, 0), (NO_TOKEN, false));
        assert_eq!(newest.token(), CoilField::default());
        assert_eq!((newest.behind(0), newest.behind(4)), (1, 5));
        queue.extend([0, 1, 2, 4].map(token));
        assert_eq!(take(&mut newest, &mut queue, 1), (1, true));
        // Token 3 cannot come any more: that 4 has come tells.
        assert_eq!(take(&mut newest, &mut queue, 3), (2, true));
        assert_eq!(newest.ahead_tick(), Some(4));
        assert_eq!((newest.behind(2), newest.behind(10)), (0, 8));
        assert_eq!(take(&mut newest, &mut queue, 4), (4, true));
        assert_eq!(take(&mut newest, &mut queue, 5), (4, false));
        queue.extend([5, 6, 7, 8].map(token));
        assert_eq!(take(&mut newest, &mut queue, 20), (8, false));
        assert_eq!(newest.missing(), 1);
    }

    // Guards the count of a reader that takes the place of one that died: what passed before it came was not lost on it.
    #[test]
    fn nothing_is_missed_before_it_is_asked_for() {
        let mut newest = Newest::default();
        let mut queue = VecDeque::from([4998, 4999, 5001, 5002].map(token));
        assert_eq!(take(&mut newest, &mut queue, 5000), (4999, true));
        assert_eq!((newest.missing(), newest.behind(5000), newest.behind(5001)), (0, 1, 2));
        assert_eq!(take(&mut newest, &mut queue, 5002), (5002, true));
        assert_eq!(newest.missing(), 1);
    }
}
