//! Starts the processes of a run, watches them, ends what it started, and leaves no shared memory behind.

pub mod error;
mod evidence;
mod hang_detector;
mod restart;
mod root_cause;
mod running;
mod start;
mod waits;

use crate::across::BRIDGE;
use crate::folder::RunFolder;
use crate::report::ProcessReport;
use crate::resources;
use crate::supervisor::{self, GRACE, LOOK_PERIOD};
use anhyst_ipc::{NodeId, Observer, stop_requested};
use anhyst_scenario::Scenario;
pub use error::LaunchError;
use evidence::Evidence;
use hang_detector::HangDetector;
use running::Running;
pub use start::Options;
use start::start;
use std::time::Instant;
pub use waits::Waits;

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
