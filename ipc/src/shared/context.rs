//! What one process holds open: its iceoryx2 node, its status, its bell, and the other processes.

use super::names::{ANY_AGREEMENT, MOST_LISTENERS, MOST_NODES, MOST_NOTIFIERS, bell_service};
use super::refused;
use super::status::{OwnStatus, PeerStatus, Standing};
use crate::{LinkError, NodeId, stop_requested};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::*;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// How a process waits for tokens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wait {
    /// Poll and yield so often, then sleep until rung. For the loop: about 20 on a shared machine, 1000 with a core each.
    Bell {
        /// Polls before sleeping.
        yields: u32,
    },
    /// Poll at this period, never rung. For the recorder, which must not cost the loop anything.
    Poll {
        /// Between two polls.
        period: Duration,
    },
}

/// How processes find each other and how long they wait for each other.
#[derive(Debug, Clone, PartialEq)]
pub struct SharedSettings {
    /// Prefix of every iceoryx2 resource of the run; unique for each run.
    pub prefix: String,
    /// Directory of iceoryx2's files; short (a socket path has 108 bytes) and owned by the user.
    pub root: PathBuf,
    /// This process's name.
    pub process: String,
    /// All processes of the run and the nodes in each.
    pub processes: Vec<(String, Vec<NodeId>)>,
    /// Fingerprint of what all processes must have been told alike ([`crate::fingerprint`] of the scenario), or
    /// [`crate::ANY_AGREEMENT`].
    pub agreement: u64,
    /// How this process waits.
    pub wait: Wait,
    /// How long a token may take to come.
    pub receive_limit: Duration,
    /// How long the other processes may take to appear.
    pub start_limit: Duration,
}

pub(super) struct Peer {
    pub status: PeerStatus,
    pub bell: Notifier<ipc::Service>,
}

/// The open transport of one process.
pub struct SharedContext {
    pub(super) settings: SharedSettings,
    pub(super) status: OwnStatus,
    pub(super) bell: Listener<ipc::Service>,
    pub(super) peers: BTreeMap<String, Rc<Peer>>,
    /// This process takes the place of one that died while the others ran on.
    pub(super) rejoins: bool,
    /// Set when the run is ending: how long a last token is still waited for, whatever was asked.
    pub(super) last_wait: Cell<Option<Duration>>,
    // Last: iceoryx2 removes the node's traces when it is dropped, after its ports.
    pub(super) node: Node<ipc::Service>,
}

/// The phase of a process that has come to the end of its run: also one that rejoined waits for the others there.
const LAST_PHASE: u64 = 3;
/// The phase of a process that has seen all the others come to the end, and looks at nobody any more.
const GONE: u64 = 4;
/// How long a process that took the place of one that died stays for those who have yet to find it at the end. Only where a
/// second one died, too, and can never say that it has gone, all of it passes.
const LINGER: Duration = Duration::from_secs(2);
const STEP: Duration = Duration::from_millis(2);
/// Whether a process was started again is looked for once in so many steps: it takes time, and the others may have priority.
const LATER_START_STEPS: u32 = 25;

impl SharedContext {
    /// Creates this process's node and status and waits for those of the others.
    ///
    /// # Errors
    /// [`LinkError::Absent`] if a process does not appear within the start limit; [`LinkError::Transport`] if iceoryx2 refuses.
    pub fn open(settings: SharedSettings) -> Result<Self, LinkError> {
        Self::create(settings, false)?.with_peers()
    }

    /// Takes the place of a process of this name that died, in a run that goes on: what it has left is removed, and
    /// barriers are passed without waiting. It polls for tokens, because the senders look at the status of the one that died.
    ///
    /// # Errors
    /// As [`SharedContext::open`].
    pub fn rejoin(settings: SharedSettings) -> Result<Self, LinkError> {
        Self::create(settings, true)?.with_peers()
    }

    /// The first half of [`SharedContext::open`]: what the other processes wait for.
    pub(super) fn create(settings: SharedSettings, rejoins: bool) -> Result<Self, LinkError> {
        let node = create_node(&settings.prefix, &settings.root, &settings.process)?;
        let bell = super::patiently(rejoins, || {
            let created = event(&node, &settings.process)?.listener_builder().create();
            created.map_err(refused("create a listener"))
        })?;
        let status = if rejoins {
            OwnStatus::create_again(&node, &settings.process, settings.agreement)?
        } else {
            OwnStatus::create(&node, &settings.process, settings.agreement)?
        };
        Ok(Self {
            settings,
            status,
            bell,
            peers: BTreeMap::new(),
            rejoins,
            last_wait: Cell::new(None),
            node,
        })
    }

