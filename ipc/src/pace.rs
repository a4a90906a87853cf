//! Time in a real-time loop: tick k begins at t_k = anchor + (k − anchor tick)·T and its tokens are due within it.
//!
//! T: period in ns. Free-running: the anchor is the start of tick 0, agreed by all, and never moves. Paced by the
//! measurement: the anchor is the arrival of the newest token, in time or not, so the loop follows a hardware clock that drifts
//! or slips; a reader that has counted on meanwhile waits for the hardware.
//! A reader waits for a token of its tick until its own time-out, a share of the period: later in the period the further
//! down the loop it stands, so that one late node makes one late token and not a late loop.

use crate::clock::monotonic_ns;
use crate::message::NodeId;
use crate::stop::stop_requested;
use rustix::thread::{ClockId, clock_nanosleep_absolute};
use std::cell::Cell;
use std::time::Duration;

/// How long after its last token's arrival a reader that is paced by tokens waits beyond one period, as a share of it.
const PACED_SLACK: f64 = 0.5;
/// How far behind the loop the recorder reads, so that what is late but not lost is recorded.
const RECORDER_LAG_NS: u64 = 50_000_000;

/// What the readers of one process share: where time stands and what was late in this tick.
#[derive(Debug)]
pub struct Pace {
    period_ns: u64,
    /// Of a process that only records.
    records: bool,
    follows_tokens: bool,
    busy: bool,
    anchor_tick: Cell<u64>,
    anchor_ns: Cell<u64>,
    newest_tick: Cell<u64>,
    late: Cell<u64>,
    undelivered: Cell<u64>,
}

/// How long into a tick `node` waits for the tokens of that tick, as a share of the period.
fn share(node: NodeId) -> f64 {
    match node {
        NodeId::Plant => 0.0,
        NodeId::Estimator | NodeId::Controller => 0.55,
        NodeId::Inverse => 0.7,
        NodeId::Guard => 0.8,
        NodeId::Amplifier | NodeId::Recorder => 0.9,
    }
}

