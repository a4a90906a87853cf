//! The newest token that is not newer than a tick: what a reader of a real-time loop takes.
//!
//! Tokens come in order. The reader takes them until one belongs to a later tick; that one is kept for later. So a reader
//! never hears of the future, a token that comes late is passed over, and a backlog is worked off in one go.
//!
//! k ≤ k₀ + 2 (t − t₀)/T + 64 for a token of tick k that comes at t; k₀, t₀ tick and arrival of the one before, T the period.
//! No sender's time runs twice as fast, and no more than 64 are under way to a node: a token beyond that has a false tick, by
//! which the reader would wait for it, deaf, or go there itself. It is passed over, and its tick counts as missing.

use crate::raw::RawToken;

/// Stands for "no token yet" where a tick is noted.
pub const NO_TOKEN: u32 = u32::MAX;

/// So much faster than ours no sender's time runs.
const MAX_RATE: u64 = 2;
/// So many ticks may be between a sender and a reader whatever the time: what a node's buffer holds.
const MAX_UNDER_WAY: u64 = 64;

/// The reading end's memory of one channel.
#[derive(Debug, Default)]
pub struct Newest {
    latest: Option<RawToken>,
    ahead: Option<RawToken>,
    /// The tick that was asked for first: who takes the place of one that died has missed nothing before.
    first_due: Option<u64>,
    /// Ticks of the channel that no token came for.
    missing: u64,
    /// Tick and arrival (ns) of the token that came last.
    arrived: Option<(u64, u64)>,
    /// Between two ticks, ns.
    period_ns: u64,
}

impl Newest {
    /// Nothing yet, of a channel with a tick each `period_ns`.
    pub fn new(period_ns: u64) -> Self {
        Self {
            period_ns,
            ..Self::default()
        }
    }

    /// Says when a tick of this channel was or will be, for the first token to be judged by; without it that is believed.
    pub fn anchor(&mut self, (tick, at_ns): (u64, u64)) {
        self.arrived.get_or_insert((tick, at_ns));
    }

    /// Takes all that `poll` gives at `now_ns`: for a reader that has no tick of its own.
    ///
    /// # Errors
    /// What `poll` says.
    pub fn catch_up<E>(&mut self, now_ns: u64, poll: impl FnMut() -> Result<Option<RawToken>, E>) -> Result<(), E> {
        let due = self.last_possible_tick(now_ns);
        self.advance(due, now_ns, poll).map(|_| ())
    }

    /// Brings the memory to `due` with what `poll` gives at `now_ns`; true if nothing newer can come for `due`: its token is
    /// there, or one of a later tick.
    ///
    /// # Errors
    /// What `poll` says.
    pub fn advance<E>(
        &mut self,
        due: u64,
        now_ns: u64,
        mut poll: impl FnMut() -> Result<Option<RawToken>, E>,
    ) -> Result<bool, E> {
        self.first_due.get_or_insert(due);
        if let Some(token) = self.ahead.take_if(|token| token.tick() <= due) {
            self.take(token);
        }
        while self.ahead.is_none() {
            let Some(token) = poll()? else { break };
            if token.tick() <= due {
                self.take(token);
            } else if token.tick() <= self.last_possible_tick(now_ns) {
                self.ahead = Some(token);
            } else {
                continue;
            }
            self.arrived = Some((token.tick(), now_ns));
        }
        Ok(self.ahead.is_some() || self.is_of(due))
    }

    fn last_possible_tick(&self, now_ns: u64) -> u64 {
        let Some((tick, at_ns)) = self.arrived else {
            return u64::MAX;
        };
        let passed_ticks = now_ns.saturating_sub(at_ns) / self.period_ns.max(1);
        tick.saturating_add(MAX_RATE.saturating_mul(passed_ticks))
            .saturating_add(MAX_UNDER_WAY)
    }

    fn take(&mut self, token: RawToken) {
        let expected = self.latest.map_or(0, |latest| latest.tick().saturating_add(1));
        let expected = expected.max(self.first_due.unwrap_or_default());
        self.missing += token.tick().saturating_sub(expected);
        self.latest = Some(token);
    }

    /// True if the token of `due` itself has been taken.
    pub fn is_of(&self, due: u64) -> bool {
        self.latest.is_some_and(|latest| latest.tick() == due)
    }

