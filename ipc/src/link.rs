//! A link, whichever transport carries it, and the connections of one process.

use crate::clock::monotonic_ns;
use crate::embedded::{Cells, Slot};
use crate::error::LinkError;
use crate::message::{Channel, Message, NodeId};
use crate::newest::{Newest, noted};
use crate::pace::Pace;
use crate::raw::RawToken;
use crate::shared::{RawReceiver, RawSender, SharedContext};
use crate::statistics::{Latency, LinkReport};
use crate::wire::Wire;
use std::collections::BTreeSet;
use std::rc::Rc;

/// Which token a reader takes.
#[derive(Debug, Clone, Default)]
pub enum Discipline {
    /// The token that is due, waited for; anything else is an error.
    #[default]
    Lockstep,
    /// The newest that is not newer than the tick, waited for until the reader's time-out.
    Newest(Rc<Pace>),
    /// What was put into the channel's cell last, whatever its tick; the default token before. For replaying what was consumed.
    AsFed,
}

/// What the nodes of one process are connected to.
pub struct Connections {
    local: BTreeSet<NodeId>,
    wires: Vec<Wire>,
    cells: Cells,
    shared: Option<Rc<SharedContext>>,
    discipline: Discipline,
    any_tick: BTreeSet<Channel>,
    /// In real time: these senders are not watched by anybody else, and silent so many ticks they end the run.
    watched: (Vec<NodeId>, u64),
}

impl Connections {
    /// Connections of a process that runs `local` nodes of a loop with these `wires`; `shared` reaches the other processes.
    pub fn new(local: impl IntoIterator<Item = NodeId>, wires: Vec<Wire>, shared: Option<Rc<SharedContext>>) -> Self {
        Self {
            local: local.into_iter().collect(),
            wires,
            cells: Cells::default(),
            shared,
            discipline: Discipline::Lockstep,
            any_tick: BTreeSet::new(),
            watched: (Vec::new(), 0),
        }
    }

    /// The same with another discipline for the readers that are opened from now on.
    #[must_use]
    pub fn with_discipline(self, discipline: Discipline) -> Self {
        Self { discipline, ..self }
    }

    /// On these channels a token of another tick than the one that is due is taken for what it is, not for a gap: an injected
    /// fault makes them late on purpose. The reader sees the token's age. In real time a reader takes what is newest anyway.
    pub fn accept_any_tick(&mut self, channels: impl IntoIterator<Item = Channel>) {
        self.any_tick.extend(channels);
    }

    /// In real time a token that does not come is no error: the older one is taken. But a foreign process may die or hang
    /// unseen: whoever reads from one of these `senders` ends when it has been silent for more than `limit_ticks`.
    pub fn end_if_silent(&mut self, senders: Vec<NodeId>, limit_ticks: u64) {
        self.watched = (senders, limit_ticks);
    }

    /// As [`SharedContext::start_barriers`]; without other processes it only connects.
    ///
    /// # Errors
    /// The process that does not come, or what `connect` says.
    pub fn start_barriers(&self, connect: &mut dyn FnMut() -> Result<(), LinkError>) -> Result<(), LinkError> {
        match &self.shared {
            Some(shared) => shared.start_barriers(connect),
            None => connect(),
        }
    }

    /// As [`SharedContext::end_barrier`].
    ///
    /// # Errors
    /// The process that does not come.
    pub fn end_barrier(&self) -> Result<(), LinkError> {
        self.shared.as_ref().map_or(Ok(()), |shared| shared.end_barrier())
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
            Source::Shared(RawReceiver::open(shared, M::CHANNEL, reader)?)
        };
        let watched = self.watched.0.contains(&M::CHANNEL.producer());
        Ok(Receiver {
            source,
            reader,
            delay,
            discipline: self.discipline.clone(),
            newest: Newest::new(self.pace().map_or(0, |pace| pace.period_ns())),
            taken: 0,
            any_tick: self.any_tick.contains(&M::CHANNEL),
            silence_limit_ticks: watched.then_some(self.watched.1),
            late: 0,
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
            Some(shared) if !remote.is_empty() => Some(RawSender::open(shared, M::CHANNEL, &remote, self.pace())?),
            _ => None,
        };
        Ok(Sender {
            cell: self.cells.cell::<M>(),
            shared,
        })
    }
}

