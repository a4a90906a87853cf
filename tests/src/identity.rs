//! Compares the digests of two runs and names the first node and tick at which they differ.

use anhyst_ipc::{DigestHistory, NodeId};
use std::path::Path;

/// The first difference of two runs: the earliest tick, and of the nodes that differ there the first in loop order.
pub fn first_difference(one: &Path, other: &Path) -> Option<(NodeId, u64)> {
    NodeId::SENDERS
        .into_iter()
        .filter_map(|node| {
            digest_history(one, node)
                .first_difference(&digest_history(other, node))
                .map(|tick| (node, tick))
        })
        .min_by_key(|(node, tick)| (*tick, *node))
}

/// Fails, naming node and tick, unless two runs sent the same bits.
pub fn assert_same(one: &Path, other: &Path) {
    if let Some((node, tick)) = first_difference(one, other) {
        panic!(
            "{node} differs from tick {tick} on: {} against {}",
            one.display(),
            other.display()
        );
    }
}

/// A node's digests of a run; fails if there are none.
pub fn digest_history(run: &Path, node: NodeId) -> DigestHistory {
    let path = run.join("digests").join(format!("{}.u64", node.name()));
    match std::fs::read(&path) {
        Ok(bytes) if !bytes.is_empty() => DigestHistory::from_bytes(&bytes),
        other => panic!("{} holds no digests: {other:?}", path.display()),
    }
}
