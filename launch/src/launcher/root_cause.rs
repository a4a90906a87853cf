//! Who made a run fail: computed from what each process reports and from the order of ticks, not from who complains first.
//!
//! In lockstep every process waits for the token that it needs next. Who waits for whom is told by each process that gave up
//! ([`Failure`]) and, by those that still wait, on their status ([`Standing`]). Followed from process to process, the waiting
//! ends at one that waits for nobody: it has ended, was stopped, hangs, or failed by itself. Of several such the one counts
//! whose token is missing in the earliest tick.

use crate::report::{Cause, Failure};
use crate::supervisor::{End, State};
use anhyst_ipc::{LinkError, NodeId, Standing, TokenWait};

/// What is known of one process of the run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Witness {
    /// Its name.
    pub name: String,
    /// The nodes that it stands for.
    pub nodes: Vec<NodeId>,
    /// It says what it fails of; a user's program does not.
    pub is_ours: bool,
    /// None if somebody else has started it.
    pub state: Option<State>,
    /// What it says that it failed of.
    pub failure: Option<Failure>,
    /// None until it has appeared.
    pub standing: Option<Standing>,
}

/// What the process at fault did, the likelier culprit of two in the same tick first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Fault {
    /// Somebody told it to end.
    ToldToEnd,
    /// Its tokens bear wrong ticks.
    WrongTick,
    /// A signal has stopped it.
    Stopped,
    /// It failed by itself.
    Failed,
    /// One of ours that neither ends nor goes on.
    Hangs,
    /// It has ended, and does not say why.
    Ended,
    /// Another one's that is silent.
    Silent,
    /// It only noticed that somebody has gone.
    Noticed,
}

/// Who made the run fail.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RootCause {
    /// Which of the witnesses.
    pub process: usize,
    /// What it did.
    pub fault: Fault,
    /// In which tick: that of the token that is missing.
    pub tick: Option<u64>,
    /// What is said of it, by itself or by who waits for it.
    pub sentence: String,
}

/// That one waits for another, or has noticed that it has gone.
struct Edge {
    to: usize,
    tick: u64,
    sentence: String,
    /// What came bore a tick of the past, or of the future.
    is_wrong_tick: Option<bool>,
}

/// All that is known when a run has failed.
pub(super) struct Inquiry<'a> {
    pub witnesses: &'a [Witness],
}

