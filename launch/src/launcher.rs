//! Starts the processes of a run, watches them, ends what it started, and leaves no shared memory behind.

mod blame;
pub mod error;
mod restart;
mod stillness;

use crate::across::{AcrossArguments, BRIDGE};
use crate::external::{self, ExternalCommand};
use crate::folder::RunFolder;
use crate::realtime::Restart;
use crate::report::ProcessReport;
use crate::resources::Resources;
use anhyst_ipc::{NodeId, Observer, stop_requested};
use anhyst_scenario::{ProcessKind, Scenario};
use blame::Inquest;
pub use error::LaunchError;
use std::collections::VecDeque;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use stillness::{Stillness, Watchman};

/// How often the children are looked at: well within the two seconds in which a death must be reported.
const WATCH_PERIOD: Duration = Duration::from_millis(10);
/// What a child that was asked to end gets before it is killed: time for the recorder to write its last block.
const GRACE: Duration = Duration::from_millis(1200);

/// How processes are started.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Polls before a waiting process sleeps.
    pub yields: u32,
    /// Last process first: the result must not depend on it.
    pub reverse_start: bool,
    /// Where the processes meet.
    pub resources: Resources,
    /// How long external processes may take to come.
    pub start_limit: Duration,
    /// Commands that start external processes; those without one are started by somebody else.
    pub commands: Vec<ExternalCommand>,
    /// Which part of the run is here; a part gets a bridge beside its processes.
    pub across: AcrossArguments,
}

/// Who leaves with the last token may be looked at before the others have said that it was the last.
const AT_THE_END: Duration = Duration::from_millis(300);

struct Running {
    name: String,
    /// A user's command: in a process group of its own, and it leaves no report.
    foreign: bool,
    child: Child,
    ended: Option<ExitStatus>,
    /// How earlier processes of this name ended.
    restarts: Vec<Restart>,
    /// Of the scenario's faults that stop it: for how long each, and when to wake it.
    stops: VecDeque<Duration>,
    wake_at: Option<Instant>,
    stillness: Stillness,
    /// How much of its log has been looked at.
    heard_bytes: u64,
}

impl Running {
    /// True if it has written into its log since this was asked last.
    fn has_spoken(&mut self, folder: &RunFolder) -> bool {
        let bytes = std::fs::metadata(folder.log(&self.name)).map_or(0, |log| log.len());
        std::mem::replace(&mut self.heard_bytes, bytes) != bytes
    }

    /// How it has ended, in words.
    fn how(&self) -> String {
        self.stillness.describe().unwrap_or_else(|| blame::describe(self.ended))
    }

    fn failed(&self) -> bool {
        self.ended.is_some_and(|status| !status.success())
    }

    /// Signals a child, and what a user's command has started.
    fn signal(&self, signal: rustix::process::Signal) {
        let Some(pid) = rustix::process::Pid::from_raw(self.child.id() as i32) else {
            return;
        };
        // A child that has just ended by itself cannot be signalled; that is what was wanted.
        let _ = if self.foreign {
            rustix::process::kill_process_group(pid, signal)
        } else {
            rustix::process::kill_process(pid, signal)
        };
    }

    /// Wakes it when the time is over for which the scenario stops it. Others who stop it must wake it themselves.
    fn wake(&mut self) {
        let Some(pid) = rustix::process::Pid::from_raw(self.child.id() as i32).filter(|_| self.ended.is_none()) else {
            return;
        };
        if let Some(first) = self.stops.front() {
            let options = rustix::process::WaitIdOptions::STOPPED | rustix::process::WaitIdOptions::NOHANG;
            let stopped = rustix::process::waitid(rustix::process::WaitId::Pid(pid), options);
            if stopped.is_ok_and(|status| status.is_some()) {
                self.wake_at = Some(Instant::now() + *first);
                self.stops.pop_front();
            }
        }
        if self.wake_at.take_if(|at| *at <= Instant::now()).is_some() {
            // A process that has died meanwhile needs no waking.
            let _ = rustix::process::kill_process(pid, rustix::process::Signal::CONT);
        }
    }

    /// A signal ended it; of a user's command the shell may tell, with a status of 128 and the signal.
    fn killed(&self) -> bool {
        let by_signal = |code| self.foreign && (129..=192).contains(&code);
        self.ended.is_some_and(|status| status.code().is_none_or(by_signal))
    }
}

