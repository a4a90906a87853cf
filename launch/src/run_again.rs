//! A node that runs again: it is fed what it consumed, and what it answers is compared with what it sent.

use crate::assemble::{late_channels, stage};
use crate::error::RunError;
use anhyst_ipc::{Channel, Connections, Discipline, MAX_FIELDS, Message, NodeId, Stage, with_message};
use anhyst_scenario::Scenario;
use serde::Serialize;

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

/// The tokens of one tick, as they were.
pub trait Tokens {
    /// The one of `M`'s channel.
    ///
    /// # Errors
    /// If it is not kept.
    fn token<M: Message>(&self) -> Result<M, RunError>;
}

/// A node without the others.
pub struct NodeAgain {
    connections: Connections,
    /// What steps.
    pub stage: Box<dyn Stage>,
}

impl NodeAgain {
    /// The node as it begins.
    ///
    /// # Errors
    /// If it cannot be built.
    pub fn new(node: NodeId, scenario: &Scenario, discipline: Discipline) -> Result<Self, RunError> {
        // All producers count as local, so that the node's inputs are cells that we fill.
        let connections = Connections::new(NodeId::LOOP_ORDER, anhyst_scenario::wires(), None);
        let mut connections = connections.with_discipline(discipline);
        connections.accept_any_tick(late_channels(scenario)?);
        Ok(Self {
            stage: stage(node, scenario, &mut connections)?,
            connections,
        })
    }

    /// Gives the node what it consumes on a channel.
    ///
    /// # Errors
    /// If it is not kept.
    pub fn feed(&mut self, channel: Channel, consumed: &impl Tokens) -> Result<(), RunError> {
        with_message!(channel, M => self.connections.feed::<M>(consumed.token()?));
        Ok(())
    }

    /// The first field on a channel in which what the node has answered in this tick differs from what it sent, in words.
    ///
    /// # Errors
    /// If that is not kept.
    pub fn difference(&mut self, channel: Channel, tick: u64, sent: &impl Tokens) -> Result<Option<String>, RunError> {
        let differing = with_message!(channel, M => {
            let (now, then) = (self.connections.last::<M>().unwrap_or_default(), sent.token::<M>()?);
            field_between(&now, &then).map(|field| format!("{field} of {channel}: {then:?} recorded, {now:?} replayed"))
        });
        Ok(differing.map(|differing| format!("tick {tick}, {differing}")))
    }
}

/// The first field in which they differ.
fn field_between<M: Message>(now: &M, then: &M) -> Option<&'static str> {
    let (mut new, mut old) = ([0; MAX_FIELDS], [0; MAX_FIELDS]);
    now.write_words(&mut new);
    then.write_words(&mut old);
    let mut fields = M::FIELDS.iter().zip(new.iter().zip(&old));
    fields.find(|(_, (new, old))| new != old).map(|(field, _)| field.name)
}
