//! What stands on this host for processes that run on another one: their status and bell, the reading ends of what they
//! hear ([`Departures`]) and the sending ends of what they say ([`Arrivals`]).
//!
//! The processes of this host notice nothing: under each name they find a status, a bell and ports, as if the process were
//! here. Departures and arrivals are two contexts, because a port belongs to the thread that opened it and the two
//! directions must not wait for each other.

use super::context::{Peer, SharedContext, event};
use super::names::DEEPEST_BUFFER;
use super::ports::{SharedSender, open_channel};
use super::refused;
use super::status::OwnStatus;
use crate::guest::with_message;
use crate::raw::RawToken;
use crate::{Channel, LinkError, Message, NodeId, SharedSettings, Wait, Wire, monotonic_ns};
use iceoryx2::node::{NodeDetails, NodeView};
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use serde::{Deserialize, Serialize};
use std::rc::Rc;
use std::sync::atomic::{Ordering, fence};
use std::time::Duration;

/// Polls while no single bell rings for everything that leaves.
const POLL: Duration = Duration::from_micros(50);

/// The last phase: the end.
const END: u64 = 3;

/// Where a process stands: its name, the phase of the start that it has reached, its last finished tick.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// Its name.
    pub process: String,
    /// 0 started, 1 ports created, 2 connected, 3 at the end.
    pub phase: u64,
    /// Its last finished tick.
    pub tick: u64,
}

fn nodes(processes: &[(String, Vec<NodeId>)]) -> Vec<NodeId> {
    processes.iter().flat_map(|(_, nodes)| nodes.iter().copied()).collect()
}

/// The channels from a node of `from` to a node of `to`, with those readers, in the order in which a tick sends them.
pub fn crossing(from: &[NodeId], to: &[NodeId], wires: &[Wire]) -> Vec<(Channel, Vec<NodeId>)> {
    Channel::ALL
        .into_iter()
        .filter(|channel| from.contains(&channel.producer()))
        .map(|channel| {
            let readers = wires
                .iter()
                .filter(|wire| wire.channel == channel && to.contains(&wire.reader))
                .map(|wire| wire.reader);
            (channel, readers.collect::<Vec<_>>())
        })
        .filter(|(_, readers)| !readers.is_empty())
        .collect()
}

trait Outlet {
    fn poll(&self) -> Result<Option<RawToken>, LinkError>;
}

struct TypedOutlet<M: Message> {
    first: Subscriber<ipc::Service, M, ()>,
    // A sender counts its readers: each has its port here, of which one is read.
    _others: Vec<Subscriber<ipc::Service, M, ()>>,
}

impl<M: Message> TypedOutlet<M> {
    fn open(context: &SharedContext, readers: &[NodeId]) -> Result<Self, LinkError> {
        let service = open_channel::<M>(context)?;
        let port = |reader: &NodeId, depth: usize| {
            service
                .subscriber_builder()
                .name(&PortName::new(reader.name()).map_err(refused("name a subscriber"))?)
                .buffer_size(depth)
                .create()
                .map_err(refused("create a subscriber"))
        };
        let (first, others) = readers.split_first().ok_or(LinkError::Unconnected {
            reader: NodeId::Recorder,
            channel: M::CHANNEL,
        })?;
        Ok(Self {
            first: port(first, DEEPEST_BUFFER)?,
            _others: others.iter().map(|reader| port(reader, 1)).collect::<Result<_, _>>()?,
        })
    }
}

impl<M: Message> Outlet for TypedOutlet<M> {
    fn poll(&self) -> Result<Option<RawToken>, LinkError> {
        let sample = self
            .first
            .receive()
            .map_err(refused(format!("receive {}", M::CHANNEL)))?;
        Ok(sample.map(|sample| RawToken::of(&*sample)))
    }
}

/// Status and bell of a process that is away.
struct StandIn {
    process: String,
    status: OwnStatus,
    bell: Listener<ipc::Service>,
}

