//! What a process says about itself on its iceoryx2 blackboard: phase of the start, asleep or not, last finished tick, the
//! token that it waited for last, and in real time the moment at which tick 0 begins.

use super::iceoryx::refused;
use super::names::{
    AGREEMENT, ANY_TOKEN, ASLEEP, EPOCH, MAX_NODES, MAX_STATUS_READERS, PHASE, TICK, WAIT, status_service,
};
use crate::error::LinkError;
use crate::message::{Channel, NodeId};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;

/// How often a process may be started in one run.
pub const MAX_STARTS: u64 = 100;

/// The status of the `start`th process of this name: 0 unless it takes the place of one that died.
fn service_name(process: &str, start: u64) -> Result<ServiceName, LinkError> {
    ServiceName::new(&status_service(process, start)).map_err(refused("name a status service"))
}

/// A channel's, counted from 1.
fn number(channel: Channel) -> u64 {
    let position = Channel::ALL.iter().position(|known| *known == channel);
    position.map_or(0, |position| position as u64 + 1)
}

/// The word of one who sleeps until a token comes on this channel, or on any.
pub fn asleep(awaited: Option<Channel>) -> u64 {
    ANY_TOKEN + awaited.map_or(0, number)
}

/// A token on this channel wakes the one with this word.
pub fn is_woken(word: u64, channel: Channel) -> bool {
    word == ANY_TOKEN || word == asleep(Some(channel))
}

/// A token that a process waits for. Its status keeps the last one, also after the token has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TokenWait {
    /// Which of its nodes reads it.
    pub reader: NodeId,
    /// On which channel.
    pub channel: Channel,
    /// Of which tick.
    pub tick: u64,
}

impl TokenWait {
    /// The tick, then eight bits each of reader and channel, counted from 1: 0 is nothing.
    fn to_word(self) -> u64 {
        let reader = NodeId::LOOP_ORDER.iter().position(|known| *known == self.reader);
        let reader = reader.map_or(0, |position| position as u64 + 1);
        self.tick << 16 | reader << 8 | number(self.channel)
    }

    fn from_word(word: u64) -> Option<Self> {
        let number = |shift: u32| ((word >> shift & 0xff) as usize).checked_sub(1);
        Some(Self {
            reader: *NodeId::LOOP_ORDER.get(number(8)?)?,
            channel: *Channel::ALL.get(number(0)?)?,
            tick: word >> 16,
        })
    }
}

/// Where a process stands, for one who looks on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Standing {
    /// Of the start and the end: 0 appeared, 1 ports created, 2 connected, 3 at the end.
    pub phase: u64,
    /// Ticks finished.
    pub tick: u64,
    /// What it waited for last, if it says so.
    pub wait: Option<TokenWait>,
}

/// The writing end: one process's own status.
pub struct OwnStatus {
    phase: EntryHandleMut<ipc::Service, u64, u64>,
    asleep: EntryHandleMut<ipc::Service, u64, u64>,
    tick: EntryHandleMut<ipc::Service, u64, u64>,
    epoch: EntryHandleMut<ipc::Service, u64, u64>,
    wait: EntryHandleMut<ipc::Service, u64, u64>,
    _writer: Writer<ipc::Service, u64>,
}

impl OwnStatus {
    pub fn create(node: &Node<ipc::Service>, process: &str, agreement: u64) -> Result<Self, LinkError> {
        Self::create_start(node, process, 0, agreement)
    }

    fn create_start(node: &Node<ipc::Service>, process: &str, start: u64, agreement: u64) -> Result<Self, LinkError> {
        let service = node
            .service_builder(&service_name(process, start)?)
            .blackboard_creator::<u64>()
            .max_readers(MAX_STATUS_READERS)
            .max_nodes(MAX_NODES)
            .add::<u64>(PHASE, 0)
            .add::<u64>(ASLEEP, 0)
            .add::<u64>(TICK, 0)
            .add::<u64>(AGREEMENT, agreement)
            .add::<u64>(EPOCH, 0)
            .add::<u64>(WAIT, 0)
            .create()
            .map_err(refused(format!(
                "create the status of {process} (is a process of that name already running under this prefix?)"
            )))?;
        let writer = service
            .writer_builder()
            .create()
            .map_err(refused("create a status writer"))?;
        let entry = |key| writer.entry::<u64>(&key).map_err(refused("create a status entry"));
        Ok(Self {
            phase: entry(PHASE)?,
            asleep: entry(ASLEEP)?,
            tick: entry(TICK)?,
            epoch: entry(EPOCH)?,
            wait: entry(WAIT)?,
            _writer: writer,
        })
    }

    /// The status of a process that takes the place of one that died. iceoryx2 never gives the entries of a dead writer free,
    /// so it is another service, the first that does not exist yet.
    pub fn create_again(node: &Node<ipc::Service>, process: &str, agreement: u64) -> Result<Self, LinkError> {
        let create = |start| Self::create_start(node, process, start, agreement);
        let mut created = create(1);
        for start in 2..=MAX_STARTS {
            if created.is_ok() {
                break;
            }
            created = create(start);
        }
        created
    }