    /// The second half: waits for the other processes.
    pub(super) fn with_peers(mut self) -> Result<Self, LinkError> {
        let others: Vec<String> = self
            .settings
            .processes
            .iter()
            .map(|(name, _)| name.clone())
            .filter(|name| *name != self.settings.process)
            .collect();
        let start = Instant::now();
        for process in others {
            let status = loop {
                if let Some(status) = PeerStatus::open(&self.node, &process)? {
                    break status;
                }
                self.still_waiting(start, &process, 0)?;
                std::thread::sleep(STEP);
            };
            if !agree(status.agreement, self.settings.agreement) {
                return Err(LinkError::Disagreement {
                    process,
                    own: self.settings.process.clone(),
                });
            }
            let bell = event(&self.node, &process)?
                .notifier_builder()
                .create()
                .map_err(refused("create a notifier"))?;
            self.peers.insert(process, Rc::new(Peer { status, bell }));
        }
        Ok(self)
    }

    fn still_waiting(&self, start: Instant, process: &str, phase: u64) -> Result<(), LinkError> {
        if stop_requested() {
            return Err(LinkError::Stopped { tick: 0 });
        }
        if start.elapsed() > self.settings.start_limit {
            return Err(LinkError::Absent {
                process: process.into(),
                phase,
                waited_s: start.elapsed().as_secs_f64(),
            });
        }
        Ok(())
    }

    /// Says that this process has finished `phase` and waits until all have: 1 ports created, 2 connected, 3 at the end.
    ///
    /// # Errors
    /// [`LinkError::Absent`] naming the process that does not follow.
    pub fn barrier(&self, phase: u64) -> Result<(), LinkError> {
        self.status.set_phase(phase);
        if self.rejoins && phase < LAST_PHASE {
            return Ok(());
        }
        let start = Instant::now();
        for (process, peer) in &self.peers {
            let mut steps = 0;
            while peer.status.phase() < phase
                && !(steps % LATER_START_STEPS == 0 && self.later_start_has_finished(process, phase))
            {
                self.still_waiting(start, process, phase)?;
                std::thread::sleep(STEP);
                steps += 1;
            }
        }
        if phase == LAST_PHASE {
            self.status.set_phase(GONE);
            self.stay_to_be_found();
        }
        Ok(())
    }

    /// The status of a process leaves with it. The others opened that of a process that started with them and see it for
    /// good; that of one that took the place of another they look for only at the end: there it must still be.
    fn stay_to_be_found(&self) {
        let start = Instant::now();
        let found = || self.peers.values().all(|peer| peer.status.phase() >= GONE);
        while self.rejoins && !found() && start.elapsed() < LINGER && !stop_requested() {
            std::thread::sleep(STEP);
        }
    }

    /// True if a process that took the place of `process` has come to the end. Looked for only there: it takes time.
    fn later_start_has_finished(&self, process: &str, phase: u64) -> bool {
        phase == LAST_PHASE && PeerStatus::phase_of_later_starts(&self.node, process) >= phase
    }

    /// From here on a token is waited for so long at most, and a request to stop does not end the wait: the last tokens of a
    /// run lead to the safe field and are worth hearing.
    pub fn wait_at_most(&self, limit: Duration) {
        self.last_wait.set(Some(limit));
    }

    /// Publishes the last finished tick: progress for a launcher, credit for a reader that must not fall behind.
    pub fn set_tick(&self, tick: u64) {
        self.status.set_tick(tick);
    }

    /// Sleeps until another process rings, at most `limit`. The waits of iceoryx2 count in jiffies, which are longer than a
    /// tick; `ppoll` counts in nanoseconds.
    pub(super) fn wait_for_bell(&self, limit: Duration) {
        // SAFETY: the descriptor is the listener's, which lives as long as `self`.
        let descriptor = unsafe { self.bell.file_descriptor().native_handle() };
        let mut waited = libc::pollfd {
            fd: descriptor,
            events: libc::POLLIN,
            revents: 0,
        };
        let limit = libc::timespec {
            tv_sec: limit.as_secs() as libc::time_t,
            tv_nsec: libc::c_long::from(limit.subsec_nanos() as i32),
        };
        // SAFETY: one valid pollfd, a valid time, no signal mask. A failure (a signal) is an early wake-up: the caller looks again.
        let rung = unsafe { libc::ppoll(&raw mut waited, 1, &raw const limit, std::ptr::null()) };
        if rung > 0 {
            // What rang is of no interest; what it rang for is looked at next.
            let _ = self.bell.try_wait(|_| {});
        }
    }

