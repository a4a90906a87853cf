//! What the threads of a bridge share.

use crate::error::BridgeError;
use crate::heartbeat::Heartbeat;
use crate::partition::Partition;
use crate::progress::Crossing;
use crate::settings::BridgeSettings;
use anhyst_ipc::{Progress, SharedSettings, Wait, request_stop};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A flag that one thread sets and others see.
#[derive(Debug, Default)]
pub struct Flag(AtomicBool);

impl Flag {
    /// Sets it.
    pub fn set(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// True once it was set.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

/// The state of a running bridge.
#[derive(Debug)]
pub struct State {
    pub settings: BridgeSettings,
    pub partition: Partition,
    pub crossing: Crossing,
    /// Where the processes of this side stand.
    pub here: Mutex<Vec<Progress>>,
    /// Where those of the other side stand.
    pub remote: Mutex<Vec<Progress>>,
    /// The sending ends for this side's readers exist.
    pub ports: Flag,
    /// They are connected.
    pub connected: Flag,
    /// All processes of both sides have come to the end.
    pub done: Flag,
    /// The other bridge says the same.
    pub other_done: Flag,
    /// The last heartbeat may go.
    pub over: Flag,
    failed: Flag,
    failure: Mutex<Option<BridgeError>>,
}

/// A panic of another thread does not make the data unusable: it is replaced as a whole.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl State {
    pub fn new(settings: BridgeSettings, partition: Partition) -> Self {
        Self {
            crossing: Crossing::new(&partition, settings.ticks),
            settings,
            partition,
            here: Mutex::default(),
            remote: Mutex::default(),
            ports: Flag::default(),
            connected: Flag::default(),
            done: Flag::default(),
            other_done: Flag::default(),
            over: Flag::default(),
            failed: Flag::default(),
            failure: Mutex::default(),
        }
    }

    /// Ends the bridge. The first failure counts.
    pub fn fail(&self, error: BridgeError) {
        lock(&self.failure).get_or_insert(error);
        self.failed.set();
        // A thread that still waits for the processes of this side looks at this only.
        request_stop();
    }

    pub fn failed(&self) -> bool {
        self.failed.is_set()
    }

    /// Why the bridge ends. That a process of this side has died is the reason of whatever else was noticed.
    pub fn failure(&self) -> Option<BridgeError> {
        let noticed = lock(&self.failure).clone()?;
        let died = self
            .settings
            .died
            .as_ref()
            .and_then(|path| std::fs::read_to_string(path).ok());
        Some(died.map_or(noticed, |process| BridgeError::Died { process }))
    }

    /// What the other bridge is told.
    pub fn heartbeat(&self) -> Heartbeat {
        Heartbeat {
            here: lock(&self.here).clone(),
            done: self.done.is_set(),
            farewell: self.failure().map(|failure| failure.to_string()),
        }
    }

    /// True if all processes of both sides have reached `phase`.
    pub fn all_at(&self, phase: u64) -> bool {
        let reached = |side: &Mutex<Vec<Progress>>, count: usize| {
            let side = lock(side);
            side.len() == count && side.iter().all(|progress| progress.phase >= phase)
        };
        reached(&self.here, self.partition.here.len()) && reached(&self.remote, self.partition.remote.len())
    }

    /// How this bridge joins the rendezvous of its side, under a name of its own.
    pub fn shared_settings(&self, name: &str) -> SharedSettings {
        let settings = &self.settings;
        SharedSettings {
            prefix: settings.prefix.clone(),
            root: settings.root.clone(),
            process: name.into(),
            processes: self.partition.here.clone(),
            agreement: settings.agreement,
            wait: Wait::Notified {
                yields: settings.yields,
            },
            receive_limit: settings.receive_limit,
            start_limit: settings.start_limit,
        }
    }
}
