//! Child processes: started, looked at, signalled and ended in one way, whatever they are started for.
//!
//! A child that has ended is not reaped before [`end_all`]: until then its number, which is also that of its group, cannot be
//! given to anybody else.

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, kill_process_group, waitid};
use std::io::Read as _;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// How often children are looked at: well within the two seconds in which a death must be reported.
pub const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// What a user's program that was asked to end gets before it is killed.
pub const GRACE: Duration = Duration::from_millis(1200);
/// What one of ours gets: it brings the field to safety within 1.1 s, and writes its last results, on a machine that has time
/// for it. One that a signal has stopped gets none.
const GRACE_OF_OURS: Duration = Duration::from_secs(6);

/// How a process has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// With this exit status.
    Status(i32),
    /// By this signal.
    Signal(i32),
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            End::Status(status) => write!(f, "ended with exit status {status}"),
            End::Signal(signal) => write!(f, "was killed by signal {signal}"),
        }
    }
}

/// What a child does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It lives.
    Runs,
    /// A signal has stopped it, and nobody has woken it yet.
    Stopped,
    /// It has ended.
    Ended(End),
}

/// A child process.
#[derive(Debug)]
pub struct Supervised {
    child: Child,
    pid: Pid,
    is_group: bool,
    state: State,
    reaped: bool,
    /// Its standard output, if it tells us things there, and what of it is no whole line yet.
    told: Option<ChildStdout>,
    heard: Vec<u8>,
}

impl Supervised {
    /// Starts a program of ours; [`Supervised::lines`] gives what it writes to its standard output.
    ///
    /// # Errors
    /// What the system says.
    pub fn start(command: &mut Command) -> std::io::Result<Self> {
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
        let told = child.stdout.take();
        if let Some(told) = &told {
            rustix::io::ioctl_fionbio(told, true)?;
        }
        Self::new(child, false, told)
    }

