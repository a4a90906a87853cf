//! Runs a node of a real-time run again: every tick gets exactly the tokens that the node consumed, and what it answers is
//! compared with what it sent. A node that was started again begins anew where its process did.

use crate::error::RunError;
use crate::folder::RunFolder;
use anhyst_ipc::{
    Channel, CoilField, Connections, Demand, Discipline, Estimate, FieldCommand, Measurement, Message, NodeId,
    RecordLayout, SafeField, Sender, Stage, TokenLogFile, Truth,
};
use anhyst_scenario::Scenario;
use serde::Serialize;
use std::collections::BTreeMap;

/// How one node's replay came out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replayed {
    /// Which node.
    pub node: NodeId,
    /// Ticks compared.
    pub ticks: u64,
    /// True if every bit is the same.
    pub same: bool,
    /// The first tick, channel and field that differ.
    pub difference: Option<String>,
}

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

/// The token of tick `sent` that the node with this log consumed in `tick`.
fn consumed<M: Message>(tick: u64, sent: u64, own: &TokenLogFile, logs: &Logs) -> Result<M, RunError> {
    own.consumed(tick).map_or_else(|| logs.token(sent), Ok)
}

/// A node on the bench: its stage, and a sender for each of its inputs.
struct Bench {
    connections: Connections,
    stage: Box<dyn Stage>,
    measurement: Sender<Measurement>,
    truth: Sender<Truth>,
    estimate: Sender<Estimate>,
    demand: Sender<Demand>,
    field_command: Sender<FieldCommand>,
    safe_field: Sender<SafeField>,
    coil_field: Sender<CoilField>,
}

impl Bench {
    fn open(node: NodeId, scenario: &Scenario) -> Result<Self, RunError> {
        let mut connections =
            Connections::new(NodeId::LOOP_ORDER, anhyst_scenario::wires(), None).with_discipline(Discipline::AsFed);
        Ok(Self {
            stage: crate::assemble::stage(node, scenario, &mut connections)?,
            measurement: connections.sender()?,
            truth: connections.sender()?,
            estimate: connections.sender()?,
            demand: connections.sender()?,
            field_command: connections.sender()?,
            safe_field: connections.sender()?,
            coil_field: connections.sender()?,
            connections,
        })
    }

    /// Gives the node the token that it consumed on `channel` in `tick`: of its sender's log, or of its own if that has none.
    fn feed(
        &mut self,
        channel: Channel,
        tick: u64,
        sent: u64,
        own: &TokenLogFile,
        logs: &Logs,
    ) -> Result<(), RunError> {
        match channel {
            Channel::Measurement => self.measurement.send(consumed(tick, sent, own, logs)?)?,
            Channel::Truth => self.truth.send(consumed(tick, sent, own, logs)?)?,
            Channel::Estimate => self.estimate.send(consumed(tick, sent, own, logs)?)?,
            Channel::Demand => self.demand.send(consumed(tick, sent, own, logs)?)?,
            Channel::FieldCommand => self.field_command.send(consumed(tick, sent, own, logs)?)?,
            Channel::SafeField => self.safe_field.send(consumed(tick, sent, own, logs)?)?,
            Channel::CoilField => self.coil_field.send(consumed(tick, sent, own, logs)?)?,
        }
        Ok(())
    }

    fn difference(&mut self, channel: Channel, tick: u64, logs: &Logs) -> Result<Option<String>, RunError> {
        let connections = &mut self.connections;
        Ok(match channel {
            Channel::Measurement => differ(connections.last::<Measurement>(), logs.token(tick)?),
            Channel::Truth => differ(connections.last::<Truth>(), logs.token(tick)?),
            Channel::Estimate => differ(connections.last::<Estimate>(), logs.token(tick)?),
            Channel::Demand => differ(connections.last::<Demand>(), logs.token(tick)?),
            Channel::FieldCommand => differ(connections.last::<FieldCommand>(), logs.token(tick)?),
            Channel::SafeField => differ(connections.last::<SafeField>(), logs.token(tick)?),
            Channel::CoilField => differ(connections.last::<CoilField>(), logs.token(tick)?),
        })
    }
}

/// The first field in which what was sent differs from what was logged, in words.
fn differ<M: Message>(sent: Option<M>, logged: M) -> Option<String> {
    let sent = sent.unwrap_or_default();
    let (mut now, mut then) = ([0; anhyst_ipc::MAX_FIELDS], [0; anhyst_ipc::MAX_FIELDS]);
    sent.write_words(&mut now);
    logged.write_words(&mut then);
    let index = (0..M::FIELDS.len()).find(|index| now[*index] != then[*index])?;
    let (field, channel, tick) = (M::FIELDS[index].name, M::CHANNEL, logged.tick());
    Some(format!(
        "tick {tick}, {field} of {channel}: {logged:?} recorded, {sent:?} replayed"
    ))
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
    let mut bench = Bench::open(node, scenario)?;
    let mut start_number = None;
    let mut ticks = 0;
    for record in (0..log.ticks()).filter_map(|tick| log.followed(tick)) {
        if start_number
            .replace(record.start_number)
            .is_some_and(|before| before != record.start_number)
        {
            bench = Bench::open(node, scenario)?;
        }
        for (channel, consumed) in layout.inputs.iter().zip(&record.consumed) {
            if let Some(consumed) = consumed {
                bench.feed(*channel, record.tick, *consumed, log, logs)?;
            }
        }
        if !record.answered {
            bench.stage.follow(record.tick)?;
            continue;
        }
        bench.stage.tick(record.tick)?;
        for channel in &layout.outputs {
            let difference = bench.difference(*channel, record.tick, logs)?;
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
