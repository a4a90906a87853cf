//! The process that is tested, if the command starts it: in a process group of its own, watched, and ended.

use anhyst_ipc::request_stop;
use anhyst_launch::supervisor::{self, End, LOOK_PERIOD, Supervised};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

#[derive(Default)]
struct Shared {
    ended: Mutex<Option<End>>,
    may_leave: AtomicBool,
    finish: AtomicBool,
}

/// A started process.
pub struct Driver {
    shared: Arc<Shared>,
    watcher: Option<JoinHandle<()>>,
    log: PathBuf,
}

impl Driver {
    /// Starts `command` with a shell; its output goes to `log`.
    ///
    /// # Errors
    /// What the system says.
    pub fn start(command: &str, environment: &[(&'static str, String)], log: &Path) -> std::io::Result<Self> {
        let child = Supervised::start_command(command, environment, File::create(log)?)?;
        let shared = Arc::new(Shared::default());
        let watched = shared.clone();
        Ok(Self {
            shared,
            watcher: Some(std::thread::spawn(move || watch(child, &watched))),
            log: log.to_owned(),
        })
    }

    /// From here on it is no fault if the process ends.
    pub fn may_leave(&self) {
        self.shared.may_leave.store(true, Ordering::Relaxed);
    }

    /// How it ended, with what it said last; none while it lives.
    pub fn ended(&self) -> Option<String> {
        let how = self.shared.ended.lock().ok().and_then(|ended| *ended)?.to_string();
        let log = std::fs::read_to_string(&self.log).unwrap_or_default();
        let words = log.lines().rfind(|line| !line.trim().is_empty());
        Some(words.map_or_else(|| how.clone(), |words| format!("{how}: {}", words.trim())))
    }

    /// Ends it, and all that it started, if it still runs.
    pub fn end(&mut self) {
        self.shared.finish.store(true, Ordering::Relaxed);
        if let Some(watcher) = self.watcher.take() {
            // It panics nowhere; if it did, there would be nothing left to wait for.
            let _ = watcher.join();
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.end();
    }
}

fn watch(mut child: Supervised, shared: &Shared) {
    while !shared.finish.load(Ordering::Relaxed) {
        child.look();
        if let Some(end) = child.end() {
            if let Ok(mut ended) = shared.ended.lock() {
                *ended = Some(end);
            }
            if !shared.may_leave.load(Ordering::Relaxed) {
                // Whoever waits for it need not wait to the end of its limit.
                request_stop();
            }
            break;
        }
        std::thread::sleep(LOOK_PERIOD);
    }
    supervisor::end_all([&mut child]);
}
