//! Starts the processes of a run, watches them, ends what it started, and leaves no shared memory behind.

mod restart;

use crate::folder::RunFolder;
use crate::realtime::Restart;
use crate::report::ProcessReport;
use crate::resources::Resources;
use crate::scenario::Scenario;
use anhyst_ipc::{Observer, stop_requested};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How often the children are looked at: well within the two seconds in which a death must be reported.
const WATCH_PERIOD: Duration = Duration::from_millis(10);
/// What the others get to complain, too, when a process gives up waiting.
const SETTLING: Duration = Duration::from_millis(300);
/// What a child that was asked to end gets before it is killed: time for the recorder to write its last block.
const GRACE: Duration = Duration::from_millis(1200);

/// Why a run of processes did not reach its end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LaunchError {
    /// A process could not be started.
    #[error("{process} could not be started: {cause}")]
    Spawn {
        /// Which.
        process: String,
        /// What the system says.
        cause: String,
    },
    /// A process died.
    #[error("{process} {how} at tick {tick} of {ticks}{detail}")]
    Died {
        /// Which.
        process: String,
        /// Exit status in words.
        how: String,
        /// How far the plant had come.
        tick: u64,
        /// How far it should have come.
        ticks: u64,
        /// What the process said last, with a colon before it, or nothing.
        detail: String,
    },
    /// The user asked to stop.
    #[error("stopped on request at tick {tick} of {ticks}")]
    Interrupted {
        /// How far the plant had come.
        tick: u64,
        /// How far it should have come.
        ticks: u64,
    },
    /// A process ended well but left no report.
    #[error("{process} left no readable report: {cause}")]
    NoReport {
        /// Which.
        process: String,
        /// Why.
        cause: String,
    },
    /// The run's files in shared memory could not be removed.
    #[error("the run's shared memory could not be removed: {cause}")]
    Cleanup {
        /// What the system says.
        cause: String,
    },
}

/// How processes are started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Polls before a waiting process sleeps.
    pub yields: u32,
    /// Last process first: the result must not depend on it.
    pub reverse_start: bool,
}

struct Running {
    name: String,
    child: Child,
    ended: Option<ExitStatus>,
    /// How earlier processes of this name ended.
    restarts: Vec<Restart>,
}

impl Running {
    fn failed(&self) -> bool {
        self.ended.is_some_and(|status| !status.success())
    }

    /// A signal ended it.
    fn killed(&self) -> bool {
        self.ended.is_some_and(|status| status.code().is_none())
    }
}