impl Connections {
    fn pace(&self) -> Option<Rc<Pace>> {
        match &self.discipline {
            Discipline::Newest(pace) => Some(pace.clone()),
            Discipline::Lockstep | Discipline::AsFed => None,
        }
    }

    /// Puts a token where those find it that read `M`'s channel within this process.
    pub fn feed<M: Message>(&mut self, token: M) {
        self.cells.cell::<M>().set(token);
    }

    /// The token that was last sent on `M`'s channel within this process.
    pub fn last<M: Message>(&mut self) -> Option<M> {
        self.cells.cell::<M>().get()
    }
}

/// The sending end of a channel.
pub struct Sender<M: Message> {
    cell: Rc<Slot<M>>,
    shared: Option<RawSender>,
}

impl<M: Message> Sender<M> {
    /// Sends one token to every reader.
    ///
    /// # Errors
    /// In lockstep if it reached fewer readers than are connected; in real time that is counted.
    #[inline(always)]
    pub fn send(&mut self, mut token: M) -> Result<(), LinkError> {
        if let Some(shared) = &self.shared {
            send_shared(shared, &mut token)?;
        }
        self.cell.set(token);
        Ok(())
    }

    /// Connects to the readers that have appeared since the channel was opened.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn connect(&mut self) -> Result<(), LinkError> {
        self.shared.as_ref().map_or(Ok(()), RawSender::connect)
    }
}

/// Apart: links within one process are not to pay for it.
#[inline(never)]
fn send_shared<M: Message>(shared: &RawSender, token: &mut M) -> Result<(), LinkError> {
    token.stamp(token.tick(), monotonic_ns());
    shared.send(&RawToken::of(token))
}

enum Source<M: Message> {
    Cell(Rc<Slot<M>>),
    Shared(RawReceiver),
}

/// The token again: its channel has one message type.
fn typed<M: Message>(token: &RawToken) -> M {
    token.typed().unwrap_or_default()
}

/// The reading end of a channel.
pub struct Receiver<M: Message> {
    source: Source<M>,
    reader: NodeId,
    delay: u64,
    discipline: Discipline,
    newest: Newest,
    taken: u32,
    any_tick: bool,
    silence_limit_ticks: Option<u64>,
    late: u64,
    latency: Latency,
}

impl<M: Message> Receiver<M> {
    /// True if the token that is due at `tick` lies in the cell, within one process in lockstep.
    #[inline(always)]
    pub fn is_here(&self, tick: u64) -> bool {
        match (&self.discipline, &self.source) {
            (Discipline::Lockstep, Source::Cell(cell)) => {
                let (there, due) = (cell.tick(), tick.checked_sub(self.delay));
                there.is_some() && due.is_some() && (there == due || self.any_tick)
            }
            _ => false,
        }
    }

    /// The token that [`Receiver::is_here`], with no error beside it: without another copy on the way.
    #[inline(always)]
    pub fn here(&self) -> M {
        match &self.source {
            Source::Cell(cell) => cell.token(),
            Source::Shared(_) => M::default(),
        }
    }

    /// The token that is due at `tick`: of this tick, or of the tick before for a delayed reader (at tick 0 the default). In
    /// real time: the newest that is not newer than that.
    ///
    /// # Errors
    /// In lockstep if it does not come within the receive limit or another one comes; in real time if its sender is watched
    /// ([`Connections::end_if_silent`]) and silent; if the run is told to stop.
    pub fn receive(&mut self, tick: u64) -> Result<M, LinkError> {
        self.receive_in(tick, false)
    }

