//! A block with its links opened, its digest, and the faults that tests inject.

use crate::block::{Block, Inputs, Outputs, Seen};
use crate::change::Change;
use crate::digest::{Digest, DigestHistory};
use crate::error::LinkError;
use crate::fault::{Injector, TokenFault};
use crate::link::Connections;
use crate::message::{Channel, Message, NodeId};
use crate::statistics::LinkReport;
use crate::token_log::TokenLog;
use serde::{Deserialize, Serialize};

/// What one node reports when its run ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NodeReport {
    /// Who.
    pub node: NodeId,
    /// Ticks finished.
    pub ticks: u64,
    /// Digest of everything sent.
    pub digest: u64,
    /// Its reading links.
    pub links: Vec<LinkReport>,
    /// The field that it gave, or said to be in the coil, last; none from nodes that say nothing about it.
    #[serde(default)]
    pub field_a_per_m: Option<f64>,
    /// What its next run may begin with, as JSON.
    #[serde(default)]
    pub memory: Option<String>,
}

/// A node seen without its types: what a process runs, in loop order.
pub trait Stage {
    /// Who it is.
    fn node(&self) -> NodeId;
    /// Connects its senders to the readers that have appeared.
    ///
    /// # Errors
    /// If a transport refuses.
    fn connect(&mut self) -> Result<(), LinkError>;
    /// Receives, steps and sends tick `tick`.
    ///
    /// # Errors
    /// If a token is missing, wrong or cannot be delivered.
    fn tick(&mut self, tick: u64) -> Result<(), LinkError>;
    /// As [`Block::change`].
    fn change(&mut self, change: &Change) -> bool;
    /// Takes up what was said in tick `tick`, which the process left out, and sends nothing.
    ///
    /// # Errors
    /// If the run is told to stop.
    fn follow(&mut self, tick: u64) -> Result<(), LinkError>;
    /// Writes what is consumed and sent into `log` from now on.
    fn log_tokens(&mut self, _log: TokenLog) {}
    /// From here on a reader that is gone is no error: the run is ending, and whoever still listens is to hear.
    fn end(&mut self);
    /// Answers tick `tick` without hearing anybody, on the way to the safe state. False if there is nothing (more) to do.
    /// The digest does not note it.
    fn alone(&mut self, tick: u64) -> bool;
    /// The digest after every tick.
    fn digest_history(&self) -> &DigestHistory;
    /// What it measured.
    fn report(&self) -> NodeReport;
}

struct Watcher {
    digest: Digest,
    log: Option<TokenLog>,
    injector: Injector,
    /// Where the coil's field stands in what is sent, and its last value.
    field: Option<(Channel, usize)>,
    field_a_per_m: Option<f64>,
    /// Nobody is heard any more: the digest is closed.
    alone: bool,
}

impl Watcher {
    fn new<B: Block>() -> Self {
        let sent = B::Outputs::channels().into_iter().rev();
        let of_field = |channel: Channel| {
            let mut names = channel.fields().iter().map(|field| field.name);
            names.position(|name| name == "field_a_per_m" || name == "coil_field_a_per_m")
        };
        Self {
            digest: Digest::default(),
            log: None,
            injector: Injector::default(),
            field: sent
                .filter(|channel| matches!(channel.producer(), NodeId::Plant | NodeId::Guard | NodeId::Amplifier))
                .find_map(|channel| of_field(channel).map(|index| (channel, index))),
            field_a_per_m: None,
            alone: false,
        }
    }
}

impl Seen for Watcher {
    #[inline]
    fn see<M: Message>(&mut self, tick: u64, token: &mut M) {
        token.stamp(tick, 0);
        if !self.alone {
            if self.injector.is_armed() {
                self.injector.see(token);
            }
            self.digest.add_token(token);
            if let Some(log) = &mut self.log {
                log.add(token.field_words());
            }
        }
        if let Some((of, index)) = self.field
            && of == M::CHANNEL
        {
            self.field_a_per_m = token.field_words().get(index).map(|word| f64::from_bits(*word));
        }
    }
}

/// A block in the loop.
pub struct Node<B: Block> {
    block: B,
    receivers: <B::Inputs as Inputs>::Receivers,
    senders: <B::Outputs as Outputs>::Senders,
    watcher: Watcher,
    digest_history: DigestHistory,
    ticks: u64,
    ending: bool,
}

