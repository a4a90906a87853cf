//! A link, whichever transport carries it, and the connections of one process.

use crate::embedded::Cells;
use crate::shared::{SharedContext, SharedReceiver, SharedSender};
use crate::statistics::Latency;
use crate::wire::Wire;
use crate::{Channel, LinkError, LinkReport, Message, NodeId, monotonic_ns};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::rc::Rc;

/// What the nodes of one process are connected to.
pub struct Connections {
    local: BTreeSet<NodeId>,
    wires: Vec<Wire>,
    cells: Cells,
    shared: Option<Rc<SharedContext>>,
    any_tick: BTreeSet<Channel>,
}

impl Connections {
    /// Connections of a process that runs `local` nodes of a loop with these `wires`; `shared` reaches the other processes.
    pub fn new(local: impl IntoIterator<Item = NodeId>, wires: Vec<Wire>, shared: Option<Rc<SharedContext>>) -> Self {
        Self {
            local: local.into_iter().collect(),
            wires,
            cells: Cells::default(),
            shared,
            any_tick: BTreeSet::new(),
        }
    }

    /// On these channels a token of another tick than the one that is due is taken for what it is, not for a gap: an injected
    /// fault makes them late on purpose. The reader sees the token's age.
    pub fn accept_any_tick(&mut self, channels: impl IntoIterator<Item = Channel>) {
        self.any_tick.extend(channels);
    }

    /// Meets the other processes: all have opened their links, all connect (`connect` does it for this process's senders),
    /// and only then anyone sends. Without other processes it only connects.
    ///
    /// # Errors
    /// The process that does not come, or what `connect` says.
    pub fn meet(&self, connect: &mut dyn FnMut() -> Result<(), LinkError>) -> Result<(), LinkError> {
        let Some(shared) = &self.shared else { return connect() };
        shared.barrier(1)?;
        connect()?;
        shared.barrier(2)
    }

    /// Waits until all processes have come to the end: who left earlier could not be sent its last tokens.
    ///
    /// # Errors
    /// The process that does not come.
    pub fn part(&self) -> Result<(), LinkError> {
        self.shared.as_ref().map_or(Ok(()), |shared| shared.barrier(3))
    }

    /// Opens the reading end of `M`'s channel for `reader`, late by `delay` ticks.
    ///
    /// # Errors
    /// If the producer lives in another process and no transport is open, or iceoryx2 refuses.
    pub fn receiver<M: Message>(&mut self, reader: NodeId, delay: u64) -> Result<Receiver<M>, LinkError> {
        let source = if self.local.contains(&M::CHANNEL.producer()) {
            Source::Cell(self.cells.cell::<M>())
        } else {
            let shared = self.shared.as_ref().ok_or(LinkError::Unconnected {
                reader,
                channel: M::CHANNEL,
            })?;
            Source::Shared(SharedReceiver::open(shared, reader)?)
        };
        Ok(Receiver {
            source,
            reader,
            delay,
            any_tick: self.any_tick.contains(&M::CHANNEL),
            latency: Latency::new(),
        })
    }

    /// Opens the sending end of `M`'s channel, to every reader that the wiring names.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn sender<M: Message>(&mut self) -> Result<Sender<M>, LinkError> {
        let remote: Vec<NodeId> = self
            .wires
            .iter()
            .filter(|wire| wire.channel == M::CHANNEL && !self.local.contains(&wire.reader))
            .map(|wire| wire.reader)
            .collect();
        let shared = match &self.shared {
            Some(shared) if !remote.is_empty() => Some(SharedSender::open(shared, &remote)?),
            _ => None,
        };
        Ok(Sender {
            cell: self.cells.cell::<M>(),
            shared,
        })
    }
}

impl Connections {
    /// The token that was last sent on `M`'s channel within this process.
    pub fn last<M: Message>(&mut self) -> Option<M> {
        self.cells.cell::<M>().get()
    }
}

/// The sending end of a channel.
pub struct Sender<M: Message> {
    cell: Rc<Cell<Option<M>>>,
    shared: Option<SharedSender<M>>,
}

impl<M: Message> Sender<M> {
    /// Sends one token to every reader.
    ///
    /// # Errors
    /// If it reached fewer readers than are connected.
    pub fn send(&mut self, mut token: M) -> Result<(), LinkError> {
        if let Some(shared) = &mut self.shared {
            token.stamp(token.tick(), monotonic_ns());
            shared.send(token)?;
        }
        self.cell.set(Some(token));
        Ok(())
    }

    /// Connects to the readers that have appeared since the channel was opened.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn connect(&mut self) -> Result<(), LinkError> {
        self.shared.as_mut().map_or(Ok(()), SharedSender::connect)
    }
}

enum Source<M: Message> {
    Cell(Rc<Cell<Option<M>>>),
    Shared(SharedReceiver<M>),
}

/// The reading end of a channel.
pub struct Receiver<M: Message> {
    source: Source<M>,
    reader: NodeId,
    delay: u64,
    any_tick: bool,
    latency: Latency,
}

impl<M: Message> Receiver<M> {
    /// The token that is due at `tick`: of this tick, or of the tick before for a delayed reader (at tick 0 the default).
    ///
    /// # Errors
    /// If it does not come within the receive limit, if another one comes, or if the run is told to stop.
    pub fn receive(&mut self, tick: u64) -> Result<M, LinkError> {
        let Some(due) = tick.checked_sub(self.delay) else {
            return Ok(M::default());
        };
        let token = match &mut self.source {
            Source::Cell(cell) => cell.get().ok_or(LinkError::Unconnected {
                reader: self.reader,
                channel: M::CHANNEL,
            })?,
            Source::Shared(shared) => {
                let token = shared.receive(due)?;
                self.latency.record(monotonic_ns().saturating_sub(token.sent_ns()));
                token
            }
        };
        if token.tick() != due && !self.any_tick {
            return Err(LinkError::Gap {
                reader: self.reader,
                channel: M::CHANNEL,
                expected: due,
                got: token.tick(),
            });
        }
        Ok(token)
    }

    /// What the link measured.
    pub fn report(&self) -> LinkReport {
        LinkReport {
            channel: M::CHANNEL,
            reader: self.reader,
            latency: self.latency.summary(),
            lost: 0,
        }
    }
}

impl<M: Message> Receiver<M> {
    /// The next token, whatever its tick: for a reader that judges its producer. `due` is only named in the error.
    ///
    /// # Errors
    /// If none comes within the receive limit, or if the run is told to stop.
    pub fn receive_next(&mut self, due: u64) -> Result<M, LinkError> {
        match &mut self.source {
            Source::Cell(cell) => cell.take().ok_or(LinkError::Unconnected {
                reader: self.reader,
                channel: M::CHANNEL,
            }),
            Source::Shared(shared) => shared.receive(due),
        }
    }
}