/// What leaves this host, and the statuses of the processes that it is for.
pub struct Departures {
    outlets: Vec<Box<dyn Outlet>>,
    channels: Vec<Channel>,
    stand_ins: Vec<StandIn>,
    // The stand-in that hears everything that leaves, if there is one: only its bell need be waited for.
    hears_all: Option<usize>,
    context: SharedContext,
}

impl Departures {
    /// Takes the names of the `away` processes on this host, waits for those that are here (`settings.processes`), and opens
    /// the reading ends of what crosses.
    ///
    /// # Errors
    /// [`LinkError::Absent`] if a process of this host does not appear; [`LinkError::Disagreement`] if one runs another
    /// scenario; [`LinkError::Transport`] if iceoryx2 refuses, because a name is taken, for example.
    pub fn open(settings: SharedSettings, away: &[(String, Vec<NodeId>)], wires: &[Wire]) -> Result<Self, LinkError> {
        let agreement = settings.agreement;
        let crossing = crossing(&nodes(&settings.processes), &nodes(away), wires);
        let context = SharedContext::create(settings, false)?;
        let stand_ins = away
            .iter()
            .map(|(process, _)| {
                Ok(StandIn {
                    process: process.clone(),
                    bell: event(&context.node, process)?
                        .listener_builder()
                        .create()
                        .map_err(refused("create a listener"))?,
                    status: OwnStatus::create(&context.node, process, agreement)?,
                })
            })
            .collect::<Result<Vec<_>, LinkError>>()?;
        let context = context.with_peers()?;
        let outlets = crossing
            .iter()
            .map(|(channel, readers)| {
                let outlet: Box<dyn Outlet> =
                    with_message!(channel, M => Box::new(TypedOutlet::<M>::open(&context, readers)?));
                Ok(outlet)
            })
            .collect::<Result<_, LinkError>>()?;
        let hears_all = away.iter().position(|(_, nodes)| {
            crossing
                .iter()
                .all(|(_, readers)| readers.iter().any(|reader| nodes.contains(reader)))
        });
        Ok(Self {
            outlets,
            channels: crossing.into_iter().map(|(channel, _)| channel).collect(),
            stand_ins,
            hears_all,
            context,
        })
    }

    /// What leaves, in the order in which a tick sends it.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Where the processes of this host stand.
    pub fn here(&self) -> Vec<Progress> {
        let progress = |(process, peer): (&String, &Rc<Peer>)| Progress {
            process: process.clone(),
            phase: peer.status.phase(),
            tick: peer.status.tick(),
        };
        self.context.peers.iter().map(progress).collect()
    }

    /// A process of this host that has crashed; with `vanished` also one that has gone without having come to its end. Takes
    /// about a millisecond.
    pub fn dead(&self, vanished: bool) -> Option<String> {
        let (mut alive, mut dead) = (Vec::new(), Vec::new());
        let name = |details: &Option<NodeDetails>| details.as_ref().map(|details| details.name().to_string());
        let listed = Node::<ipc::Service>::list(self.context.node.config(), |state| {
            match state {
                NodeState::Alive(view) => alive.extend(name(view.details())),
                NodeState::Dead(view) => dead.extend(name(view.details())),
                _ => {}
            }
            CallbackProgression::Continue
        });
        // A list that cannot be had accuses nobody.
        listed.ok()?;
        let here: Vec<String> = self
            .here()
            .into_iter()
            .filter(|progress| progress.phase < END)
            .map(|progress| progress.process)
            .collect();
        let crashed = here.iter().find(|process| dead.contains(process));
        let gone = || here.iter().find(|process| vanished && !alive.contains(process));
        crashed.or_else(gone).cloned()
    }

    /// Says on this host where a process stands that is away; unknown names are no one's.
    pub fn set(&self, progress: &Progress) {
        for stand_in in self.stand_ins.iter().filter(|known| known.process == progress.process) {
            stand_in.status.set_tick(progress.tick);
            stand_in.status.set_phase(progress.phase);
        }
    }

