//! The process that is tested, if the command starts it: in a process group of its own, watched, and ended.

use anhyst_ipc::request_stop;
use rustix::process::{Pid, Signal, kill_process_group};
use std::fs::File;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the process is looked at.
const LOOK: Duration = Duration::from_millis(10);
/// What a process that was asked to end gets before it is killed.
const GRACE: Duration = Duration::from_millis(1500);

#[derive(Default)]
struct Shared {
    ended: Mutex<Option<ExitStatus>>,
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
        let output = File::create(log)?;
        let child = Command::new("sh")
            .args(["-c", command])
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(output.try_clone()?)
            .stderr(output)
            .process_group(0)
            .spawn()?;
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
        let status = self.shared.ended.lock().ok().and_then(|ended| *ended)?;
        let how = match (status.code(), status.signal()) {
            (Some(code), _) => format!("ended with exit status {code}"),
            (None, Some(signal)) => format!("was killed by signal {signal}"),
            _ => "ended".into(),
        };
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

fn watch(mut child: Child, shared: &Shared) {
    let group = Pid::from_raw(child.id() as i32);
    let signal = |signal| {
        if let Some(group) = group {
            // A group that has just ended cannot be signalled; that is what was wanted.
            let _ = kill_process_group(group, signal);
        }
    };
    let mut asked: Option<Instant> = None;
    loop {
        if let Ok(Some(status)) = child.try_wait() {
            if let Ok(mut ended) = shared.ended.lock() {
                *ended = Some(status);
            }
            if !shared.may_leave.load(Ordering::Relaxed) && asked.is_none() {
                // Whoever waits for it need not wait to the end of its limit.
                request_stop();
            }
            // What it started may outlive it.
            signal(Signal::TERM);
            return;
        }
        match asked {
            None if shared.finish.load(Ordering::Relaxed) => {
                signal(Signal::TERM);
                asked = Some(Instant::now());
            }
            Some(since) if since.elapsed() > GRACE => signal(Signal::KILL),
            _ => {}
        }
        std::thread::sleep(LOOK);
    }
}