impl<B: Block> Node<B> {
    /// Opens the block's links. `ticks` is the length of the run: room for the digests is taken now.
    ///
    /// # Errors
    /// If a link cannot be opened.
    pub fn open(block: B, connections: &mut Connections, ticks: u64) -> Result<Self, LinkError> {
        Ok(Self {
            receivers: B::Inputs::open(B::NODE, connections)?,
            senders: B::Outputs::open(connections)?,
            watcher: Watcher::new::<B>(),
            digest_history: DigestHistory::with_capacity(ticks as usize),
            block,
            ticks: 0,
            ending: false,
        })
    }

    /// The block, with what it has gathered so far.
    pub fn block(&self) -> &B {
        &self.block
    }

    /// Lets these faults happen to what the node sends; those of other nodes' channels are left out. `seed` is of their noise.
    #[must_use]
    pub fn with_faults(mut self, faults: &[TokenFault], seed: u64) -> Self {
        let sent = <B::Outputs as Outputs>::channels();
        self.watcher.injector = Injector::new(faults.iter().filter(|fault| sent.contains(&fault.channel)), seed);
        self
    }

    /// Closes the links and gives the block back, with what it has gathered.
    pub fn into_block(self) -> B {
        self.block
    }
}

impl<B: Block> Node<B> {
    /// Steps the block and sends what it answers.
    #[inline(always)]
    fn step(&mut self, tick: u64, inputs: B::Inputs) -> Result<(), LinkError> {
        if let Some(log) = &mut self.watcher.log {
            log.begin(tick);
            B::Inputs::taken(&self.receivers, &mut |taken, fields| log.consume(taken, fields));
        }
        let outputs = self.block.step(tick, inputs);
        let sent = if self.ending && B::NODE == NodeId::Plant {
            // What a plant still measured would let the others go on cutting: silence makes the guard take the field away.
            outputs.show(tick, &mut self.watcher);
            Ok(())
        } else {
            outputs.send(&mut self.senders, tick, &mut self.watcher)
        };
        self.digest_history.note(tick, self.watcher.digest);
        self.ticks = tick + 1;
        if self.ending { Ok(()) } else { sent }
    }

    #[inline(never)]
    fn tick_when_here(&mut self, tick: u64) -> Result<(), LinkError> {
        let inputs = B::Inputs::receive(&mut self.receivers, tick)?;
        self.step(tick, inputs)
    }
}

impl<B: Block> Stage for Node<B> {
    fn node(&self) -> NodeId {
        B::NODE
    }

    fn connect(&mut self) -> Result<(), LinkError> {
        <B::Outputs as Outputs>::connect(&mut self.senders)
    }

    fn tick(&mut self, tick: u64) -> Result<(), LinkError> {
        // Apart: tokens that lie here are copied once, without the errors of those that come.
        if B::Inputs::are_here(&self.receivers, tick) {
            let inputs = B::Inputs::here(&self.receivers);
            return self.step(tick, inputs);
        }
        self.tick_when_here(tick)
    }

    fn change(&mut self, change: &Change) -> bool {
        self.block.change(change)
    }

    fn follow(&mut self, tick: u64) -> Result<(), LinkError> {
        let inputs = B::Inputs::receive_left_out(&mut self.receivers, tick)?;
        if let Some(log) = &mut self.watcher.log {
            log.begin(tick);
            B::Inputs::taken(&self.receivers, &mut |taken, fields| log.consume(taken, fields));
            log.end_unanswered();
        }
        self.block.follow(tick, inputs);
        Ok(())
    }

    fn end(&mut self) {
        self.ending = true;
    }

    fn alone(&mut self, tick: u64) -> bool {
        let Some(outputs) = self.block.alone(tick) else {
            return false;
        };
        self.watcher.alone = true;
        // Whoever is gone cannot be reached; whoever still listens is.
        let _ = outputs.send(&mut self.senders, tick, &mut self.watcher);
        self.ticks = tick + 1;
        true
    }

    fn log_tokens(&mut self, log: TokenLog) {
        self.watcher.log = Some(log);
    }

    fn digest_history(&self) -> &DigestHistory {
        &self.digest_history
    }

    fn report(&self) -> NodeReport {
        NodeReport {
            node: B::NODE,
            ticks: self.ticks,
            digest: self.watcher.digest.0,
            links: B::Inputs::reports(&self.receivers),
            field_a_per_m: self.watcher.field_a_per_m,
            memory: self.block.memory(),
        }
    }
}