/// Runs a scenario's processes to the end; `progress` hears the plant's ticks.
///
/// # Errors
/// The first process that failed, by name. All processes have ended and the shared memory is clean in either case.
pub fn launch(
    scenario: &Scenario,
    folder: &RunFolder,
    options: &Options,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<ProcessReport>, LaunchError> {
    let mut children = Vec::new();
    let outcome = start(scenario, folder, options, &mut children)
        .and_then(|()| watch(scenario, folder, options, &mut children, progress));
    if let Err(LaunchError::Died { process, .. }) = &outcome
        && options.across.is_part()
        && process != BRIDGE
    {
        // Before the others are ended: the bridge tells the other host. Without it that host hears only that this one ends.
        let _ = std::fs::write(folder.died(), process);
    }
    end(&mut children);
    options.resources.remove().map_err(|error| LaunchError::Cleanup {
        cause: error.to_string(),
    })?;
    outcome?;
    children
        .iter()
        .filter(|running| !running.foreign)
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
    options: &Options,
    children: &mut Vec<Running>,
) -> Result<(), LaunchError> {
    let mut processes = scenario.placement.processes();
    let external = scenario.external_processes();
    if options.reverse_start {
        processes.reverse();
    }
    processes.retain(|(_, nodes)| options.across.starts(nodes));
    if options.across.is_part() {
        processes.push((BRIDGE.into(), Vec::new()));
    }
    for (name, nodes) in processes {
        let refused = |cause: std::io::Error| LaunchError::Spawn {
            process: name.clone(),
            cause: cause.to_string(),
        };
        let foreign = external.contains(&name);
        let stops = scenario.process_faults(&nodes).unwrap_or_default().into_iter();
        let stops = stops.filter_map(|(_, kind)| match kind {
            ProcessKind::Stop(stop_s) => Some(Duration::from_secs_f64(stop_s)),
            ProcessKind::Kill => None,
        });
        let child = if foreign {
            start_external(&name, &nodes, scenario, folder, options).map_err(refused)?
        } else {
            Some(start_own(&name, &nodes, folder, options, false).map_err(refused)?)
        };
        children.extend(child.map(|child| Running {
            name,
            foreign,
            child,
            ended: None,
            restarts: Vec::new(),
            stops: stops.collect(),
            wake_at: None,
            stillness: Stillness::default(),
            heard_bytes: 0,
        }));
    }
    Ok(())
}

/// Starts a process of ours; `again` if it takes the place of one that died.
fn start_own(
    name: &str,
    nodes: &[NodeId],
    folder: &RunFolder,
    options: &Options,
    again: bool,
) -> std::io::Result<Child> {
    let log = std::fs::OpenOptions::new()
        .create(true)
        .write(true)
        .truncate(!again)
        .append(again)
        .open(folder.log(name))?;
    // Of two who wait for the same absentee the launcher gives up first: it knows what to advise.
    let start_limit = options.start_limit + GRACE;
    let across = (name == BRIDGE).then(|| options.across.to_words());
    Command::new(std::env::current_exe()?)
        .arg(nodes.first().map_or(BRIDGE, |node| node.name()))
        .arg(folder.scenario())
        .arg("--out")
        .arg(folder.path())
        .args(["--service-prefix", &options.resources.prefix])
        .args(["--yields", &options.yields.to_string()])
        .args(["--start-limit-s", &start_limit.as_secs_f64().to_string()])
        .arg("--end-with-launcher")
        .arg("--root")
        .arg(&options.resources.root)
        .args(across.into_iter().flatten())
        .args(again.then_some("--rejoin"))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(log)
        .spawn()
}

/// Starts a process by the user's command, or tells the user what to start.
fn start_external(
    name: &str,
    nodes: &[NodeId],
    scenario: &Scenario,
    folder: &RunFolder,
    options: &Options,
) -> std::io::Result<Option<Child>> {
    let environment = external::environment(
        name,
        scenario,
        &options.resources,
        scenario.clock.receive_limit_s(),
        options.start_limit,
        options.yields,
    );
    let command = options
        .commands
        .iter()
        .find(|command| command.nodes.iter().any(|node| nodes.contains(node)));
    let Some(command) = command else {
        external::announce(name, &environment, folder.path(), options.start_limit);
        return Ok(None);
    };
    let log = std::fs::File::create(folder.log(name))?;
    external::spawn(&command.command, &environment, log).map(Some)
}

fn watch(
    scenario: &Scenario,
    folder: &RunFolder,
    options: &Options,
    children: &mut [Running],
    progress: &mut dyn FnMut(u64),
) -> Result<(), LaunchError> {
    let ticks = scenario.ticks();
    // Of a run in parts, the bridge says how far a plant on the other host is.
    let processes = scenario.placement.processes();
    let plant = processes.iter().find(|(_, nodes)| nodes.contains(&NodeId::Plant));
    // Without an observer there is only no progress; the run itself does not need it.
    let resources = &options.resources;
    let mut observer = Observer::open(&resources.prefix, &resources.root).ok();
    let mut external = scenario.external_processes();
    external.retain(|name| {
        processes
            .iter()
            .any(|(known, nodes)| known == name && options.across.starts(nodes))
    });
    let mut awaited = external.clone();
    let begin = Instant::now();
    let mut own_ended = None;
    let mut left_since = None;
    let mut watchman = Watchman::of(scenario);
    let mut tick = 0;
    loop {
        if let Some(observer) = &mut observer {
            if let Some((plant, _)) = plant {
                tick = observer.tick_of(plant).unwrap_or(tick);
                progress(tick);
            }
            awaited.retain(|process| observer.tick_of(process).is_none());
            if let Some(process) = awaited.first().filter(|_| begin.elapsed() > options.start_limit) {
                return Err(LaunchError::NobodyCame {
                    process: process.clone(),
                    limit_s: options.start_limit.as_secs_f64(),
                    prefix: resources.prefix.clone(),
                    root: resources.root.display().to_string(),
                });
            }
        }
        if stop_requested() {
            return Err(LaunchError::Interrupted { tick, ticks });
        }
        look(children);
        children.iter_mut().for_each(Running::wake);
        if let (Some(watchman), Some(observer)) = (&mut watchman, &mut observer) {
            watchman.look(observer, children, tick);
        }
        restart::restart(scenario, folder, options, children, (tick, observer.as_mut()))?;
        let inquest = Inquest {
            scenario,
            folder,
            external: &external,
            tick,
        };
        if observer
            .as_mut()
            .is_some_and(|observer| somebody_left(children, observer, ticks))
        {
            let since: &mut Instant = left_since.get_or_insert_with(Instant::now);
            if since.elapsed() > AT_THE_END {
                return Err(inquest.hold(children));
            }
        }
        // Whoever was told to end says so at once, and then may follow a guard that goes on: the run is to end now.
        let told_to_end = |running: &mut Running| running.has_spoken(folder) && inquest.was_told_to_end(running);
        if children.iter_mut().any(told_to_end) || children.iter().any(Running::failed) {
            return Err(inquest.hold(children));
        }
        if children
            .iter()
            .all(|running| running.foreign || running.ended.is_some())
        {
            // A foreign program may need a moment after the last token; then it is ended like all that still runs.
            let since: &mut Instant = own_ended.get_or_insert_with(Instant::now);
            if children.iter().all(|running| running.ended.is_some()) || since.elapsed() > GRACE {
                return Ok(());
            }
        }
        std::thread::sleep(WATCH_PERIOD);
    }
}

/// True if a user's command has ended well while none of our nodes in the loop has come to the last tick. The recorder may be
/// far behind, and where it is the only one of ours, nobody knows.
fn somebody_left(children: &[Running], observer: &mut Observer, ticks: u64) -> bool {
    let left = |running: &Running| running.foreign && running.ended.is_some();
    let in_the_loop =
        |running: &&Running| !running.foreign && ![BRIDGE, NodeId::Recorder.name()].contains(&&*running.name);
    let ours: Vec<&Running> = children.iter().filter(in_the_loop).collect();
    let mut is_at_the_end = |running: &&Running| observer.tick_of(&running.name).is_some_and(|tick| tick >= ticks);
    children.iter().any(left) && !ours.is_empty() && !ours.iter().any(&mut is_at_the_end)
}

fn look(children: &mut [Running]) {
    for running in children.iter_mut().filter(|running| running.ended.is_none()) {
        running.ended = running.child.try_wait().ok().flatten();
    }
}

/// Asks every child that still runs to end, then kills what has not.
fn end(children: &mut [Running]) {
    for running in children.iter_mut().filter(|running| running.ended.is_none()) {
        running.signal(rustix::process::Signal::TERM);
    }
    let start = Instant::now();
    for running in children.iter_mut() {
        while running.ended.is_none() && start.elapsed() < GRACE {
            running.ended = running.child.try_wait().ok().flatten();
            std::thread::sleep(Duration::from_millis(2));
        }
        if running.ended.is_none() {
            running.signal(rustix::process::Signal::KILL);
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
