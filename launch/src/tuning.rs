//! Changing settings of a run that goes on: found by its folder, checked as a scenario is, asked of its processes, written down.
//!
//! What was changed stands in the `changes` of the run's scenario: run or replayed again it gives the same bits.

use crate::embedded::as_saved;
use crate::error::RunError;
use crate::folder::RunFolder;
use crate::report::ProcessReport;
use crate::resources::{Resources, is_running};
use anhyst_ipc::{Change, NodeId, Tunable, request_changes};
use anhyst_scenario::{Scenario, load};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long a process may take to answer: a loop on a loaded machine answers every 64 ticks.
const ANSWER_LIMIT: Duration = Duration::from_secs(10);

fn setup(sentence: impl Into<String>) -> RunError {
    RunError::Setup(sentence.into())
}

fn unwritten(path: PathBuf) -> impl FnOnce(std::io::Error) -> RunError {
    move |cause| RunError::Write { path, cause }
}

/// Says in the run's folder where its processes meet.
///
/// # Errors
/// If it cannot be written.
pub fn announce(folder: &RunFolder, resources: &Resources) -> Result<(), RunError> {
    let text = serde_json::to_string(resources).map_err(|error| setup(error.to_string()))?;
    std::fs::write(folder.meeting(), text).map_err(unwritten(folder.meeting()))
}

/// The folder of a run that goes on: `run` itself, or under `runs/` the one of that name, or the only one whose scenario has that name.
///
/// # Errors
/// A sentence, if there is none, or more than one.
pub fn running(run: &Path) -> Result<RunFolder, RunError> {
    let goes_on = |folder: &RunFolder| meeting(folder).is_some_and(|resources| is_running(&resources.prefix));
    if run.is_dir() {
        let folder = RunFolder::open(run);
        return if goes_on(&folder) {
            Ok(folder)
        } else {
            Err(setup(format!(
                "{} is no run that goes on in processes of its own: it has ended, or is embedded",
                run.display()
            )))
        };
    }
    let runs = Path::new("runs");
    let own = RunFolder::open(&runs.join(run));
    if goes_on(&own) {
        return Ok(own);
    }
    let of_name = |folder: &RunFolder| {
        let scenario = load(&folder.scenario(), &[]);
        scenario.is_ok_and(|scenario| Path::new(&scenario.name) == run)
    };
    let entries = std::fs::read_dir(runs).into_iter().flatten().flatten();
    let folders = entries.map(|entry| RunFolder::open(&entry.path()));
    let mut found: Vec<RunFolder> = folders.filter(|folder| goes_on(folder) && of_name(folder)).collect();
    match (found.pop(), found.len()) {
        (Some(folder), 0) => Ok(folder),
        (None, _) => Err(setup(format!(
            "no run called {} goes on under runs/: name its folder",
            run.display()
        ))),
        (Some(_), others) => Err(setup(format!(
            "{} runs called {} go on under runs/: name the folder of one",
            others + 1,
            run.display()
        ))),
    }
}

/// Where a run's processes meet, if it says so.
pub fn meeting(folder: &RunFolder) -> Option<Resources> {
    serde_json::from_slice(&std::fs::read(folder.meeting()).ok()?).ok()
}

/// Changes settings of a run that goes on; each with the tick in which it takes effect. Those that one node takes have one tick.
///
/// # Errors
/// The first that cannot be, with value and limit: then none is changed. A process that does not answer.
pub fn tune(folder: &RunFolder, settings: &[(Tunable, f64)]) -> Result<(Scenario, Vec<Change>), RunError> {
    let resources = meeting(folder).ok_or_else(|| setup("the run does not say where its processes meet"))?;
    // One after the other: each is checked with those before it.
    let lock = File::open(folder.meeting()).and_then(|file| file.lock().map(|()| file));
    let _lock = lock.map_err(unwritten(folder.meeting()))?;
    let mut scenario = load(&folder.scenario(), &[]).map_err(|error| setup(error.to_string()))?;
    validate(&scenario, settings)?;
    let mut all = Vec::new();
    for node in [NodeId::Controller, NodeId::Recorder] {
        let own: Vec<(Tunable, f64)> = settings.iter().filter(|(set, _)| set.node() == node).copied().collect();
        if own.is_empty() {
            continue;
        }
        let asked = request_changes((&resources.prefix, &resources.root), node, &own, ANSWER_LIMIT)?;
        let tick =
            asked.ok_or_else(|| setup(format!("the run's {node} takes no change any more: it is at its end")))?;
        let changes: Vec<Change> = own
            .into_iter()
            .map(|(set, value)| Change { tick, set, value })
            .collect();
        scenario.add_changes(&changes);
        save(&scenario, folder)?;
        all.extend(changes);
    }
    Ok((scenario, all))
}

/// As if they had been stated for the tick after those that were made before.
fn validate(scenario: &Scenario, settings: &[(Tunable, f64)]) -> Result<(), RunError> {
    let taker = |set: Tunable| scenario.external_nodes().contains(&set.node());
    if let Some((set, _)) = settings.iter().find(|(set, _)| taker(*set)) {
        return Err(setup(format!(
            "{set}: the run's {} is somebody else's program",
            set.node()
        )));
    }
    let tick = scenario.changes.last().map_or(0, |change| change.tick);
    let mut told = scenario.clone();
    told.changes.extend(settings.iter().map(|(set, value)| Change {
        tick,
        set: *set,
        value: *value,
    }));
    told.validate().map_err(|invalid| setup(invalid.sentence))
}

/// In two steps, so that a process that is started again never reads a half.
fn save(scenario: &Scenario, folder: &RunFolder) -> Result<(), RunError> {
    let text = as_saved(scenario, folder)?
        .to_ron()
        .map_err(|error| setup(error.to_string()))?;
    let new = folder.scenario().with_extension("new.ron");
    std::fs::write(&new, text)
        .and_then(|()| std::fs::rename(&new, folder.scenario()))
        .map_err(unwritten(folder.scenario()))
}

/// The scenario with what was changed while it ran, which is written down.
///
/// # Errors
/// If it cannot be written.
pub fn as_it_ran(scenario: &Scenario, reports: &[ProcessReport], folder: &RunFolder) -> Result<Scenario, RunError> {
    let mut ran = scenario.clone();
    for report in reports {
        ran.add_changes(&report.changes);
    }
    if ran.changes.len() > scenario.changes.len() {
        save(&ran, folder)?;
    }
    Ok(ran)
}