/// Runs a scenario's processes to the end; `progress` hears the plant's ticks.
///
/// # Errors
/// The first process that failed, by name. All processes have ended and the shared memory is clean in either case.
pub fn launch(
    scenario: &Scenario,
    folder: &RunFolder,
    options: Options,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<ProcessReport>, LaunchError> {
    let resources = Resources::unique();
    let mut children = Vec::new();
    let outcome = start(scenario, folder, options, &resources, &mut children)
        .and_then(|()| watch(scenario, folder, options, &resources, &mut children, progress));
    end(&mut children);
    resources.remove().map_err(|error| LaunchError::Cleanup {
        cause: error.to_string(),
    })?;
    outcome?;
    children
        .iter()
        .map(|running| {
            let report = read_report(folder, &running.name)?;
            Ok(ProcessReport {
                restarts: running.restarts.clone(),
                ..report
            })
        })
        .collect()
}

fn start(
    scenario: &Scenario,
    folder: &RunFolder,
    options: Options,
    resources: &Resources,
    children: &mut Vec<Running>,
) -> Result<(), LaunchError> {
    let mut processes = scenario.placement.processes();
    if options.reverse_start {
        processes.reverse();
    }
    for (name, nodes) in processes {
        let first = nodes.first().map_or("", |node| node.name());
        let child = spawn(&name, first, folder, options, resources, false)?;
        children.push(Running {
            name,
            child,
            ended: None,
            restarts: Vec::new(),
        });
    }
    Ok(())
}

/// Starts the process `name`, by the name of its `first` node; `again` if it takes the place of one that died.
fn spawn(
    name: &str,
    first: &str,
    folder: &RunFolder,
    options: Options,
    resources: &Resources,
    again: bool,
) -> Result<Child, LaunchError> {
    let refused = |cause: std::io::Error| LaunchError::Spawn {
        process: name.into(),
        cause: cause.to_string(),
    };
    let program = std::env::current_exe().map_err(refused)?;
    let log = std::fs::OpenOptions::new()
        .create(true)
        .write(true)
        .truncate(!again)
        .append(again)
        .open(folder.log(name))
        .map_err(refused)?;
    Command::new(program)
        .arg(first)
        .arg(folder.scenario())
        .arg("--out")
        .arg(folder.path())
        .args([
            "--service-prefix",
            &resources.prefix,
            "--yields",
            &options.yields.to_string(),
            "--end-with-launcher",
        ])
        .arg("--root")
        .arg(&resources.root)
        .args(again.then_some("--rejoin"))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(log)
        .spawn()
        .map_err(refused)
}

fn watch(
    scenario: &Scenario,
    folder: &RunFolder,
    options: Options,
    resources: &Resources,
    children: &mut [Running],
    progress: &mut dyn FnMut(u64),
) -> Result<(), LaunchError> {
    let ticks = scenario.ticks();
    let plant = children
        .iter()
        .map(|running| running.name.clone())
        .find(|name| name.contains("plant-sim"));
    // Without an observer there is only no progress; the run itself does not need it.
    let mut observer = Observer::open(&resources.prefix, &resources.root).ok();
    let mut tick = 0;
    loop {
        if let (Some(observer), Some(plant)) = (&mut observer, &plant) {
            tick = observer.tick_of(plant).unwrap_or(tick);
            progress(tick);
        }
        if stop_requested() {
            return Err(LaunchError::Interrupted { tick, ticks });
        }
        look(children);
        restart::restart(scenario, folder, options, resources, children, tick)?;
        if children.iter().any(Running::failed) {
            if !children.iter().any(Running::killed) {
                // Whoever waits for the same culprit gives up within moments: then the chain of complaints is whole.
                std::thread::sleep(SETTLING);
                look(children);
            }
            return Err(verdict(children, folder, tick, ticks));
        }
        if children.iter().all(|running| running.ended.is_some()) {
            return Ok(());
        }
        std::thread::sleep(WATCH_PERIOD);
    }
}

fn look(children: &mut [Running]) {
    for running in children.iter_mut().filter(|running| running.ended.is_none()) {
        running.ended = running.child.try_wait().ok().flatten();
    }
}

fn verdict(children: &[Running], folder: &RunFolder, tick: u64, ticks: u64) -> LaunchError {
    let Some(culprit) = culprit(children, folder) else {
        return LaunchError::Interrupted { tick, ticks };
    };
    LaunchError::Died {
        process: culprit.name.clone(),
        how: describe(culprit.ended),
        tick,
        ticks,
        detail: last_words(folder, &culprit.name),
    }
}

/// Of the processes that failed, the one to blame: one that a signal ended comes before those that complain about it; else the
/// complaints "… but X is silent" are followed to the process that has none, be it dead or hung.
fn culprit<'a>(children: &'a [Running], folder: &RunFolder) -> Option<&'a Running> {
    if let Some(killed) = children.iter().find(|running| running.killed()) {
        return Some(killed);
    }
    let mut blamed = children.iter().find(|running| running.failed())?;
    for _ in children {
        let words = last_words(folder, &blamed.name);
        let silent = words
            .strip_suffix(" is silent")
            .and_then(|rest| rest.rsplit(' ').next());
        let Some(next) = silent.and_then(|node| {
            children
                .iter()
                .find(|running| running.name.split('+').any(|name| name == node))
        }) else {
            break;
        };
        blamed = next;
    }
    Some(blamed)
}

fn describe(status: Option<ExitStatus>) -> String {
    use std::os::unix::process::ExitStatusExt;
    match status.map(|status| (status.code(), status.signal())) {
        Some((Some(code), _)) => format!("ended with exit status {code}"),
        Some((None, Some(signal))) => format!("was killed by signal {signal}"),
        _ => "does not answer".into(),
    }
}

fn last_words(folder: &RunFolder, process: &str) -> String {
    let log = std::fs::read_to_string(folder.log(process)).unwrap_or_default();
    // A refusal's sentence is marked; the picture below it is for the log.
    let sentence = log
        .lines()
        .find_map(|line| line.trim().strip_prefix('×'))
        .or_else(|| log.lines().rfind(|line| !line.trim().is_empty()));
    sentence.map(|line| format!(": {}", line.trim())).unwrap_or_default()
}

/// Asks every child that still runs to end, then kills what has not.
fn end(children: &mut [Running]) {
    for running in children.iter_mut().filter(|running| running.ended.is_none()) {
        if let Some(pid) = rustix::process::Pid::from_raw(running.child.id() as i32) {
            // A child that has just ended by itself cannot be signalled; that is what was wanted.
            let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
        }
    }
    let start = Instant::now();
    for running in children.iter_mut() {
        while running.ended.is_none() && start.elapsed() < GRACE {
            running.ended = running.child.try_wait().ok().flatten();
            std::thread::sleep(Duration::from_millis(2));
        }
        if running.ended.is_none() {
            let _ = running.child.kill();
            running.ended = running.child.wait().ok();
        }
    }
}

fn read_report(folder: &RunFolder, process: &str) -> Result<ProcessReport, LaunchError> {
    let refused = |cause: String| LaunchError::NoReport {
        process: process.into(),
        cause,
    };
    let text = std::fs::read_to_string(folder.report(process)).map_err(|error| refused(error.to_string()))?;
    serde_json::from_str(&text).map_err(|error| refused(error.to_string()))
}
