//! Looking at a run from outside.

use super::iceoryx::create_node;
use super::status::{PeerStatus, Standing};
use crate::error::LinkError;
use iceoryx2::prelude::{Node, ipc};
use std::collections::BTreeMap;

/// Looks at the processes of a run without taking part: for progress bars, and for whoever must notice that one stands still.
pub struct Observer {
    /// By name, and by how many of that name there were before.
    peers: BTreeMap<(String, u64), PeerStatus>,
    node: Node<ipc::Service>,
}

impl Observer {
    /// Joins the run with this prefix and root as an onlooker.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn open(prefix: &str, root: &std::path::Path) -> Result<Self, LinkError> {
        Ok(Self {
            peers: BTreeMap::new(),
            node: create_node(prefix, root, "observer")?,
        })
    }

    /// The last finished tick of a process; `None` until it has started.
    pub fn tick_of(&mut self, process: &str) -> Option<u64> {
        self.tick_of_start(process, 0)
    }

    /// Where a process stands that started with the run; `None` until it has started.
    pub fn standing_of(&mut self, process: &str) -> Option<Standing> {
        self.peer(process, 0).map(PeerStatus::standing)
    }

    /// The last finished tick of whoever took the place of `process`, which was started again `restarts` times; `None` until
    /// one of them has started.
    pub fn tick_after(&mut self, process: &str, restarts: u64) -> Option<u64> {
        // Whoever comes takes the first number that is free again.
        (1..=restarts)
            .filter_map(|start| self.tick_of_start(process, start))
            .max()
    }

    /// Forgets what it knows of `process`: one that comes may take the number of one that died.
    pub fn forget(&mut self, process: &str) {
        self.peers.retain(|(known, _), _| known != process);
    }

    fn tick_of_start(&mut self, process: &str, start: u64) -> Option<u64> {
        self.peer(process, start).map(PeerStatus::tick)
    }

    fn peer(&mut self, process: &str, start: u64) -> Option<&PeerStatus> {
        let key = (process.to_owned(), start);
        if !self.peers.contains_key(&key) {
            let status = PeerStatus::open_start(&self.node, process, start).ok()??;
            self.peers.insert(key.clone(), status);
        }
        self.peers.get(&key)
    }
}
