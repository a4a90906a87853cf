//! One process's loop in real time.
//!
//! The process that has the plant has the timer: it sleeps until t_k and never leaves a tick out, because a plant's time
//! passes whether or not anyone looks; after a pause it catches up. It is late where it has not done before t_k+1. Every other process waits for its tokens until its
//! time-out in tick k, takes what it has then, and goes on with tick k + 1; one that was held up goes on with the present tick.

use super::{Attempt, Distribution, RealtimeReport};
use anhyst_ipc::{Latency, LinkError, NodeId, Pace, SharedContext, monotonic_ns};
use anhyst_scenario::{Pacing, Realtime};
use std::rc::Rc;
use std::time::Duration;

/// From the moment at which all processes are connected to tick 0.
const RUN_UP_NS: u64 = 20_000_000;

/// The clock and the counters of one process.
pub struct Timed {
    pace: Rc<Pace>,
    leads: bool,
    records: bool,
    rejoined: bool,
    first_tick: u64,
    asked: Vec<Attempt>,
    period: Latency,
    wake: Latency,
    last_begin_ns: u64,
    began_cpu_s: f64,
    tick: u64,
    late_ticks: u64,
    left_out_ticks: u64,
    row: u64,
    longest_row: u64,
}

/// The pace of a process before the start is agreed.
pub fn pace(realtime: &Realtime, nodes: &[NodeId], tick_s: f64) -> Rc<Pace> {
    let leads = nodes.contains(&NodeId::Plant);
    let follows_tokens = realtime.pace == Pacing::PacedByMeasurement && !leads;
    let pace = Pace::new(nodes, Duration::from_secs_f64(tick_s), follows_tokens);
    Rc::new(pace.polling(realtime.busy_wait))
}

/// Time that the CPUs have spent on this process, s.
pub fn cpu_s() -> f64 {
    let spent = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    spent.tv_sec as f64 + 1e-9 * spent.tv_nsec as f64
}

impl Timed {
    /// Agrees with the other processes when tick 0 begins; `leader` is the process that has the plant.
    ///
    /// # Errors
    /// If the leader does not say when.
    pub fn begin(
        pace: Rc<Pace>,
        nodes: &[NodeId],
        shared: Option<(&SharedContext, &str)>,
        rejoins: bool,
        asked: Vec<Attempt>,
    ) -> Result<Self, LinkError> {
        let leads = nodes.contains(&NodeId::Plant);
        let epoch_ns = match shared {
            Some((context, leader)) if !leads => context.epoch_of(leader)?,
            _ => monotonic_ns() + RUN_UP_NS,
        };
        if let Some((context, _)) = shared.filter(|_| leads) {
            context.set_epoch(epoch_ns);
        }
        pace.anchor(0, epoch_ns);
        let mut first_tick = 0;
        if let Some((context, leader)) = shared.filter(|_| rejoins) {
            // A hardware clock need not have kept our period: what the leader says is never ahead of it.
            first_tick = context.tick_of(leader).unwrap_or_default();
            if pace.follows_tokens() {
                pace.anchor(first_tick, monotonic_ns());
            } else {
                first_tick = pace.present(first_tick);
            }
        }
        Ok(Self {
            pace,
            leads,
            records: nodes == [NodeId::Recorder],
            rejoined: rejoins,
            first_tick,
            asked,
            period: Latency::new(),
            wake: Latency::new(),
            last_begin_ns: 0,
            began_cpu_s: cpu_s(),
            tick: first_tick,
            late_ticks: 0,
            left_out_ticks: 0,
            row: 0,
            longest_row: 0,
        })
    }

    /// This process takes the place of one that died.
    pub fn rejoined(&self) -> bool {
        self.rejoined
    }

    /// The tick that this process begins with.
    pub fn first_tick(&self) -> u64 {
        self.first_tick
    }

    /// Waits until the work of `next` may begin; gives the tick to turn to, later than `next` if time has passed by.
    pub fn turn_to(&mut self, next: u64) -> u64 {
        self.tick = next;
        if self.leads {
            let woken_ns = self.pace.sleep_until_start(next);
            self.wake.record(woken_ns.saturating_sub(self.pace.start_ns(next)));
            self.note_begin(woken_ns);
            return next;
        }
        if self.records {
            return next;
        }
        let tick = self.pace.present(next);
        self.left_out_ticks += tick - next;
        self.row += tick - next;
        tick
    }

    /// Counts what a tick has come to.
    pub fn finish(&mut self) {
        let now_ns = monotonic_ns();
        if !self.leads {
            self.note_begin(now_ns);
        }
        let overran = self.leads && now_ns > self.pace.start_ns(self.tick + 1);
        if self.pace.take_late() > 0 || overran {
            self.late_ticks += 1;
            self.row += 1;
        } else {
            self.row = 0;
        }
        self.longest_row = self.longest_row.max(self.row);
    }

    fn note_begin(&mut self, now_ns: u64) {
        if self.last_begin_ns > 0 {
            self.period.record(now_ns.saturating_sub(self.last_begin_ns));
        }
        self.last_begin_ns = now_ns;
    }

    /// What was counted; `round` comes from the recorder's node.
    pub fn report(self, round: Option<&Latency>) -> RealtimeReport {
        RealtimeReport {
            asked: self.asked,
            first_tick: self.first_tick,
            period: Distribution::from(&self.period),
            wake: self.leads.then(|| Distribution::from(&self.wake)),
            round: round.map(Distribution::from),
            late_ticks: self.late_ticks,
            left_out_ticks: self.left_out_ticks,
            longest_row: self.longest_row,
            undelivered: self.pace.undelivered(),
            cpu_s: cpu_s() - self.began_cpu_s,
        }
    }
}
