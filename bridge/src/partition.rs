//! The partition of a run: which processes are here, which are remote, and what crosses between them.

use crate::error::BridgeError;
use crate::settings::BridgeSettings;
use anhyst_ipc::{Channel, NodeId, crossing};

/// Processes by name, with their nodes.
pub type Processes = Vec<(String, Vec<NodeId>)>;

/// The two sides of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    /// Processes of this side.
    pub here: Processes,
    /// Processes of the other side.
    pub remote: Processes,
    /// Channels that leave this side, in the order in which a tick sends them.
    pub leaving: Vec<Channel>,
    /// Channels that come to this side, in the same order.
    pub coming: Vec<Channel>,
}

impl Partition {
    /// Of these settings.
    ///
    /// # Errors
    /// If a side would have no process, or a process nodes on both sides.
    pub fn new(settings: &BridgeSettings) -> Result<Self, BridgeError> {
        let is_here = |node: &NodeId| settings.here.contains(node);
        let mut here = Processes::new();
        let mut remote = Processes::new();
        for (name, nodes) in &settings.processes {
            match nodes.iter().filter(|node| is_here(node)).count() {
                0 => remote.push((name.clone(), nodes.clone())),
                count if count == nodes.len() => here.push((name.clone(), nodes.clone())),
                count => {
                    return Err(BridgeError::Setting(format!(
                        "the process {name} has {count} of its {} nodes here: a process runs on one side",
                        nodes.len()
                    )));
                }
            }
        }
        if here.is_empty() || remote.is_empty() {
            let side = if here.is_empty() { "this" } else { "the other" };
            return Err(BridgeError::Setting(format!("{side} side has no process of the run")));
        }
        let nodes = |processes: &Processes| {
            processes
                .iter()
                .flat_map(|(_, nodes)| nodes.clone())
                .collect::<Vec<_>>()
        };
        let channels = |from: &[NodeId], to: &[NodeId]| {
            let crossing = crossing(from, to, &settings.wires);
            crossing.into_iter().map(|(channel, _)| channel).collect::<Vec<_>>()
        };
        let (ours, theirs) = (nodes(&here), nodes(&remote));
        Ok(Self {
            leaving: channels(&ours, &theirs),
            coming: channels(&theirs, &ours),
            here,
            remote,
        })
    }

    /// The names of the other side's processes, for a sentence.
    pub fn remote_names(&self) -> String {
        let names: Vec<&str> = self.remote.iter().map(|(name, _)| name.as_str()).collect();
        names.join(", ")
    }
}
