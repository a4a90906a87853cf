//! What a process says about itself on its iceoryx2 blackboard: phase of the start, asleep or not, last finished tick.

use super::names::{AGREEMENT, ASLEEP, MOST_NODES, MOST_STATUS_READERS, PHASE, TICK, status_service};
use super::refused;
use crate::LinkError;
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;

fn service_name(process: &str) -> Result<ServiceName, LinkError> {
    ServiceName::new(&status_service(process)).map_err(refused("name a status service"))
}

/// The writing end: one process's own status.
pub struct OwnStatus {
    phase: EntryHandleMut<ipc::Service, u64, u64>,
    asleep: EntryHandleMut<ipc::Service, u64, u64>,
    tick: EntryHandleMut<ipc::Service, u64, u64>,
    _writer: Writer<ipc::Service, u64>,
}

impl OwnStatus {
    pub fn create(node: &Node<ipc::Service>, process: &str, agreement: u64) -> Result<Self, LinkError> {
        let service = node
            .service_builder(&service_name(process)?)
            .blackboard_creator::<u64>()
            .max_readers(MOST_STATUS_READERS)
            .max_nodes(MOST_NODES)
            .add::<u64>(PHASE, 0)
            .add::<u64>(ASLEEP, 0)
            .add::<u64>(TICK, 0)
            .add::<u64>(AGREEMENT, agreement)
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
            _writer: writer,
        })
    }

    pub fn set_phase(&self, phase: u64) {
        self.phase.update_with_copy(phase);
    }

    pub fn set_asleep(&self, asleep: bool) {
        self.asleep.update_with_copy(u64::from(asleep));
    }

    pub fn set_tick(&self, tick: u64) {
        self.tick.update_with_copy(tick);
    }
}

/// The reading end: another process's status.
pub struct PeerStatus {
    /// Fingerprint of the scenario that the process runs.
    pub agreement: u64,
    phase: EntryHandle<ipc::Service, u64, u64>,
    asleep: EntryHandle<ipc::Service, u64, u64>,
    tick: EntryHandle<ipc::Service, u64, u64>,
    _reader: Reader<ipc::Service, u64>,
}

impl PeerStatus {
    /// `Ok(None)` while the process has not created its status.
    pub fn open(node: &Node<ipc::Service>, process: &str) -> Result<Option<Self>, LinkError> {
        // Any refusal may be a half-made service of a process that is just starting: the caller's time limit decides.
        let Ok(service) = node
            .service_builder(&service_name(process)?)
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
            _reader: reader,
        }))
    }

    pub fn phase(&self) -> u64 {
        *self.phase.get()
    }

    pub fn asleep(&self) -> bool {
        *self.asleep.get() != 0
    }

    pub fn tick(&self) -> u64 {
        *self.tick.get()
    }
}
