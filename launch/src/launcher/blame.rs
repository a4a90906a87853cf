//! Who is to blame when a process has failed: what all processes said last is followed to the one that has nothing to say.

use super::{LaunchError, Running, look, restart};
use crate::folder::RunFolder;
use anhyst_ipc::{Channel, stop_requested};
use anhyst_scenario::Scenario;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// What the others get to complain, too, when a process gives up waiting.
const SETTLING: Duration = Duration::from_millis(300);
/// What a process that neither ends nor complains gets to do so before it counts as hung: on a busy machine it may be late.
const SUSPICION: Duration = Duration::from_millis(1200);
/// A signal that ends a whole group reaches the launcher and its children within this.
const SAME_SIGNAL: Duration = Duration::from_millis(50);
/// How a process complains that has got a signal to end.
const TOLD_TO_END: &str = ": stopped on request";
/// How a process complains that only notices that another one has gone; it does not know which.
const NOTICES: [&str; 3] = [" readers", "tokens were lost", "iceoryx2 could not"];

/// Who is to blame.
enum Culprit<'a> {
    /// One that the launcher has started.
    Child(&'a Running),
    /// One that somebody else has started, and what another process says about it.
    Elsewhere(&'a str, String),
    /// An external one whose tokens bear wrong ticks, and who says so.
    OutOfStep(&'a str, String),
}

/// Whom a complaint names.
#[derive(Clone, Copy)]
enum Accused<'a> {
    Child(&'a Running),
    Elsewhere(&'a str),
}

/// What is known when a process has failed.
pub(super) struct Inquest<'a> {
    pub scenario: &'a Scenario,
    pub folder: &'a RunFolder,
    /// The external processes of this part of the run: those that are not among the children somebody else has started.
    pub external: &'a [String],
    pub tick: u64,
}

impl Inquest<'_> {
    /// Waits until the complaints are whole, and names the one to blame.
    pub fn hold(&self, children: &mut [Running]) -> LaunchError {
        let (tick, ticks) = (self.tick, self.scenario.ticks());
        if children.iter().any(|running| self.was_told_to_end(running)) {
            std::thread::sleep(SAME_SIGNAL);
            look(children);
        } else if !children.iter().any(Running::killed) {
            self.settle(children);
        }
        if stop_requested() {
            return LaunchError::Interrupted { tick, ticks };
        }
        let (process, how, detail) = match self.culprit(children) {
            None => return LaunchError::Interrupted { tick, ticks },
            Some(Culprit::Elsewhere(process, complaint)) => (process.to_owned(), describe(None), complaint),
            Some(Culprit::OutOfStep(process, complaint)) => (process.to_owned(), "sent a wrong tick".into(), complaint),
            Some(Culprit::Child(running)) => {
                let how = if self.was_told_to_end(running) {
                    "was told to end".into()
                } else {
                    running.how()
                };
                (running.name.clone(), how, self.words(running))
            }
        };
        LaunchError::Died {
            process,
            how,
            tick,
            ticks,
            detail,
        }
    }

    /// Whoever waits for the same culprit gives up within moments: then the chain of complaints is whole. A user's program may
    /// give up earlier than ours: before it is blamed, one of ours gets the time to say whom it waits for.
    fn settle(&self, children: &mut [Running]) {
        let patience = match self.scenario.clock.realtime() {
            // Before the loop runs nobody of ours waits for a token, and in real time nobody does.
            None if self.tick > 0 => Duration::from_secs_f64(self.scenario.clock.receive_limit_s()) + SUSPICION,
            _ => Duration::ZERO,
        };
        let begin = Instant::now();
        let mut suspected_since = None;
        loop {
            std::thread::sleep(SETTLING);
            look(children);
            let ours_are_silent = || {
                children
                    .iter()
                    .all(|running| running.foreign || self.words(running).is_empty())
            };
            match self.culprit(children) {
                Some(Culprit::Child(running)) if self.hangs(running) => {
                    let since: &mut Instant = suspected_since.get_or_insert_with(Instant::now);
                    if since.elapsed() > SUSPICION {
                        return;
                    }
                }
                Some(Culprit::Child(running)) if running.foreign && !running.killed() && ours_are_silent() => {
                    if begin.elapsed() > patience {
                        return;
                    }
                }
                _ => return,
            }
        }
    }

    /// In this order: one that a signal killed, or that somebody else told to end. One that hangs: the complaints "… but X is
    /// silent" are followed to the process that has none. One of ours that failed by itself. A user's program that has ended,
    /// which others only notice, one whose ticks are wrong, or one that ran elsewhere. Other complaints may only be
    /// consequences: a last token on the way to the safe field does not reach a reader that has given up.
    fn culprit<'a>(&'a self, children: &'a [Running]) -> Option<Culprit<'a>> {
        let one =
            |wanted: &dyn Fn(&Running) -> bool| children.iter().find(|running| wanted(running)).map(Culprit::Child);
        // Also of those that have not ended yet: who brings the field to safety has complained before.
        let ends = || {
            children
                .iter()
                .filter_map(|running| Some((running, self.last_accused(children, running)?)))
        };
        let hanging = || {
            ends().find_map(|(_, accused)| match accused {
                Accused::Child(running)
                    if self.hangs(running) || !running.foreign && self.words(running).is_empty() =>
                {
                    Some(Culprit::Child(running))
                }
                _ => None,
            })
        };
        let silent_elsewhere = || {
            ends().find_map(|(_, accused)| {
                let Accused::Elsewhere(name) = accused else { return None };
                let direct = |running: &&Running| {
                    matches!(self.accused_by(children, running), Some(Accused::Elsewhere(found)) if found == name)
                };
                let complaint = children.iter().find(direct).map(|running| self.words(running));
                Some(Culprit::Elsewhere(name, complaint.unwrap_or_default()))
            })
        };
        let notices = |running: &Running| {
            let words = self.words(running);
            !running.foreign && NOTICES.iter().any(|notice| words.contains(notice))
        };
        let accuses = |running: &Running| self.accused_by(children, running).is_some();
        let by_itself =
            |running: &Running| !running.foreign && running.failed() && !notices(running) && !accuses(running);
        let gone_elsewhere = || {
            let gone = self
                .external
                .iter()
                .find(|name| children.iter().all(|running| running.name != **name))?;
            let noticed = children.iter().find(|running| running.failed() && notices(running))?;
            Some(Culprit::Elsewhere(gone, self.words(noticed)))
        };
        let last_child = || {
            ends().find_map(|(_, accused)| match accused {
                Accused::Child(running) => Some(Culprit::Child(running)),
                Accused::Elsewhere(_) => None,
            })
        };
        one(&Running::killed)
            .or_else(|| one(&|running| self.was_told_to_end(running)))
            .or_else(hanging)
            .or_else(silent_elsewhere)
            .or_else(|| one(&by_itself))
            .or_else(|| one(&|running| running.foreign && running.ended.is_some()))
            .or_else(|| self.out_of_step(children))
            .or_else(gone_elsewhere)
            .or_else(last_child)
            .or_else(|| one(&Running::failed))
    }

    /// An external process of whose tokens another says that they bear ticks of the past; those of the future only tell that it,
    /// or whoever heard it, has gone.
    fn out_of_step(&self, children: &[Running]) -> Option<Culprit<'_>> {
        children.iter().find_map(|running| {
            let words = self.words(running);
            let (_, rest) = words.split_once(" expected ")?;
            let (channel, ticks) = rest.split_once(" of tick ")?;
            let mut ticks = ticks
                .split(", but tick ")
                .filter_map(|tick| tick.split(' ').next()?.parse::<u64>().ok());
            let (expected, got) = (ticks.next()?, ticks.next()?);
            if got > expected {
                return None;
            }
            let producer = Channel::ALL
                .into_iter()
                .find(|known| known.to_string() == channel)?
                .producer();
            let process = self.external.iter().find(|name| has_node(name, producer.name()))?;
            Some(Culprit::OutOfStep(process, words))
        })
    }

    /// True if one of ours was told to end, which the launcher has not done; not if it may come back.
    pub fn was_told_to_end(&self, running: &Running) -> bool {
        // One that took the place of another has the other's words before its own.
        let says_so_itself = running.failed() || running.ended.is_none() && running.restarts.is_empty();
        !running.foreign
            && says_so_itself
            && self.words(running).starts_with(TOLD_TO_END)
            && !restart::may_come_back(self.scenario, running)
    }

    /// As far as its own words go; a user's program may say what it likes.
    fn hangs(&self, running: &Running) -> bool {
        running.ended.is_none() && (running.foreign || self.words(running).is_empty())
    }

    /// Where the chain of complaints ends that begins with this one.
    fn last_accused<'a>(&'a self, children: &'a [Running], complainer: &Running) -> Option<Accused<'a>> {
        let mut last = self.accused_by(children, complainer)?;
        for _ in children {
            let Accused::Child(running) = last else { break };
            last = self.accused_by(children, running).unwrap_or(last);
        }
        Some(last)
    }

    fn accused_by<'a>(&'a self, children: &'a [Running], running: &Running) -> Option<Accused<'a>> {
        let words = self.words(running);
        let node = match words.strip_suffix(" is silent") {
            Some(rest) => rest.rsplit(' ').next()?,
            None => words.strip_prefix(": ")?.split_once(" did not come within")?.0,
        };
        let child = children.iter().find(|running| has_node(&running.name, node));
        let elsewhere = || self.external.iter().find(|name| has_node(name, node));
        child
            .map(Accused::Child)
            .or_else(|| elsewhere().map(|name| Accused::Elsewhere(name)))
    }

    fn words(&self, running: &Running) -> String {
        last_words(self.folder, &running.name)
    }
}

/// True if `node` names the process or one of its nodes.
fn has_node(process: &str, node: &str) -> bool {
    process == node || process.split('+').any(|name| name == node)
}

pub(super) fn describe(status: Option<ExitStatus>) -> String {
    use std::os::unix::process::ExitStatusExt;
    match status.map(|status| (status.code(), status.signal())) {
        Some((Some(code), _)) => format!("ended with exit status {code}"),
        Some((None, Some(signal))) => format!("was killed by signal {signal}"),
        _ => "does not answer".into(),
    }
}

fn last_words(folder: &RunFolder, process: &str) -> String {
    let log = std::fs::read_to_string(folder.log(process)).unwrap_or_default();
    // A refusal's sentence is marked; the picture below it is for the log.
    let sentence = log
        .lines()
        .find_map(|line| line.trim().strip_prefix('×'))
        .or_else(|| log.lines().rfind(|line| !line.trim().is_empty()));
    sentence.map(|line| format!(": {}", line.trim())).unwrap_or_default()
}
