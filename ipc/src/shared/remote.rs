//! What stands on this host for processes that run on another one: a proxy of each, the reading ends of what they hear
//! ([`Egress`]) and the sending ends of what they say ([`Ingress`]).
//!
//! The processes of this host notice nothing: under each name they find a status, an event service and ports, as if the
//! process were here. Egress and ingress are two contexts, because a port belongs to the thread that opened it and the two
//! directions must not wait for each other.

use super::context::{SharedContext, SharedSettings};
use super::names::{DEEPEST_BUFFER, END};
use super::ports::{RawSender, Subscribed, subscribe};
use super::waker::{Peer, Rest, Waker, wait};
use crate::clock::monotonic_ns;
use crate::error::LinkError;
use crate::message::{Channel, NodeId};
use crate::raw::RawToken;
use crate::wire::Wire;
use iceoryx2::node::{NodeDetails, NodeView};
use iceoryx2::prelude::{CallbackProgression, Node, NodeState, ipc};
use serde::{Deserialize, Serialize};
use std::rc::Rc;
use std::time::Duration;

/// Between two polls while nobody is notified of everything that leaves.
const POLL: Duration = Duration::from_micros(50);

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

/// One channel that leaves. A sender counts its readers: each has its port here, of which one is read.
struct Outlet {
    port: Box<dyn Subscribed>,
    _others: Vec<Box<dyn Subscribed>>,
}

impl Outlet {
    fn open(context: &SharedContext, channel: Channel, readers: &[NodeId]) -> Result<Self, LinkError> {
        let (first, others) = readers.split_first().ok_or(LinkError::Unconnected {
            reader: NodeId::Recorder,
            channel,
        })?;
        let others = others
            .iter()
            .map(|reader| subscribe(&context.node, channel, reader.name(), 1));
        Ok(Self {
            port: subscribe(&context.node, channel, first.name(), DEEPEST_BUFFER)?,
            _others: others.collect::<Result<_, _>>()?,
        })
    }
}

/// What this host's processes find of a remote one.
struct Proxy {
    process: String,
    waker: Waker,
}

/// What leaves this host, and the proxies of the processes that it is for.
pub struct Egress {
    outlets: Vec<Outlet>,
    proxies: Vec<Proxy>,
    // The proxy that hears everything that leaves, if there is one: only its notifications need be waited for.
    hears_all: Option<usize>,
    context: SharedContext,
}

impl Egress {
    /// Takes the names of the `remote` processes on this host, waits for those that are here (`settings.processes`), and opens
    /// the reading ends of what crosses.
    ///
    /// # Errors
    /// [`LinkError::Absent`] if a process of this host does not appear; [`LinkError::Disagreement`] if one runs another
    /// scenario; [`LinkError::Transport`] if iceoryx2 refuses, because a name is taken, for example.
    pub fn open(settings: SharedSettings, remote: &[(String, Vec<NodeId>)], wires: &[Wire]) -> Result<Self, LinkError> {
        let agreement = settings.agreement;
        let crossing = crossing(&nodes(&settings.processes), &nodes(remote), wires);
        let context = SharedContext::create(settings, false)?;
        let proxies = remote
            .iter()
            .map(|(process, _)| {
                Ok(Proxy {
                    process: process.clone(),
                    waker: Waker::create(&context.node, process, agreement, false)?,
                })
            })
            .collect::<Result<Vec<_>, LinkError>>()?;
        let context = context.with_peers()?;
        let outlets = crossing
            .iter()
            .map(|(channel, readers)| Outlet::open(&context, *channel, readers));
        let hears_all = remote.iter().position(|(_, nodes)| {
            crossing
                .iter()
                .all(|(_, readers)| readers.iter().any(|reader| nodes.contains(reader)))
        });
        Ok(Self {
            outlets: outlets.collect::<Result<_, _>>()?,
            proxies,
            hears_all,
            context,
        })
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

    /// Says on this host where a remote process stands; unknown names are no one's.
    pub fn set(&self, progress: &Progress) {
        for proxy in self.proxies.iter().filter(|known| known.process == progress.process) {
            proxy.waker.status.set_tick(progress.tick);
            proxy.waker.status.set_phase(progress.phase);
        }
    }

    /// A token that waits to leave, if there is one.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn poll(&self) -> Result<Option<RawToken>, LinkError> {
        for outlet in &self.outlets {
            if let Some(token) = outlet.port.poll()? {
                return Ok(Some(token));
            }
        }
        Ok(None)
    }

    /// The next token that leaves; `None` if none comes for `limit`, or if the bridge is told to stop.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn next(&self, limit: Duration) -> Result<Option<RawToken>, LinkError> {
        let listening = self.hears_all.and_then(|index| self.proxies.get(index));
        let rest = listening.map_or(Rest::For(POLL), |proxy| Rest::Notified(&proxy.waker, None));
        if let Some(token) = self.poll()? {
            return Ok(Some(token));
        }
        let now_ns = monotonic_ns();
        let until_ns = now_ns + limit.as_nanos() as u64;
        wait(self.context.yields(), &rest, (now_ns, until_ns), true, || self.poll())
    }
}

/// What comes to this host from remote processes.
pub struct Ingress {
    inlets: Vec<RawSender>,
    context: SharedContext,
}

impl Ingress {
    /// Waits for the processes that are here (`settings.processes`) and opens the sending ends of what crosses.
    ///
    /// # Errors
    /// As [`Egress::open`].
    pub fn open(settings: SharedSettings, remote: &[(String, Vec<NodeId>)], wires: &[Wire]) -> Result<Self, LinkError> {
        let crossing = crossing(&nodes(remote), &nodes(&settings.processes), wires);
        let context = SharedContext::open(settings)?;
        let inlets = crossing
            .into_iter()
            .map(|(channel, readers)| RawSender::open(&context, channel, &readers, None));
        Ok(Self {
            inlets: inlets.collect::<Result<_, _>>()?,
            context,
        })
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
    pub fn connect(&self) -> Result<(), LinkError> {
        self.inlets.iter().try_for_each(RawSender::connect)
    }

    /// Sends a token to the readers of this host; one that nobody here reads goes nowhere.
    ///
    /// # Errors
    /// If it reached fewer readers than there are.
    pub fn deliver(&self, token: &RawToken) -> Result<(), LinkError> {
        let inlet = self.inlets.iter().find(|inlet| inlet.channel() == token.channel());
        inlet.map_or(Ok(()), |inlet| inlet.send(&token.sent_at(monotonic_ns())))
    }
}