    pub fn set_phase(&self, phase: u64) {
        self.phase.update_with_copy(phase);
    }

    /// It sleeps until a token comes on this channel, or on any.
    pub fn fall_asleep(&self, awaited: Option<Channel>) {
        self.asleep.update_with_copy(asleep(awaited));
    }

    pub fn wake_up(&self) {
        self.asleep.update_with_copy(0);
    }

    pub fn set_tick(&self, tick: u64) {
        self.tick.update_with_copy(tick);
    }

    pub fn set_epoch(&self, epoch_ns: u64) {
        self.epoch.update_with_copy(epoch_ns);
    }

    pub fn set_wait(&self, wait: TokenWait) {
        self.wait.update_with_copy(wait.to_word());
    }
}

/// The reading end: another process's status.
pub struct PeerStatus {
    /// Fingerprint of the scenario that the process runs.
    pub agreement: u64,
    phase: EntryHandle<ipc::Service, u64, u64>,
    asleep: EntryHandle<ipc::Service, u64, u64>,
    tick: EntryHandle<ipc::Service, u64, u64>,
    /// None from a driver that keeps no time.
    epoch: Option<EntryHandle<ipc::Service, u64, u64>>,
    wait: Option<EntryHandle<ipc::Service, u64, u64>>,
    _reader: Reader<ipc::Service, u64>,
}

impl PeerStatus {
    /// `Ok(None)` while the process has not created its status.
    pub fn open(node: &Node<ipc::Service>, process: &str) -> Result<Option<Self>, LinkError> {
        Self::open_start(node, process, 0)
    }

    /// The phase of the newest process of this name, as far as it is further than the one that is known.
    pub fn phase_of_later_starts(node: &Node<ipc::Service>, process: &str) -> u64 {
        // Not only up to the first that is not there: what a second dead one has left may have been removed meanwhile.
        let later = (1..=MAX_STARTS).filter_map(|start| Self::open_start(node, process, start).ok().flatten());
        later.map(|status| status.phase()).max().unwrap_or_default()
    }

    /// As [`PeerStatus::open`], of the `start`th process of this name.
    pub fn open_start(node: &Node<ipc::Service>, process: &str, start: u64) -> Result<Option<Self>, LinkError> {
        // Any refusal may be a half-made service of a process that is just starting: the caller's time limit decides.
        let Ok(service) = node
            .service_builder(&service_name(process, start)?)
            .blackboard_opener::<u64>()
            .open()
        else {
            return Ok(None);
        };
        let reader = service
            .reader_builder()
            .create()
            .map_err(refused("create a status reader"))?;
        let entry = |key| reader.entry::<u64>(&key).map_err(refused("open a status entry"));
        let agreement = *entry(AGREEMENT)?.get();
        Ok(Some(Self {
            agreement,
            phase: entry(PHASE)?,
            asleep: entry(ASLEEP)?,
            tick: entry(TICK)?,
            epoch: entry(EPOCH).ok(),
            wait: entry(WAIT).ok(),
            _reader: reader,
        }))
    }

    pub fn phase(&self) -> u64 {
        *self.phase.get()
    }

    /// It is to be woken for a token on this channel.
    pub fn sleeps_for(&self, channel: Channel) -> bool {
        is_woken(*self.asleep.get(), channel)
    }

    pub fn tick(&self) -> u64 {
        *self.tick.get()
    }

    pub fn epoch_ns(&self) -> u64 {
        self.epoch.as_ref().map_or(0, |epoch| *epoch.get())
    }

    pub fn standing(&self) -> Standing {
        Standing {
            phase: self.phase(),
            tick: self.tick(),
            wait: self.wait.as_ref().and_then(|wait| TokenWait::from_word(*wait.get())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards what an onlooker reads: any wait comes back from its word, and a word that was never written is none.
    #[test]
    fn a_wait_comes_back_from_its_word() {
        assert_eq!(TokenWait::from_word(0), None);
        for reader in NodeId::LOOP_ORDER {
            for channel in Channel::ALL {
                let wait = TokenWait {
                    reader,
                    channel,
                    tick: 0xffff_ffff_fffe,
                };
                assert_eq!(TokenWait::from_word(wait.to_word()), Some(wait));
            }
        }
    }

    // Guards that nobody sleeps on beside what it waits for, and that nobody is woken for anything else.
    #[test]
    fn a_sleeper_is_woken_for_what_it_waits_for() {
        for channel in Channel::ALL {
            assert!(!is_woken(0, channel));
            assert!(is_woken(asleep(None), channel));
            for awaited in Channel::ALL {
                assert_eq!(is_woken(asleep(Some(awaited)), channel), awaited == channel);
            }
        }
    }
}