    /// Starts a user's command with a shell, in a process group of its own, so that all that it starts can be ended with it.
    /// Its output goes to `log`.
    ///
    /// # Errors
    /// What the system says.
    pub fn start_command(
        command: &str,
        environment: &[(&'static str, String)],
        log: std::fs::File,
    ) -> std::io::Result<Self> {
        use std::os::unix::process::CommandExt;
        let child = Command::new("sh")
            .args(["-c", command])
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(log.try_clone()?)
            .stderr(log)
            .process_group(0)
            .spawn()?;
        Self::new(child, true, None)
    }

    fn new(child: Child, is_group: bool, told: Option<ChildStdout>) -> std::io::Result<Self> {
        let pid = Pid::from_raw(child.id() as i32).ok_or(std::io::ErrorKind::NotFound)?;
        Ok(Self {
            child,
            pid,
            is_group,
            state: State::Runs,
            reaped: false,
            told,
            heard: Vec::new(),
        })
    }

    /// What it does now.
    pub fn look(&mut self) -> State {
        if !matches!(self.state, State::Ended(_)) {
            let present =
                WaitIdOptions::EXITED | WaitIdOptions::STOPPED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
            self.state = match waitid(WaitId::Pid(self.pid), present) {
                Ok(Some(status)) => match (status.exit_status(), status.terminating_signal()) {
                    (Some(status), _) => State::Ended(End::Status(status)),
                    (None, Some(signal)) => State::Ended(End::Signal(signal)),
                    (None, None) => State::Stopped,
                },
                // A look that a signal disturbs is as good as none.
                Ok(None) | Err(_) => State::Runs,
            };
        }
        self.state
    }

    /// What it did when it was looked at last.
    pub fn state(&self) -> State {
        self.state
    }

    /// How it has ended.
    pub fn end(&self) -> Option<End> {
        match self.state {
            State::Ended(end) => Some(end),
            State::Runs | State::Stopped => None,
        }
    }

    /// True if it has ended otherwise than with exit status 0.
    pub fn has_failed(&self) -> bool {
        self.end().is_some_and(|end| end != End::Status(0))
    }

    /// A signal ended it; of a user's command the shell may tell, with a status of 128 and the signal.
    pub fn was_killed(&self) -> bool {
        match self.end() {
            Some(End::Signal(_)) => true,
            Some(End::Status(status)) => self.is_group && (129..=192).contains(&status),
            None => false,
        }
    }

    /// The whole lines that it has written to its standard output since this was asked last.
    pub fn lines(&mut self) -> Vec<String> {
        let Some(told) = &mut self.told else { return Vec::new() };
        let mut buffer = [0; 4096];
        while let Ok(bytes @ 1..) = told.read(&mut buffer) {
            self.heard.extend_from_slice(&buffer[..bytes]);
        }
        let whole = self
            .heard
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |last| last + 1);
        let lines: Vec<u8> = self.heard.drain(..whole).collect();
        String::from_utf8_lossy(&lines).lines().map(str::to_owned).collect()
    }

    /// Signals it, and what a user's command has started, also if its shell has ended.
    pub fn signal(&self, signal: Signal) {
        // Who has just ended by itself cannot be signalled; that is what was wanted.
        let _ = match self.is_group {
            true => kill_process_group(self.pid, signal),
            false if self.end().is_none() => kill_process(self.pid, signal),
            false => Ok(()),
        };
    }

    fn kill(&mut self) {
        self.signal(Signal::KILL);
        if !self.reaped {
            self.reaped = self.child.wait().is_ok();
        }
    }

    fn grace(&self) -> Duration {
        match (self.state, self.is_group) {
            (State::Stopped, _) => Duration::ZERO,
            (_, true) => GRACE,
            (_, false) => GRACE_OF_OURS,
        }
    }

    /// True as long as it, or of a user's command anything that it has started, has not ended. Reaps what has ended.
    fn lives(&mut self) -> bool {
        self.look();
        if self.end().is_some() && !self.reaped {
            // It has ended: this does not wait.
            self.reaped = self.child.wait().is_ok();
        }
        match self.is_group {
            true => rustix::process::test_kill_process_group(self.pid).is_ok(),
            false => self.end().is_none(),
        }
    }
}

impl Drop for Supervised {
    fn drop(&mut self) {
        if !self.reaped {
            self.kill();
        }
    }
}

/// Asks all that still runs to end, kills what does not, and reaps.
pub fn end_all<'a>(children: impl IntoIterator<Item = &'a mut Supervised>) {
    let mut left: Vec<&mut Supervised> = children.into_iter().filter(|child| !child.reaped).collect();
    left.iter().for_each(|child| child.signal(Signal::TERM));
    let begin = Instant::now();
    while !left.is_empty() {
        left.retain_mut(|child| {
            let waits = child.lives() && begin.elapsed() < child.grace();
            if !waits && child.lives() {
                child.kill();
            }
            waits
        });
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(text: &str) -> Supervised {
        let log = std::fs::File::create("/dev/null").unwrap();
        Supervised::start_command(text, &[], log).unwrap()
    }

    fn wait_for(child: &mut Supervised, wanted: State) {
        while child.look() != wanted {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    // Guards the difference between a process that does nothing and one that a signal has stopped, and that waking is seen.
    #[test]
    fn a_stopped_child_is_told_from_one_that_runs() {
        let mut child = command("exec sleep 1000");
        assert_eq!(child.look(), State::Runs);
        child.signal(Signal::STOP);
        wait_for(&mut child, State::Stopped);
        assert_eq!(child.look(), State::Stopped);
        child.signal(Signal::CONT);
        wait_for(&mut child, State::Runs);
        child.signal(Signal::KILL);
        wait_for(&mut child, State::Ended(End::Signal(9)));
        assert!(child.was_killed());
    }

    // Guards against a driver that goes on in the background after its shell has ended: the run's end is its end.
    #[test]
    fn what_a_command_has_started_ends_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let noted = folder.path().join("pid");
        // It does not heed a request to end.
        let text = format!("trap '' TERM; sleep 1000 & echo $! > {}", noted.display());
        let mut child = command(&text);
        wait_for(&mut child, State::Ended(End::Status(0)));
        let pid: i32 = std::fs::read_to_string(&noted).unwrap().trim().parse().unwrap();
        let stat = format!("/proc/{pid}/stat");
        assert!(std::fs::read_to_string(&stat).is_ok());
        end_all([&mut child]);
        // Its new parent may take a moment to reap it.
        while std::fs::read_to_string(&stat).is_ok_and(|stat| !stat.contains(") Z ")) {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn lines_are_given_when_they_are_whole() {
        let mut child =
            Supervised::start(Command::new("sh").args(["-c", "printf 'one\\ntw'; sleep 0.1; echo o"])).unwrap();
        let mut heard = Vec::new();
        while heard.len() < 2 {
            heard.extend(child.lines());
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(heard, ["one", "two"]);
    }
}
