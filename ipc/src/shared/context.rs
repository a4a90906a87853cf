//! What one process holds open: its iceoryx2 node, what the others find of it, and the other processes.

use super::iceoryx::create_node;
use super::names::{ANY_AGREEMENT, CONNECTED, END, GONE, PORTS};
use super::status::{PeerStatus, TokenWait};
use super::waker::{Awaited, Peer, Rest, Waker, wait};
use crate::error::LinkError;
use crate::message::NodeId;
use crate::stop::stop_requested;
use iceoryx2::prelude::{Node, ipc};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// How a process waits for tokens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wait {
    /// Poll and yield so often, then sleep until notified. For the loop: about 20 on a shared machine, 1000 with a core each.
    Notified {
        /// Polls before sleeping.
        yields: u32,
    },
    /// Poll at this period, never notified. For the recorder, which must not cost the loop anything.
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

/// The open transport of one process.
pub struct SharedContext {
    pub(super) settings: SharedSettings,
    waker: Waker,
    pub(super) peers: BTreeMap<String, Rc<Peer>>,
    /// This process takes the place of one that died while the others ran on.
    pub(super) rejoins: bool,
    /// Set when the run is ending: how long a last token is still waited for, whatever was asked.
    last_wait: Cell<Option<Duration>>,
    // Last: iceoryx2 removes the node's traces when it is dropped, after its ports.
    pub(super) node: Node<ipc::Service>,
}

/// How long a process that took the place of one that died stays for those who have yet to find it at the end. Only where a
/// second one died, too, and can never say that it has gone, all of it passes.
const LINGER: Duration = Duration::from_secs(2);
const STEP: Duration = Duration::from_millis(2);
/// How often a process that took the place of one that died looks for tokens.
const REJOINED_POLL: Duration = Duration::from_micros(20);
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
        Ok(Self {
            waker: Waker::create(&node, &settings.process, settings.agreement, rejoins)?,
            settings,
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
            let peer = Peer::new(&self.node, &process, status)?;
            self.peers.insert(process, Rc::new(peer));
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

    /// Two barriers before tick 0: all have created their ports, all have connected (`connect` does it for this process's
    /// senders). iceoryx2 drops what is sent to a reader that has not connected yet.
    ///
    /// # Errors
    /// [`LinkError::Absent`] naming the process that does not come, or what `connect` says.
    pub fn start_barriers(&self, connect: &mut dyn FnMut() -> Result<(), LinkError>) -> Result<(), LinkError> {
        self.barrier(PORTS)?;
        connect()?;
        self.barrier(CONNECTED)
    }

    /// The barrier after the last tick: who left earlier could not be sent its last tokens.
    ///
    /// # Errors
    /// [`LinkError::Absent`] naming the process that does not come.
    pub fn end_barrier(&self) -> Result<(), LinkError> {
        self.barrier(END)
    }

    /// Says that this process has finished `phase` and waits until all have.
    fn barrier(&self, phase: u64) -> Result<(), LinkError> {
        self.waker.status.set_phase(phase);
        if self.rejoins && phase < END {
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
        if phase == END {
            self.waker.status.set_phase(GONE);
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
        phase == END && PeerStatus::phase_of_later_starts(&self.node, process) >= phase
    }

    /// From here on a token is waited for so long at most, and a request to stop does not end the wait: the last tokens of a
    /// run lead to the safe field and are worth hearing.
    pub fn wait_at_most(&self, limit: Duration) {
        self.last_wait.set(Some(limit));
    }

    /// Publishes the last finished tick: progress for a launcher, credit for a reader that must not fall behind.
    pub fn set_tick(&self, tick: u64) {
        self.waker.status.set_tick(tick);
    }

    /// Publishes which token this process waits for.
    pub(super) fn tell_wait(&self, wait: TokenWait) {
        self.waker.status.set_wait(wait);
    }

    /// The limit that [`SharedContext::wait_at_most`] has set.
    pub(super) fn last_wait(&self) -> Option<Duration> {
        self.last_wait.get()
    }

    pub(super) fn receive_limit(&self) -> Duration {
        self.settings.receive_limit
    }

    /// Polls before this process sleeps.
    pub(super) fn yields(&self) -> u32 {
        match self.settings.wait {
            Wait::Notified { yields } => yields,
            Wait::Poll { .. } => 0,
        }
    }

    /// Waits as this process does, whose last look has found nothing, until `look` finds what is `awaited`; none once it is `until_ns` of the
    /// monotonic clock, now `now_ns`, or the run is told to stop, which no longer counts once [`SharedContext::wait_at_most`] was called.
    pub(super) fn wait<T>(
        &self,
        (now_ns, until_ns): (u64, u64),
        awaited: &Awaited,
        look: impl FnMut() -> Result<Option<T>, LinkError>,
    ) -> Result<Option<T>, LinkError> {
        let rest = match self.settings.wait {
            Wait::Poll { period } => Rest::For(period),
            // Senders look at the status of the process that died: nobody notifies this one.
            Wait::Notified { .. } if self.rejoins => Rest::For(REJOINED_POLL),
            Wait::Notified { .. } => Rest::Notified(&self.waker, Some(awaited)),
        };
        wait(
            self.yields(),
            &rest,
            (now_ns, until_ns),
            self.last_wait.get().is_none(),
            look,
        )
    }

    /// How often this process slept on with a token there, because its sender's notification was lost. Sleeps that a tick's end
    /// cuts short do not count: there a token may come just then.
    pub fn lost_notifications(&self) -> u64 {
        self.waker.lost_notifications()
    }

    /// Says at which moment of the monotonic clock tick 0 begins; for the process that has the timer.
    pub fn set_epoch(&self, epoch_ns: u64) {
        self.waker.status.set_epoch(epoch_ns);
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
            self.still_waiting(start, process, CONNECTED)?;
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
        let at_end = |node| self.peer_of(node).is_some_and(|peer| peer.status.phase() >= END);
        at_end(node)
            || realtime
                && at_end(NodeId::Plant)
                && self
                    .process_of(node)
                    .is_some_and(|name| self.later_start_has_finished(name, END))
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

    pub(super) fn peer_of(&self, node: NodeId) -> Option<&Rc<Peer>> {
        self.process_of(node).and_then(|process| self.peers.get(process))
    }

    /// The other processes in which these nodes run, each once.
    pub(super) fn peers_of(&self, nodes: &[NodeId]) -> Vec<Rc<Peer>> {
        let mut peers: Vec<Rc<Peer>> = Vec::new();
        for peer in nodes.iter().filter_map(|node| self.peer_of(*node)) {
            if !peers.iter().any(|known| Rc::ptr_eq(known, peer)) {
                peers.push(peer.clone());
            }
        }
        peers
    }
}

/// A process that has not read the scenario (a driver in another language) agrees with all.
fn agree(one: u64, other: u64) -> bool {
    one == other || one == ANY_AGREEMENT || other == ANY_AGREEMENT
}