impl Inquiry<'_> {
    /// True if nobody of ours will do or say anything any more before it gives up waiting.
    pub fn is_at_rest(&self) -> bool {
        (0..self.witnesses.len()).all(|index| {
            let witness = &self.witnesses[index];
            let rests = witness.failure.is_some() || !matches!(witness.state, Some(State::Runs));
            !witness.is_ours || rests || self.edge_of(index).is_some()
        })
    }

    /// True if nothing that may still be heard can change it.
    pub fn is_certain(&self, cause: &RootCause) -> bool {
        self.was_killed(cause.process) || cause.fault == Fault::ToldToEnd
    }

    /// Who made the run fail.
    pub fn root_cause(&self) -> Option<RootCause> {
        let by_themselves = |wanted: &dyn Fn(usize) -> bool| {
            let found = (0..self.witnesses.len()).filter(|index| wanted(*index));
            found.map(|process| self.own(process)).collect::<Vec<_>>()
        };
        let waited_for = (0..self.witnesses.len()).filter_map(|index| self.follow(index));
        let failed = by_themselves(&|index| self.has_failed(index));
        // Who only noticed that somebody has gone is no cause while there is another.
        let (noticed, causes): (Vec<_>, Vec<_>) = waited_for
            .chain(failed)
            .partition(|cause| cause.fault == Fault::Noticed);
        let first = |causes: Vec<RootCause>| {
            let order = |cause: &RootCause| (cause.tick.unwrap_or(u64::MAX), cause.fault);
            causes.into_iter().min_by_key(order)
        };
        first(by_themselves(&|index| self.was_killed(index)))
            .or_else(|| first(by_themselves(&|index| self.own(index).fault == Fault::ToldToEnd)))
            .or_else(|| first(causes))
            .or_else(|| first(noticed))
    }

    /// Where the waiting ends that begins with `from`; none if it waits for nobody.
    fn follow(&self, from: usize) -> Option<RootCause> {
        let mut edge = self.edge_of(from)?;
        let mut passed = vec![from];
        while !passed.contains(&edge.to) {
            passed.push(edge.to);
            let Some(next) = self.edge_of(edge.to) else { break };
            edge = next;
        }
        let own = self.own(edge.to);
        // What comes too early may be the last that one said who has gone.
        let is_wrong = edge
            .is_wrong_tick
            .is_some_and(|of_the_past| of_the_past || own.fault > Fault::Ended);
        if own.fault == Fault::Failed && !is_wrong {
            return Some(own);
        }
        let says_it_itself = own.fault == Fault::Ended && !is_wrong;
        Some(RootCause {
            process: edge.to,
            fault: if is_wrong { Fault::WrongTick } else { own.fault },
            tick: Some(edge.tick),
            sentence: if says_it_itself { own.sentence } else { edge.sentence },
        })
    }

    /// A process by itself, whoever may wait for it.
    fn own(&self, process: usize) -> RootCause {
        let witness = &self.witnesses[process];
        let fault = match (&witness.failure, witness.state) {
            (Some(failure), _) => match &failure.cause {
                Cause::Link(LinkError::Stopped { .. }) => Fault::ToldToEnd,
                Cause::Link(error) if is_notice(error) => Fault::Noticed,
                _ => Fault::Failed,
            },
            (None, Some(State::Stopped)) => Fault::Stopped,
            (None, Some(State::Ended(_))) => Fault::Ended,
            (None, Some(State::Runs)) if witness.is_ours => Fault::Hangs,
            (None, _) => Fault::Silent,
        };
        let failure = witness.failure.as_ref();
        // Another one's program may say only now and then where it is.
        let standing = || {
            witness
                .standing
                .filter(|_| witness.is_ours)
                .map(|standing| standing.tick)
        };
        RootCause {
            process,
            fault,
            tick: failure.map(|failure| failure.tick).or_else(standing),
            sentence: failure.map_or_else(String::new, |failure| failure.sentence.clone()),
        }
    }

    /// Whom a process waits for or misses; none if it could go on, or has ended for another reason.
    fn edge_of(&self, index: usize) -> Option<Edge> {
        let witness = &self.witnesses[index];
        if let Some(failure) = &witness.failure {
            return self.edge_of_failure(index, failure);
        }
        // What somebody else has started may have gone, and what it waited for last stands there for good.
        if witness.state != Some(State::Runs) {
            return None;
        }
        let standing = witness.standing?;
        self.waits_at_a_barrier(index, standing).or_else(|| {
            let wait = standing.wait?;
            let to = self.process_of(wait.channel.producer())?;
            let TokenWait { reader, channel, tick } = wait;
            (to != index && !self.has_sent(to, wait)).then(|| Edge {
                to,
                tick,
                sentence: format!(
                    "{reader} waits for {channel} of tick {tick}, but {} is silent",
                    channel.producer()
                ),
                is_wrong_tick: None,
            })
        })
    }

    fn edge_of_failure(&self, index: usize, failure: &Failure) -> Option<Edge> {
        let Cause::Link(error) = &failure.cause else {
            return None;
        };
        let edge = |to: Option<usize>, tick: u64, is_wrong_tick| {
            Some(Edge {
                to: to.filter(|to| *to != index)?,
                tick,
                sentence: failure.sentence.clone(),
                is_wrong_tick,
            })
        };
        match error {
            LinkError::Silent { channel, tick, .. } => edge(self.process_of(channel.producer()), *tick, None),
            LinkError::Gap {
                channel, expected, got, ..
            } => edge(self.process_of(channel.producer()), *expected, Some(got < expected)),
            LinkError::Absent { process, .. } | LinkError::Behind { process, .. } => {
                let named = self.witnesses.iter().position(|witness| witness.name == *process);
                edge(named, failure.tick, None)
            }
            LinkError::Undelivered { tick, .. } => edge(self.gone(index), *tick, None),
            LinkError::Transport { .. } => edge(self.gone(index), failure.tick, None),
            _ => None,
        }
    }

    /// At the start, and at the end, all wait for those that are not as far.
    fn waits_at_a_barrier(&self, index: usize, standing: Standing) -> Option<Edge> {
        // Whoever stands for another host's processes takes part in no rendezvous, and who has ended well has left the last.
        let has_left = |witness: &Witness| witness.is_ours && witness.state == Some(State::Ended(End::Status(0)));
        let takes_part = |witness: &&Witness| !witness.nodes.is_empty() && !has_left(witness);
        let phase_of = |witness: &Witness| witness.standing.map(|standing| standing.phase);
        let last = self.witnesses.iter().filter(takes_part).map(phase_of).min()?;
        if last >= Some(standing.phase) {
            return None;
        }
        let is_last = |witness: &Witness| takes_part(&witness) && phase_of(witness) == last;
        let to = self.witnesses.iter().position(is_last).filter(|to| *to != index)?;
        Some(Edge {
            to,
            tick: standing.tick,
            sentence: format!("{} waits for {}", self.witnesses[index].name, self.witnesses[to].name),
            is_wrong_tick: None,
        })
    }

    /// True if the token that somebody waits for has been sent: then that one only has not taken it yet.
    fn has_sent(&self, sender: usize, wanted: TokenWait) -> bool {
        let witness = &self.witnesses[sender];
        if let Some(failure) = &witness.failure {
            // On its way to the safe field it counts on; what one reader missed the others have got.
            let missed = match &failure.cause {
                Cause::Link(LinkError::Undelivered { channel, tick, .. }) => Some((*channel, *tick)),
                _ => None,
            };
            return wanted.tick < failure.tick || missed == Some((wanted.channel, wanted.tick));
        }
        let Some(standing) = witness.standing else { return false };
        // Within the tick the nodes of one process send in the order of the loop.
        let is_past = |wait: &TokenWait| wait.tick + 1 >= wanted.tick && wait.reader > wanted.channel.producer();
        wanted.tick < standing.tick || wanted.tick == standing.tick && standing.wait.as_ref().is_some_and(is_past)
    }

    /// Somebody who is not there any more, for one who only notices that: a user's program, or one that has failed.
    fn gone(&self, besides: usize) -> Option<usize> {
        let others = || (0..self.witnesses.len()).filter(|index| *index != besides);
        let is_foreign = |index: &usize| {
            let witness = &self.witnesses[*index];
            !witness.is_ours && !matches!(witness.state, Some(State::Runs | State::Stopped))
        };
        let failed = others().find(|index| self.own(*index).fault == Fault::Failed);
        failed.or_else(|| others().find(is_foreign))
    }

    /// The process that has a node; of a run in parts, the bridge stands for those of the other host.
    fn process_of(&self, node: NodeId) -> Option<usize> {
        let has_it = self.witnesses.iter().position(|witness| witness.nodes.contains(&node));
        has_it.or_else(|| self.witnesses.iter().position(|witness| witness.nodes.is_empty()))
    }

    fn was_killed(&self, index: usize) -> bool {
        let witness = &self.witnesses[index];
        match witness.state {
            Some(State::Ended(End::Signal(_))) => true,
            // The shell tells of its command's end by a signal.
            Some(State::Ended(End::Status(status))) => !witness.is_ours && (129..=192).contains(&status),
            _ => false,
        }
    }

    fn has_failed(&self, index: usize) -> bool {
        let witness = &self.witnesses[index];
        let ended = match witness.state {
            Some(State::Ended(End::Status(0))) => !witness.is_ours,
            Some(State::Ended(_)) => true,
            _ => false,
        };
        ended || witness.failure.is_some()
    }
}

/// Of an error that only tells that somebody else has gone, or is not heard.
fn is_notice(error: &LinkError) -> bool {
    matches!(
        error,
        LinkError::Silent { .. }
            | LinkError::Gap { .. }
            | LinkError::Absent { .. }
            | LinkError::Behind { .. }
            | LinkError::Undelivered { .. }
            | LinkError::Transport { .. }
    )
}

#[cfg(test)]
mod tests;
