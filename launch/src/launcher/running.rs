//! A process of a run as its launcher sees it.

use crate::realtime::Restart;
use crate::report::Failure;
use crate::supervisor::{State, Supervised};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// For how long a process has not gone on.
#[derive(Debug, Clone, Default)]
pub(super) struct Stillness {
    /// Where it stands.
    pub reached: Option<u64>,
    pub lasts: Duration,
    /// Too long: it was killed for it.
    pub hung: bool,
}

impl Stillness {
    /// How such a process has ended, in words.
    pub fn describe(&self) -> Option<String> {
        self.hung
            .then(|| format!("stood still for {:.1} s", self.lasts.as_secs_f64()))
    }
}

/// A process that was started, and what is known of it.
pub(super) struct Running {
    pub name: String,
    /// A user's command: it leaves no report.
    pub foreign: bool,
    pub child: Supervised,
    /// What it told that it failed of.
    pub failure: Option<Failure>,
    /// How earlier processes of this name ended.
    pub restarts: Vec<Restart>,
    /// Of the scenario's faults that stop it: for how long each, and when to wake it.
    pub stops: VecDeque<Duration>,
    pub wake_at: Option<Instant>,
    pub stillness: Stillness,
}

impl Running {
    /// Sees what it does and hears what it tells. Of what it fails of the first is the cause.
    pub fn look(&mut self) {
        self.child.look();
        let told = self.child.lines();
        let failure = told.iter().find_map(|line| Failure::heard(line));
        self.failure = self.failure.take().or(failure);
    }

    /// How it has ended, in words.
    pub fn how(&self) -> String {
        let end = || {
            self.child
                .end()
                .map_or_else(|| "does not answer".into(), |end| end.to_string())
        };
        self.stillness.describe().unwrap_or_else(end)
    }

    /// Wakes it when the time is over for which the scenario stops it. Others who stop it must wake it themselves.
    pub fn wake(&mut self) {
        if self.child.state() == State::Stopped && self.wake_at.is_none() {
            self.wake_at = self.stops.pop_front().map(|stop| Instant::now() + stop);
        }
        if self.wake_at.take_if(|at| *at <= Instant::now()).is_some() {
            self.child.signal(rustix::process::Signal::CONT);
        }
    }
}