    /// For how many ticks up to `due`, since it was asked first, there was no token: one of a later tick does not count,
    /// however long it waits.
    pub fn behind(&self, due: u64) -> u64 {
        let asked_for = due + 1 - self.first_due.unwrap_or(due).min(due);
        let next = self.latest.map_or(0, |latest| latest.tick().saturating_add(1));
        (due + 1).saturating_sub(next).min(asked_for)
    }

    /// The newest token; none before the first.
    pub fn token(&self) -> Option<&RawToken> {
        self.latest.as_ref()
    }

    /// The tick of the newest token for a log, [`NO_TOKEN`] before the first.
    pub fn noted_tick(&self) -> u32 {
        noted(self.latest.map(|latest| latest.tick()))
    }

    /// The tick of the token that waits for its time.
    pub fn ahead_tick(&self) -> Option<u64> {
        self.ahead.map(|ahead| ahead.tick())
    }

    /// Ticks that no token came for, up to the newest one.
    pub fn missing(&self) -> u64 {
        self.missing
    }
}

/// A token's tick in 32 bits; runs are shorter than 4e9 ticks.
pub fn noted(tick: Option<u64>) -> u32 {
    tick.and_then(|tick| u32::try_from(tick).ok()).unwrap_or(NO_TOKEN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::CoilField;
    use std::collections::VecDeque;

    const PERIOD_NS: u64 = 1000;

    fn token(tick: u64) -> RawToken {
        RawToken::of(&CoilField {
            tick,
            field_a_per_m: tick as f64,
            ..CoilField::default()
        })
    }

    /// Takes at `due`, one period a tick, from a queue of tokens; gives what is newest, and whether it was final.
    fn take(newest: &mut Newest, queue: &mut VecDeque<RawToken>, due: u64) -> (u32, bool) {
        let settled = newest
            .advance(due, due * PERIOD_NS, || Ok::<_, ()>(queue.pop_front()))
            .unwrap();
        (newest.noted_tick(), settled)
    }

    // Guards causality and freshness: never a later token, always the newest that has come.
    #[test]
    fn the_newest_not_newer_than_the_tick() {
        let mut newest = Newest::new(PERIOD_NS);
        let mut queue = VecDeque::new();
        assert_eq!(take(&mut newest, &mut queue, 0), (NO_TOKEN, false));
        assert_eq!(newest.token(), None);
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
        let mut newest = Newest::new(PERIOD_NS);
        let mut queue = VecDeque::from([4998, 4999, 5001, 5002].map(token));
        assert_eq!(take(&mut newest, &mut queue, 5000), (4999, true));
        assert_eq!((newest.missing(), newest.behind(5000), newest.behind(5001)), (0, 1, 2));
        assert_eq!(take(&mut newest, &mut queue, 5002), (5002, true));
        assert_eq!(newest.missing(), 1);
    }

    // Guards against a token whose tick is false: its reader waited for that tick and heard nothing until then.
    #[test]
    fn a_token_from_the_future_makes_nobody_deaf() {
        for false_tick in [1_000_003, u64::MAX] {
            let mut newest = Newest::new(PERIOD_NS);
            let mut queue = VecDeque::from([0, 1, 2, false_tick].map(token));
            assert_eq!(take(&mut newest, &mut queue, 3), (2, false));
            assert_eq!(newest.ahead_tick(), None);
            queue.extend([4, 5].map(token));
            assert_eq!(take(&mut newest, &mut queue, 4), (4, true));
            assert_eq!(take(&mut newest, &mut queue, 5), (5, true));
            assert_eq!(newest.missing(), 1);
        }
    }

    // Guards a reader that was held up: what its buffer holds by then is far ahead of it, and true.
    #[test]
    fn time_that_has_passed_is_believed() {
        let mut newest = Newest::new(PERIOD_NS);
        let mut queue = VecDeque::from([0, 1].map(token));
        assert_eq!(take(&mut newest, &mut queue, 1), (1, true));
        queue.extend([9937, 9938].map(token));
        let poll = || Ok::<_, ()>(queue.pop_front());
        assert_eq!(newest.advance(2, 10_000 * PERIOD_NS, poll), Ok(true));
        assert_eq!(newest.ahead_tick(), Some(9937));
    }
}
