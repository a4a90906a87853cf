//! A prefix and a root that no other test has, and the proof that nothing of them is left.

use anhyst_ipc::{NodeId, SharedSettings, Wait};
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

static NEXT: AtomicU64 = AtomicU64::new(0);

/// iceoryx2 resources of one test; removed when dropped.
#[derive(Debug)]
pub struct SharedMemory {
    /// Prefix of every file in /dev/shm.
    pub prefix: String,
    /// Directory of iceoryx2's files.
    pub root: PathBuf,
}

impl SharedMemory {
    /// New resources.
    pub fn unique() -> Self {
        let id = format!("{}_{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Self {
            prefix: format!("anhysttest_{id}_"),
            // Not on a disk: while other tests keep it busy, files take seconds to make.
            root: PathBuf::from(format!("/dev/shm/anhystroot-{id}")),
        }
    }

    /// Settings of one process of a test.
    pub fn settings(&self, process: &str, processes: &[(&str, &[NodeId])], receive_limit: Duration) -> SharedSettings {
        SharedSettings {
            prefix: self.prefix.clone(),
            root: self.root.clone(),
            process: process.into(),
            processes: processes
                .iter()
                .map(|(name, nodes)| ((*name).to_owned(), nodes.to_vec()))
                .collect(),
            agreement: 7,
            wait: Wait::Notified { yields: 20 },
            receive_limit,
            start_limit: Duration::from_secs(20),
        }
    }

    /// What a process of somebody else's making is told of them.
    pub fn variables(&self, process: &str, processes: &str) -> [(&'static str, OsString); 5] {
        [
            ("ANHYST_PROCESS", process.into()),
            ("ANHYST_SERVICE_PREFIX", self.prefix.clone().into()),
            ("ANHYST_ROOT", self.root.clone().into()),
            ("ANHYST_PROCESSES", processes.into()),
            ("ANHYST_TICK_S", "5e-5".into()),
        ]
    }

    /// Files in /dev/shm that bear the prefix.
    pub fn files(&self) -> Vec<String> {
        files_with(&self.prefix)
    }
}

/// Files in /dev/shm whose name begins with `prefix`.
pub fn files_with(prefix: &str) -> Vec<String> {
    let entries = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(prefix))
        .collect()
}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        for file in self.files() {
            let _ = std::fs::remove_file(PathBuf::from("/dev/shm").join(file));
        }
        let _ = std::fs::remove_dir_all(&self.root);
    }
}
