//! Gathers what is known of the processes of a run, and waits until that is all there will be to know.

use super::root_cause::{Fault, Inquiry, Witness};
use super::running::Running;
use super::{LaunchError, restart};
use crate::across::BRIDGE;
use crate::folder::RunFolder;
use crate::supervisor::LOOK_PERIOD;
use anhyst_ipc::{NodeId, Observer, stop_requested};
use anhyst_scenario::Scenario;
use std::time::{Duration, Instant};

/// A signal that ends a whole group reaches the launcher and its children within this.
const SAME_SIGNAL: Duration = Duration::from_millis(50);
/// What a process of ours that neither waits nor ends gets, beyond the limit to which others wait, before it counts as hung.
const SUSPICION: Duration = Duration::from_millis(1200);

/// Of this part of a run.
pub(super) struct Evidence<'a> {
    pub scenario: &'a Scenario,
    pub folder: &'a RunFolder,
    /// Its processes and their nodes.
    pub parts: &'a [(String, Vec<NodeId>)],
}

impl Evidence<'_> {
    /// True if a user's command has ended well, and all that still run wait for somebody: they would wait for ever.
    pub fn somebody_left(&self, children: &[Running], observer: Option<&mut Observer>) -> bool {
        let left = |running: &Running| running.foreign && running.child.end().is_some();
        let goes_on = |running: &Running| !running.foreign && running.child.end().is_none();
        children.iter().any(left) && children.iter().any(goes_on) && {
            let witnesses = self.witnesses(children, observer);
            Inquiry { witnesses: &witnesses }.is_at_rest()
        }
    }

    /// What is known of every process of this part of the run.
    fn witnesses(&self, children: &[Running], mut observer: Option<&mut Observer>) -> Vec<Witness> {
        let bridge = children.iter().find(|running| running.name == BRIDGE);
        let bridge = bridge.map(|running| (running.name.clone(), Vec::new()));
        let all = self.parts.iter().cloned().chain(bridge);
        all.map(|(name, nodes)| {
            let running = children.iter().find(|running| running.name == name);
            let failure = running.filter(|running| !restart::may_come_back(self.scenario, running));
            Witness {
                is_ours: running.is_some_and(|running| !running.foreign),
                state: running.map(|running| running.child.state()),
                failure: failure.and_then(|running| running.failure.clone()),
                standing: observer.as_mut().and_then(|observer| observer.standing_of(&name)),
                name,
                nodes,
            }
        })
        .collect()
    }

    /// Waits until all that is to be known is known, and names the one that made the run fail. Nothing more comes once all that
    /// still run wait for somebody; only one that hangs is waited for in vain, for as long as anybody would wait.
    pub fn inquire(&self, children: &mut [Running], mut observer: Option<&mut Observer>, tick: u64) -> LaunchError {
        let ticks = self.scenario.ticks();
        let patience = match self.scenario.clock.realtime() {
            None => Duration::from_secs_f64(self.scenario.clock.receive_limit_s()) + SUSPICION,
            // There nobody waits.
            Some(_) => SAME_SIGNAL,
        };
        let mut known = Vec::new();
        let mut since = Instant::now();
        let (cause, witnesses) = loop {
            let witnesses = self.witnesses(children, observer.as_deref_mut());
            let inquiry = Inquiry { witnesses: &witnesses };
            let cause = inquiry.root_cause();
            let is_certain = cause.as_ref().is_some_and(|cause| inquiry.is_certain(cause));
            if is_certain || inquiry.is_at_rest() || since.elapsed() > patience {
                break (cause, witnesses);
            }
            if known != witnesses {
                // It goes on.
                (known, since) = (witnesses, Instant::now());
            }
            std::thread::sleep(LOOK_PERIOD);
            children.iter_mut().for_each(Running::look);
        };
        if cause.as_ref().is_none_or(|cause| cause.fault == Fault::ToldToEnd) {
            std::thread::sleep(SAME_SIGNAL);
        }
        let Some(cause) = cause.filter(|_| !stop_requested()) else {
            return LaunchError::Interrupted { tick, ticks };
        };
        let process = witnesses[cause.process].name.clone();
        let running = children.iter().find(|running| running.name == process);
        let words = || last_words(self.folder, &process);
        let (how, detail) = match cause.fault {
            Fault::ToldToEnd => ("was told to end".into(), cause.sentence),
            Fault::WrongTick => ("sent a wrong tick".into(), cause.sentence),
            Fault::Stopped => ("does not answer".into(), "a signal has stopped it".into()),
            Fault::Hangs | Fault::Silent => ("does not answer".into(), cause.sentence),
            Fault::Failed | Fault::Noticed => ("failed".into(), cause.sentence),
            Fault::Ended => (
                running.map_or_else(|| "does not answer".into(), Running::how),
                if cause.sentence.is_empty() {
                    words()
                } else {
                    cause.sentence
                },
            ),
        };
        LaunchError::Died {
            process,
            how,
            when: if cause.tick.is_some() { "at" } else { "after" },
            tick: cause.tick.unwrap_or(tick),
            ticks,
            detail: if detail.is_empty() {
                detail
            } else {
                format!(": {detail}")
            },
        }
    }
}

/// What a user's program said last.
fn last_words(folder: &RunFolder, process: &str) -> String {
    let log = std::fs::read(folder.log(process)).unwrap_or_default();
    let log = String::from_utf8_lossy(&log);
    let last = log.lines().rfind(|line| !line.trim().is_empty());
    last.unwrap_or_default().trim().to_owned()
}