    /// Says at which moment of the monotonic clock tick 0 begins; for the process that has the timer.
    pub fn set_epoch(&self, epoch_ns: u64) {
        self.status.set_epoch(epoch_ns);
    }

    /// The moment at which tick 0 begins, as `process` says it; waits until it does.
    ///
    /// # Errors
    /// [`LinkError::Absent`] if it does not say so within the start limit.
    pub fn epoch_of(&self, process: &str) -> Result<u64, LinkError> {
        let start = Instant::now();
        loop {
            let epoch_ns = self.peers.get(process).map_or(0, |peer| peer.status.epoch_ns());
            if epoch_ns != 0 {
                return Ok(epoch_ns);
            }
            self.still_waiting(start, process, 2)?;
            std::thread::sleep(STEP / 4);
        }
    }

    /// The last finished tick of another process, if it belongs to the run.
    pub fn tick_of(&self, process: &str) -> Option<u64> {
        self.peers.get(process).map(|peer| peer.status.tick())
    }

    /// True once the process of `node` has sent its last token; in real time also if it is one that took the place of another,
    /// which is told by the plant's: that one is never started again.
    pub(crate) fn finished(&self, node: NodeId, realtime: bool) -> bool {
        let at_end = |node| self.peer_of(node).is_some_and(|peer| peer.status.phase() >= LAST_PHASE);
        at_end(node)
            || realtime
                && at_end(NodeId::Plant)
                && self
                    .process_of(node)
                    .is_some_and(|name| self.later_start_has_finished(name, LAST_PHASE))
    }

    /// How far another process has come in the start, if it belongs to the run: 0 appeared, 1 ports created, 2 connected.
    pub fn phase_of(&self, process: &str) -> Option<u64> {
        self.peers.get(process).map(|peer| peer.status.phase())
    }

    /// The process in which `node` runs.
    pub fn process_of(&self, node: NodeId) -> Option<&str> {
        self.settings
            .processes
            .iter()
            .find(|(_, nodes)| nodes.contains(&node))
            .map(|(name, _)| name.as_str())
    }

    pub(super) fn peer_of(&self, node: NodeId) -> Option<Rc<Peer>> {
        self.process_of(node)
            .and_then(|process| self.peers.get(process))
            .cloned()
    }
}

/// A process that has not read the scenario (a driver in another language) agrees with all.
fn agree(one: u64, other: u64) -> bool {
    one == other || one == ANY_AGREEMENT || other == ANY_AGREEMENT
}

/// iceoryx2's settings of a run. A config file that happens to lie in the working directory must not change where a run lives:
/// both are set here.
pub(super) fn configuration(prefix: &str, root: &std::path::Path) -> Result<Config, LinkError> {
    let mut config = Config::default();
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(refused("use the run's prefix"))?;
    let root = root.to_string_lossy();
    config
        .global
        .set_root_path(&Path::new(root.as_bytes()).map_err(refused(format!("use {root} as its root")))?);
    Ok(config)
}

fn create_node(prefix: &str, root: &std::path::Path, name: &str) -> Result<Node<ipc::Service>, LinkError> {
    set_log_level(LogLevel::Error);
    let config = configuration(prefix, root)?;
    NodeBuilder::new()
        .name(&NodeName::new(name).map_err(refused("name the process's node"))?)
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(refused(format!("create a node under {}", root.display())))
}

pub(super) fn event(
    node: &Node<ipc::Service>,
    process: &str,
) -> Result<iceoryx2::service::port_factory::event::PortFactory<ipc::Service>, LinkError> {
    let name = ServiceName::new(&bell_service(process)).map_err(refused("name an event service"))?;
    node.service_builder(&name)
        .event()
        .max_notifiers(MOST_NOTIFIERS)
        .max_listeners(MOST_LISTENERS)
        .max_nodes(MOST_NODES)
        .open_or_create()
        .map_err(refused(format!("open the bell of {process}")))
}

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