impl Pace {
    /// Time for a process of these nodes. It has no meaning before [`Pace::anchor`].
    pub fn new(nodes: &[NodeId], period: Duration, follows_tokens: bool) -> Self {
        let period_ns = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX).max(1);
        Self {
            period_ns,
            records: nodes == [NodeId::Recorder],
            follows_tokens,
            busy: false,
            anchor_tick: Cell::new(0),
            anchor_ns: Cell::new(0),
            newest_tick: Cell::new(0),
            late: Cell::new(0),
            undelivered: Cell::new(0),
        }
    }

    /// The same, polling the clock instead of sleeping if so.
    #[must_use]
    pub fn polling(self, busy: bool) -> Self {
        Self { busy, ..self }
    }

    /// Says that `tick` begins, or began, at `start_ns` of the monotonic clock.
    pub fn anchor(&self, tick: u64, start_ns: u64) {
        self.anchor_tick.set(tick);
        self.anchor_ns.set(start_ns);
    }

    /// A tick and when it began, ns.
    pub(crate) fn anchored(&self) -> (u64, u64) {
        (self.anchor_tick.get(), self.anchor_ns.get())
    }

    /// Between two ticks, ns.
    pub(crate) fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// True if the arrival of tokens says when a tick begins.
    pub fn follows_tokens(&self) -> bool {
        self.follows_tokens
    }

    /// How long so many ticks last, s.
    pub fn span_s(&self, ticks: u64) -> f64 {
        ticks as f64 * self.period_ns as f64 * 1e-9
    }

    /// When `tick` begins.
    pub fn start_ns(&self, tick: u64) -> u64 {
        let (anchor_tick, anchor_ns) = self.anchored();
        if tick >= anchor_tick {
            anchor_ns.saturating_add((tick - anchor_tick).saturating_mul(self.period_ns))
        } else {
            anchor_ns.saturating_sub((anchor_tick - tick).saturating_mul(self.period_ns))
        }
    }

    /// Until when `reader` waits for a token of `tick`, whoever it shares its process with.
    pub fn time_out_ns(&self, reader: NodeId, tick: u64) -> u64 {
        let share = if self.follows_tokens {
            PACED_SLACK
        } else {
            share(reader)
        };
        let wait_ns = match self.records {
            true => RECORDER_LAG_NS.max(self.period_ns),
            false => (share * self.period_ns as f64) as u64,
        };
        self.start_ns(tick).saturating_add(wait_ns)
    }

    /// The tick that the process must turn to, at least `next`: a process that was held up leaves out what has passed.
    pub fn present(&self, next: u64) -> u64 {
        let by_clock = if self.follows_tokens {
            // Only tokens tell what the hardware counts; a clock of ours might run ahead of it.
            self.newest_tick.get()
        } else {
            let passed_ns = monotonic_ns().saturating_sub(self.anchor_ns.get());
            self.anchor_tick.get() + passed_ns / self.period_ns
        };
        next.max(by_clock)
    }

    /// Sleeps until `tick` begins; gives the time of waking in ns.
    pub fn sleep_until_start(&self, tick: u64) -> u64 {
        let due_ns = self.start_ns(tick);
        loop {
            let now_ns = monotonic_ns();
            if now_ns >= due_ns {
                return now_ns;
            }
            if self.busy {
                std::thread::yield_now();
                continue;
            }
            let due = rustix::thread::Timespec {
                tv_sec: (due_ns / 1_000_000_000) as _,
                tv_nsec: (due_ns % 1_000_000_000) as _,
            };
            // A signal ends the sleep early: then the rest is slept, or a request to stop is seen within a tick.
            if clock_nanosleep_absolute(ClockId::Monotonic, &due).is_err() && stop_requested() {
                return monotonic_ns();
            }
        }
    }

    /// A token of `tick` has come.
    pub(crate) fn arrived(&self, tick: u64, now_ns: u64) {
        if self.follows_tokens && tick > self.anchor_tick.get() {
            self.anchor_tick.set(tick);
            self.anchor_ns.set(now_ns);
        }
    }

    /// A token of `tick`, which is still ahead of the reader, has been seen.
    pub(crate) fn seen(&self, tick: u64) {
        self.newest_tick.set(self.newest_tick.get().max(tick));
    }

    /// A token was not there in time; an older one is taken.
    pub(crate) fn note_late(&self) {
        self.late.set(self.late.get() + 1);
    }

    /// A token did not reach every reader.
    pub(crate) fn note_undelivered(&self) {
        self.undelivered.set(self.undelivered.get() + 1);
    }

    /// How many tokens did not reach every reader.
    pub fn undelivered(&self) -> u64 {
        self.undelivered.get()
    }

    /// How many tokens were late since this was asked last.
    pub fn take_late(&self) -> u64 {
        self.late.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    // Guards the absolute deadlines: they do not drift with what was late, and stand in the order of the loop.
    #[test]
    fn free_running_deadlines_stand_still() {
        let guard = Pace::new(&[NodeId::Guard], Duration::from_millis(1), false);
        guard.anchor(0, 5 * MS);
        assert_eq!((guard.start_ns(0), guard.start_ns(1000)), (5 * MS, 1005 * MS));
        guard.arrived(7, 100 * MS);
        assert_eq!(guard.start_ns(1000), 1005 * MS);
        let order = [NodeId::Estimator, NodeId::Inverse, NodeId::Guard, NodeId::Amplifier];
        let time_outs = order.map(|node| guard.time_out_ns(node, 3));
        assert!(
            time_outs.is_sorted() && time_outs[3] < guard.start_ns(4),
            "{time_outs:?}"
        );
    }

    // Guards the pace of the hardware: its clock runs 1 % slow and no token of it is late.
    #[test]
    fn a_slow_hardware_clock_is_followed() {
        let pace = Pace::new(&[NodeId::Controller], Duration::from_millis(1), true);
        for tick in 1..10_000 {
            let arrival_ns = tick * 101 * MS / 100;
            assert!(arrival_ns < pace.time_out_ns(NodeId::Controller, tick), "tick {tick}");
            pace.arrived(tick, arrival_ns);
        }
        assert_eq!(pace.present(10_000), 10_000);
        pace.seen(10_400);
        assert_eq!(pace.present(10_000), 10_400);
    }

    // Guards the pace of hardware that stops for 0.8 and for 5.3 ticks: once it goes on, its reader's tick is its own again.
    #[test]
    fn a_slip_of_the_hardware_clock_is_followed() {
        let arrivals: Vec<u64> = (0..200)
            .map(|tick| tick * MS + if tick < 50 { 0 } else { MS * 4 / 5 } + if tick < 100 { 0 } else { MS * 53 / 10 })
            .collect();
        let pace = Pace::new(&[NodeId::Controller], Duration::from_millis(1), true);
        let (mut now, mut heard) = (0, 0);
        for tick in 1..200 {
            // The reader waits for its token, and takes the newest that is there.
            let until = pace.time_out_ns(NodeId::Controller, tick).max(now);
            now = arrivals[tick as usize].clamp(now, until);
            let newest = (0..=tick).rev().find(|token| arrivals[*token as usize] <= now).unwrap();
            if newest > heard {
                pace.arrived(newest, now);
                heard = newest;
            }
            let slipping = (50..53).contains(&tick) || (100..112).contains(&tick);
            assert!(slipping || newest == tick, "tick {tick} has the token of {newest}");
        }
    }

    // Guards the leap: a process that was held up turns to the present tick.
    #[test]
    fn what_has_passed_is_left_out() {
        let began_ns = monotonic_ns() - 500 * MS;
        let pace = Pace::new(&[NodeId::Guard], Duration::from_millis(1), false);
        pace.anchor(0, began_ns);
        assert!(pace.present(3) >= 500);
        assert_eq!(pace.present(1_000_000), 1_000_000);
    }
}
