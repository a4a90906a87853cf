use crate::message::{Channel, NodeId};

/// One arrow of the loop's graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wire {
    /// What travels.
    pub channel: Channel,
    /// Who reads.
    pub reader: NodeId,
    /// By how many ticks it is late.
    pub delay: u64,
}
