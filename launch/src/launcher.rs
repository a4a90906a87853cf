//! Starts the processes of a run, watches them, ends what it started, and leaves no shared memory behind.

pub mod error;
mod evidence;
mod hang_detector;
mod restart;
mod root_cause;

use crate::across::{AcrossArguments, BRIDGE};
use crate::external::{self, ExternalCommand};
use crate::folder::RunFolder;
use crate::realtime::Restart;
use crate::report::{Failure, ProcessReport};
use crate::resources::{self, Resources};
use crate::supervisor::{self, GRACE, LOOK_PERIOD, State, Supervised};
use anhyst_ipc::{NodeId, Observer, stop_requested};
use anhyst_scenario::{ProcessKind, Scenario};
pub use error::LaunchError;
use evidence::Evidence;
use hang_detector::{HangDetector, Stillness};
use std::collections::VecDeque;
use std::process::Command;
use std::time::{Duration, Instant};

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

struct Running {
    name: String,
    /// A user's command: it leaves no report.
    foreign: bool,
    child: Supervised,
    /// What it told that it failed of.
    failure: Option<Failure>,
    /// How earlier processes of this name ended.
    restarts: Vec<Restart>,
    /// Of the scenario's faults that stop it: for how long each, and when to wake it.
    stops: VecDeque<Duration>,
    wake_at: Option<Instant>,
    stillness: Stillness,
}

impl Running {
    /// Sees what it does and hears what it tells. Of what it fails of the first is the cause.
    fn look(&mut self) {
        self.child.look();
        let told = self.child.lines();
        let failure = told.iter().find_map(|line| Failure::heard(line));
        self.failure = self.failure.take().or(failure);
    }

    /// How it has ended, in words.
    fn how(&self) -> String {
        let end = || {
            self.child
                .end()
                .map_or_else(|| "does not answer".into(), |end| end.to_string())
        };
        self.stillness.describe().unwrap_or_else(end)
    }

    /// Wakes it when the time is over for which the scenario stops it. Others who stop it must wake it themselves.
    fn wake(&mut self) {
        if self.child.state() == State::Stopped && self.wake_at.is_none() {
            self.wake_at = self.stops.pop_front().map(|stop| Instant::now() + stop);
        }
        if self.wake_at.take_if(|at| *at <= Instant::now()).is_some() {
            self.child.signal(rustix::process::Signal::CONT);
        }
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
    resources::shared_memory_left().map_err(LaunchError::SharedMemory)?;
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
    supervisor::end_all(children.iter_mut().map(|running| &mut running.child));
    let cleaned = options.resources.remove().map_err(|error| LaunchError::Cleanup {
        cause: error.to_string(),
    });
    if let (Err(_), Err(unclean)) = (&outcome, &cleaned) {
        // Who died is said by the caller, and first of all.
        crate::complain!("{unclean}");
    }
    outcome.and(cleaned)?;
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
            failure: None,
            restarts: Vec::new(),
            stops: stops.collect(),
            wake_at: None,
            stillness: Stillness::default(),
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
) -> std::io::Result<Supervised> {
    let log = std::fs::OpenOptions::new()
        .create(true)
        .write(true)
        .truncate(!again)
        .append(again)
        .open(folder.log(name))?;
    // Of two who wait for the same absentee the launcher gives up first: it knows what to advise.
    let start_limit = options.start_limit + GRACE;
    let across = (name == BRIDGE).then(|| options.across.to_words());
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(nodes.first().map_or(vec![BRIDGE], |node| vec!["node", node.name()]))
        .arg(folder.scenario())
        .arg("--out")
        .arg(folder.path())
        .args(["--service-prefix", &options.resources.prefix])
        .args(["--yields", &options.yields.to_string()])
        .args(["--start-limit-s", &start_limit.as_secs_f64().to_string()])
        .args(["--end-with-launcher", &std::process::id().to_string()])
        .arg("--root")
        .arg(&options.resources.root)
        .args(across.into_iter().flatten())
        .args(again.then_some("--rejoin"))
        .stderr(log);
    Supervised::start(&mut command)
}

/// Starts a process by the user's command, or tells the user what to start.
fn start_external(
    name: &str,
    nodes: &[NodeId],
    scenario: &Scenario,
    folder: &RunFolder,
    options: &Options,
) -> std::io::Result<Option<Supervised>> {
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
    Supervised::start_command(&command.command, &environment, log).map(Some)
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
    let mut appearing: Vec<String> = processes.iter().map(|(name, _)| name.clone()).collect();
    let parts: Vec<(String, Vec<NodeId>)> = processes
        .iter()
        .filter(|(_, nodes)| options.across.starts(nodes))
        .cloned()
        .collect();
    let evidence = Evidence {
        scenario,
        folder,
        parts: &parts,
    };
    let begin = Instant::now();
    let mut own_ended = None;
    let mut detector = HangDetector::of(scenario);
    let mut tick = 0;
    loop {
        if let Some(observer) = &mut observer {
            if let Some((plant, _)) = plant {
                tick = observer.tick_of(plant).unwrap_or(tick);
                progress(tick);
            }
            // Whoever is known can be read to its end, also when it has gone.
            appearing.retain(|process| observer.tick_of(process).is_none());
            let awaited = external.iter().find(|process| appearing.contains(process));
            if let Some(process) = awaited.filter(|_| begin.elapsed() > options.start_limit) {
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
        children.iter_mut().for_each(Running::look);
        children.iter_mut().for_each(Running::wake);
        if let (Some(detector), Some(observer)) = (&mut detector, &mut observer) {
            detector.look(observer, children, tick);
        }
        restart::restart(scenario, folder, options, children, (tick, observer.as_mut()))?;
        let failed = |running: &Running| {
            running.child.has_failed() || running.failure.is_some() && !restart::may_come_back(scenario, running)
        };
        if children.iter().any(failed) || evidence.somebody_left(children, observer.as_mut()) {
            return Err(evidence.inquire(children, observer.as_mut(), tick));
        }
        if children
            .iter()
            .all(|running| running.foreign || running.child.end().is_some())
        {
            // A foreign program may need a moment after the last token; then it is ended like all that still runs.
            let since: &mut Instant = own_ended.get_or_insert_with(Instant::now);
            if children.iter().all(|running| running.child.end().is_some()) || since.elapsed() > GRACE {
                return Ok(());
            }
        }
        std::thread::sleep(LOOK_PERIOD);
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
