//! The newest token that is not newer than a tick: what a reader of a real-time loop takes.
//!
//! Tokens come in order. The reader takes them until one belongs to a later tick; that one is kept for later. So a reader
//! never hears of the future, a token that comes late is passed over, and a backlog is worked off in one go.
//!
//! k ≤ k₀ + 2 (t − t₀)/T + n for a token of tick k that comes at t; k₀, t₀ tick and arrival of the one before, T the period.
//! No sender's time runs twice as fast. n = 2 is the rule; up to n = 64 a token is believed if the one before it has leapt, too:
//! tokens were lost. Any other has a false tick, by which the reader would wait for it, deaf, or
//! go there itself. It is passed over, as is one that is not newer than the newest, and its tick counts as missing.

use crate::raw::RawToken;

/// Stands for "no token yet" where a tick is noted.
pub const NO_TOKEN: u32 = u32::MAX;

/// So much faster than ours no sender's time runs.
const MAX_RATE: u64 = 2;
/// So many ticks may be between two tokens whatever the time.
const MAX_LEAP: u64 = 2;
/// So many where tokens were lost.
const MAX_LOST: u64 = 64;

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
    /// The tick of the last token, if it has leapt and was passed over.
    doubted: Option<u64>,
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
        let due = self.last_possible_tick(now_ns).saturating_add(MAX_LEAP);
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
            let old = self.latest.is_some_and(|latest| token.tick() <= latest.tick());
            if old || !self.believes(token.tick(), due, now_ns) {
                continue;
            }
            self.arrived = Some((token.tick(), now_ns));
            if token.tick() <= due {
                self.take(token);
            } else {
                self.ahead = Some(token);
            }
        }
        Ok(self.ahead.is_some() || self.is_of(due))
    }

    fn believes(&mut self, tick: u64, due: u64, now_ns: u64) -> bool {
        let last_possible = self.last_possible_tick(now_ns);
        if tick <= last_possible.saturating_add(MAX_LEAP).max(due) {
            self.doubted = None;
            return true;
        }
        let before = self.doubted.replace(tick);
        let goes_on = before.is_some_and(|before| tick > before && tick - before <= MAX_LEAP);
        goes_on && tick <= last_possible.saturating_add(MAX_LOST)
    }

    fn last_possible_tick(&self, now_ns: u64) -> u64 {
        let Some((tick, at_ns)) = self.arrived else {
            return u64::MAX;
        };
        let passed_ticks = now_ns.saturating_sub(at_ns) / self.period_ns.max(1);
        tick.saturating_add(MAX_RATE.saturating_mul(passed_ticks))
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
        for false_tick in [6, 43, 1_000_003, u64::MAX] {
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

    // Guards against the same from the past: its reader took the next ones for leaps, and heard nothing until time had caught up.
    #[test]
    fn a_token_from_the_past_makes_nobody_deaf() {
        let mut newest = Newest::new(PERIOD_NS);
        let mut queue: VecDeque<_> = (0..=999).map(token).collect();
        assert_eq!(take(&mut newest, &mut queue, 999), (999, true));
        queue.push_back(token(500));
        assert_eq!(take(&mut newest, &mut queue, 1000), (999, false));
        queue.push_back(token(1001));
        assert_eq!(take(&mut newest, &mut queue, 1001), (1001, true));
    }

    // Guards a reader whose buffer ran over in a moment: the second token after the hole is believed.
    #[test]
    fn a_leap_that_goes_on_is_believed_within_bounds() {
        for (leap, believed) in [(40, Some(41)), (1_000_000, None)] {
            let mut newest = Newest::new(PERIOD_NS);
            let mut queue = VecDeque::from([0, 1, leap, leap + 1].map(token));
            assert_eq!(take(&mut newest, &mut queue, 1).0, 1);
            assert_eq!((newest.ahead_tick(), queue.len()), (believed, 0));
        }
    }

    // Guards a reader without ticks of its own, and the greatest of all ticks as the first.
    #[test]
    fn whoever_has_no_tick_takes_what_time_allows() {
        let mut newest = Newest::new(PERIOD_NS);
        newest.anchor((0, 0));
        for (now, tokens, expected) in [
            (3, vec![u64::MAX, 0, 1, 2], 2),
            (4, vec![3, 90], 3),
            (5, vec![4], 4),
            (90, vec![], 4),
            (91, vec![90, 91], 91),
        ] {
            let mut queue: VecDeque<_> = tokens.into_iter().map(token).collect();
            newest
                .catch_up(now * PERIOD_NS, || Ok::<_, ()>(queue.pop_front()))
                .unwrap();
            assert_eq!(newest.noted_tick(), expected);
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