    /// As [`Receiver::receive`], in real time for a tick that was left out: what was newest in it, if it is still there.
    ///
    /// # Errors
    /// As [`Receiver::receive`].
    pub fn receive_left_out(&mut self, tick: u64) -> Result<M, LinkError> {
        self.receive_in(tick, true)
    }

    fn receive_in(&mut self, tick: u64, left_out: bool) -> Result<M, LinkError> {
        match &self.discipline {
            Discipline::Lockstep => self.receive_due(tick),
            Discipline::Newest(pace) => {
                let pace = pace.clone();
                self.receive_newest(tick, &pace, left_out)
            }
            Discipline::AsFed => Ok(match &self.source {
                Source::Cell(cell) => cell.get().unwrap_or_default(),
                Source::Shared(_) => M::default(),
            }),
        }
    }

    /// A token of tick `k` is due within tick `k`: a delayed reader, which reads it a tick later, never waits.
    fn receive_newest(&mut self, tick: u64, pace: &Pace, left_out: bool) -> Result<M, LinkError> {
        let Some(due) = tick.checked_sub(self.delay) else {
            self.taken = noted(None);
            return Ok(M::default());
        };
        match &mut self.source {
            Source::Cell(cell) => {
                let token = cell.get();
                self.taken = noted(token.map(|token| token.tick()));
                Ok(token.unwrap_or_default())
            }
            Source::Shared(shared) => {
                self.newest.anchor(pace.anchored());
                let had = self.newest.noted_tick();
                let waits = self.delay == 0 && !left_out;
                let until_ns = if waits { pace.time_out_ns(self.reader, tick) } else { 0 };
                shared.receive_newest(&mut self.newest, due, until_ns)?;
                let token: M = self.newest.token().map(typed).unwrap_or_default();
                self.taken = self.newest.noted_tick();
                if left_out {
                    return Ok(token);
                }
                let now_ns = monotonic_ns();
                if self.taken != had {
                    self.latency.record(now_ns.saturating_sub(token.sent_ns()));
                }
                if !self.newest.is_of(due) {
                    pace.note_late();
                    self.late += 1;
                }
                if self.delay == 0 && self.taken != had {
                    pace.arrived(token.tick(), now_ns);
                }
                if let Some(ahead) = self.newest.ahead_tick() {
                    pace.seen(ahead);
                }
                let missed_ticks = self.newest.behind(due);
                if self.silence_limit_ticks.is_some_and(|limit| missed_ticks > limit) {
                    return Err(LinkError::Silent {
                        reader: self.reader,
                        channel: M::CHANNEL,
                        tick: due,
                        waited_s: pace.span_s(missed_ticks),
                    });
                }
                Ok(token)
            }
        }
    }

    /// The tick of the token taken last, for a log.
    pub(crate) fn taken(&self) -> u32 {
        self.taken
    }

    /// The fields of that token, for the log of one who hears a foreign process.
    pub(crate) fn write_taken(&self, words: &mut [u64]) {
        if let Some(token) = self.newest.token() {
            let fields = words.len().min(token.fields().len());
            words[..fields].copy_from_slice(&token.fields()[..fields]);
        }
    }

    fn receive_due(&mut self, tick: u64) -> Result<M, LinkError> {
        let Some(due) = tick.checked_sub(self.delay) else {
            return Ok(M::default());
        };
        let token = match &mut self.source {
            Source::Cell(cell) => cell.get().ok_or(LinkError::Unconnected {
                reader: self.reader,
                channel: M::CHANNEL,
            })?,
            Source::Shared(shared) => {
                let token: M = typed(&shared.receive(due)?);
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
            lost: self.newest.missing(),
            late: self.late,
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
            Source::Shared(shared) => shared.receive(due).map(|token| typed(&token)),
        }
    }
}