    /// A token that waits to leave, if there is one.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn poll(&self) -> Result<Option<RawToken>, LinkError> {
        for outlet in &self.outlets {
            if let Some(token) = outlet.poll()? {
                return Ok(Some(token));
            }
        }
        Ok(None)
    }

    /// The next token that leaves; `None` if none comes for `limit`.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn next(&self, limit: Duration) -> Result<Option<RawToken>, LinkError> {
        let yields = match self.context.settings.wait {
            Wait::Bell { yields } => yields,
            Wait::Poll { .. } => 0,
        };
        for _ in 0..=yields {
            if let Some(token) = self.poll()? {
                return Ok(Some(token));
            }
            std::thread::yield_now();
        }
        match self.hears_all.and_then(|index| self.stand_ins.get(index)) {
            Some(stand_in) => self.sleep(stand_in, limit),
            None => {
                let until = monotonic_ns() + limit.as_nanos() as u64;
                while monotonic_ns() < until {
                    std::thread::sleep(POLL);
                    if let Some(token) = self.poll()? {
                        return Ok(Some(token));
                    }
                }
                Ok(None)
            }
        }
    }

    fn sleep(&self, stand_in: &StandIn, limit: Duration) -> Result<Option<RawToken>, LinkError> {
        stand_in.status.set_asleep(true);
        // Pairs with the fence in `SharedSender::send`: the flag is out before the channels are looked at again.
        fence(Ordering::SeqCst);
        let token = self.poll()?;
        let waited = match token {
            Some(_) => Ok(0),
            None => stand_in.bell.timed_wait(|_| {}, limit),
        };
        stand_in.status.set_asleep(false);
        match waited {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => {}
            Err(error) => return Err(refused("wait for a bell")(error)),
        }
        token.map_or_else(|| self.poll(), |token| Ok(Some(token)))
    }
}

trait Inlet {
    fn connect(&mut self) -> Result<(), LinkError>;
    fn deliver(&mut self, token: &RawToken) -> Result<(), LinkError>;
}

impl<M: Message> Inlet for SharedSender<M> {
    fn connect(&mut self) -> Result<(), LinkError> {
        SharedSender::connect(self)
    }

    fn deliver(&mut self, token: &RawToken) -> Result<(), LinkError> {
        let Some(mut token) = token.typed::<M>() else {
            return Ok(());
        };
        token.stamp(token.tick(), monotonic_ns());
        self.send(token)
    }
}

/// What comes to this host from processes that are away.
pub struct Arrivals {
    inlets: Vec<(Channel, Box<dyn Inlet>)>,
    context: Rc<SharedContext>,
}

impl Arrivals {
    /// Waits for the processes that are here (`settings.processes`) and opens the sending ends of what crosses.
    ///
    /// # Errors
    /// As [`Departures::open`].
    pub fn open(settings: SharedSettings, away: &[(String, Vec<NodeId>)], wires: &[Wire]) -> Result<Self, LinkError> {
        let crossing = crossing(&nodes(away), &nodes(&settings.processes), wires);
        let context = Rc::new(SharedContext::open(settings)?);
        let inlets = crossing
            .into_iter()
            .map(|(channel, readers)| {
                let inlet: Box<dyn Inlet> =
                    with_message!(channel, M => Box::new(SharedSender::<M>::open(&context, &readers, None)?));
                Ok((channel, inlet))
            })
            .collect::<Result<_, LinkError>>()?;
        Ok(Self { inlets, context })
    }

    /// The lowest phase of the processes of this host.
    pub fn lowest_phase(&self) -> u64 {
        let phases = self.context.peers.values().map(|peer| peer.status.phase());
        phases.min().unwrap_or_default()
    }

    /// Connects to the readers of this host, when all have created their ports.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn connect(&mut self) -> Result<(), LinkError> {
        self.inlets.iter_mut().try_for_each(|(_, inlet)| inlet.connect())
    }

    /// Sends a token to the readers of this host; one that nobody here reads goes nowhere.
    ///
    /// # Errors
    /// If it reached fewer readers than there are.
    pub fn deliver(&mut self, token: &RawToken) -> Result<(), LinkError> {
        let inlet = self.inlets.iter_mut().find(|(channel, _)| *channel == token.channel());
        inlet.map_or(Ok(()), |(_, inlet)| inlet.deliver(token))
    }
}
