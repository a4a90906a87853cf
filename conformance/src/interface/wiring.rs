//! Who reads what, as the documents say it.

use anhyst_ipc::{Channel, NodeId};

/// Who reads a channel: node and by how many ticks it is late, in loop order.
pub(super) fn readers(channel: &str) -> Vec<(NodeId, u64)> {
    let mut readers: Vec<(NodeId, u64)> = anhyst_scenario::wires()
        .into_iter()
        .filter(|wire| wire.channel.name() == channel)
        .map(|wire| (wire.reader, wire.delay))
        .collect();
    readers.sort();
    readers
}

/// What a node reads, in channel order.
pub(super) fn read_by(node: NodeId) -> Vec<Channel> {
    let wires = anhyst_scenario::wires().into_iter();
    let mut channels: Vec<Channel> = wires
        .filter(|wire| wire.reader == node)
        .map(|wire| wire.channel)
        .collect();
    channels.sort();
    channels
}
