//! What the recorder notes of a node that another program runs and that leaves no report: the digest of what it sent, the
//! same that a node of ours keeps of itself.

use crate::folder::RunFolder;
use anhyst_ipc::{Digest, DigestHistory, Everything, MAX_FIELDS, Message, NodeId, NodeReport, Now};

/// One foreign node, as heard.
pub struct Overheard {
    node: NodeId,
    digest: Digest,
    digest_history: DigestHistory,
}

impl Overheard {
    /// Room for a run of `ticks` ticks.
    pub fn new(node: NodeId, ticks: u64) -> Self {
        Self {
            node,
            digest: Digest::default(),
            digest_history: DigestHistory::with_capacity(ticks as usize),
        }
    }

    /// Adds what the node sent in `tick`, in the order in which it sends.
    pub fn hear(&mut self, tick: u64, inputs: &Everything) {
        let (Now(measurement), Now(truth), Now(estimate), Now(demand), Now(command), Now(safe), Now(coil)) = inputs;
        self.add(tick, measurement);
        self.add(tick, truth);
        self.add(tick, estimate);
        self.add(tick, demand);
        self.add(tick, command);
        self.add(tick, safe);
        self.add(tick, coil);
        self.digest_history.push(self.digest);
    }

    fn add<M: Message>(&mut self, tick: u64, token: &M) {
        if M::CHANNEL.producer() == self.node {
            let mut words = [0; MAX_FIELDS];
            token.write_words(&mut words);
            self.digest.add(tick, &words[..M::FIELDS.len()]);
        }
    }

    /// The report that the node itself would have left, without latencies.
    pub fn report(&self) -> NodeReport {
        NodeReport {
            node: self.node,
            ticks: self.digest_history.len() as u64,
            digest: self.digest.0,
            field_a_per_m: None,
            links: Vec::new(),
            memory: None,
        }
    }

    /// Writes the digests after every tick.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, folder: &RunFolder) -> std::io::Result<()> {
        self.digest_history.write(&folder.digest_history(self.node.name()))
    }
}
