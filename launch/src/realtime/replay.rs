//! Runs a node of a real-time run again: every tick gets exactly the tokens that the node consumed, and what it answers is
//! compared with what it sent. A node that was started again begins anew where its process did.

use crate::error::RunError;
use crate::folder::RunFolder;
use crate::run_again::{NodeAgain, Replayed, Tokens};
use anhyst_ipc::{Discipline, Message, NodeId, RecordLayout, TokenLogFile};
use anhyst_scenario::Scenario;
use std::collections::BTreeMap;

/// The token logs of a run.
pub struct Logs(BTreeMap<NodeId, TokenLogFile>);

impl Logs {
    /// Opens the logs of all nodes.
    ///
    /// # Errors
    /// If one is missing or cut off.
    pub fn open(folder: &RunFolder) -> Result<Self, RunError> {
        Self::open_but(folder, &[])
    }

    /// Opens the logs of all nodes but the `foreign` ones, which keep none.
    ///
    /// # Errors
    /// As [`Logs::open`].
    pub fn open_but(folder: &RunFolder, foreign: &[NodeId]) -> Result<Self, RunError> {
        let wires = anhyst_scenario::wires();
        let keeps = |node: &NodeId| *node != NodeId::Recorder && !foreign.contains(node);
        let nodes = NodeId::LOOP_ORDER.into_iter().filter(keeps);
        let logs = nodes.map(|node| -> Result<_, RunError> {
            let layout = RecordLayout::of(node, &wires).with_copies_of(foreign);
            let log = TokenLogFile::open(&folder.tokens(node.name()), layout)?;
            Ok((node, log))
        });
        Ok(Self(logs.collect::<Result<_, RunError>>()?))
    }

    /// The log of a node.
    ///
    /// # Errors
    /// If the node has none.
    pub fn of(&self, node: NodeId) -> Result<&TokenLogFile, RunError> {
        let found = self.0.get(&node);
        found.ok_or_else(|| RunError::Setup(format!("{node} has no token log")))
    }

    fn token<M: Message>(&self, tick: u64) -> Result<M, RunError> {
        let log = self.of(M::CHANNEL.producer())?;
        log.token(tick).ok_or_else(|| {
            let (channel, path) = (M::CHANNEL, log.path().display());
            RunError::Setup(format!("{channel} of tick {tick} was consumed but is not in {path}"))
        })
    }
}

/// The token that the node with this log consumed in a tick: of its sender's log, or of its own if that has none.
struct Consumed<'a> {
    tick: u64,
    sent: u64,
    own: &'a TokenLogFile,
    logs: &'a Logs,
}

impl Tokens for Consumed<'_> {
    fn token<M: Message>(&self) -> Result<M, RunError> {
        self.own
            .consumed(self.tick)
            .map_or_else(|| self.logs.token(self.sent), Ok)
    }
}

/// What was sent in a tick.
struct Sent<'a>(u64, &'a Logs);

impl Tokens for Sent<'_> {
    fn token<M: Message>(&self) -> Result<M, RunError> {
        self.1.token(self.0)
    }
}

/// Runs one node again.
///
/// # Errors
/// If a log is incomplete or the node cannot be built.
pub fn replay(node: NodeId, scenario: &Scenario, logs: &Logs) -> Result<Replayed, RunError> {
    if !crate::assemble::late_channels(scenario)?.is_empty() {
        let sentence =
            "a fault of this run gave tokens the ticks of others, and a token log tells tokens apart by their ticks";
        return Err(RunError::Setup(format!(
            "{sentence}: such a run can be replayed in lockstep only"
        )));
    }
    let log = logs.of(node)?;
    let layout = log.layout();
    let mut again = NodeAgain::new(node, scenario, Discipline::AsFed)?;
    let mut start_number = None;
    let mut ticks = 0;
    for record in (0..log.ticks()).filter_map(|tick| log.followed(tick)) {
        if start_number
            .replace(record.start_number)
            .is_some_and(|before| before != record.start_number)
        {
            again = NodeAgain::new(node, scenario, Discipline::AsFed)?;
        }
        for (channel, consumed) in layout.inputs.iter().zip(&record.consumed) {
            if let Some(consumed) = consumed {
                let (tick, sent) = (record.tick, *consumed);
                let consumed = Consumed {
                    tick,
                    sent,
                    own: log,
                    logs,
                };
                again.feed(*channel, &consumed)?;
            }
        }
        if !record.answered {
            again.stage.follow(record.tick)?;
            continue;
        }
        again.stage.tick(record.tick)?;
        for channel in &layout.outputs {
            let difference = again.difference(*channel, record.tick, &Sent(record.tick, logs))?;
            if difference.is_some() {
                return Ok(Replayed {
                    node,
                    ticks,
                    same: false,
                    difference,
                });
            }
        }
        ticks += 1;
    }
    Ok(Replayed {
        node,
        ticks,
        same: true,
        difference: None,
    })
}
