//! A whole run in this process.

use crate::error::RunError;
use crate::folder::RunFolder;
use crate::process;
use crate::report::ProcessReport;
use anhyst_ipc::NodeId;
use anhyst_scenario::Scenario;

/// Creates the run's folder with the effective scenario in it, and what its learner begins with.
///
/// # Errors
/// If the folder cannot be written, or another run writes to it.
pub fn prepare(scenario: &Scenario, out: Option<&std::path::Path>) -> Result<RunFolder, RunError> {
    let refuse = |path: std::path::PathBuf| move |cause| RunError::Write { path, cause };
    let folder = RunFolder::create(out, &scenario.name)?;
    let written = as_saved(scenario, &folder)?;
    let from = |scenario: &Scenario| scenario.controller.learning.as_ref().and_then(|own| own.from.clone());
    if let (Some(from), Some(own)) = (from(scenario), from(&written))
        && from != own
    {
        std::fs::copy(&from, &own).map_err(refuse(own))?;
    }
    let text = written.to_ron().map_err(|error| RunError::Setup(error.to_string()))?;
    std::fs::write(folder.scenario(), text).map_err(refuse(folder.scenario()))?;
    Ok(folder)
}

/// The scenario as it stands in a run's folder: what the learner begins with is the run's own copy, because the next run may write over
/// where it came from.
///
/// # Errors
/// If the folder's path cannot be told.
pub fn as_saved(scenario: &Scenario, folder: &RunFolder) -> Result<Scenario, RunError> {
    let mut saved = scenario.clone();
    if let Some(from) = saved.controller.learning.as_mut().and_then(|own| own.from.as_mut()) {
        let path = folder.began_with();
        *from = std::path::absolute(&path).map_err(|cause| RunError::Write { path, cause })?;
    }
    Ok(saved)
}

/// Runs all nodes in this process.
///
/// # Errors
/// What went wrong in the loop.
pub fn embedded(
    scenario: &Scenario,
    folder: &RunFolder,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<ProcessReport>, RunError> {
    whole(scenario, Some(folder), progress)
}

/// Runs all nodes in this process and keeps nothing but what is reported: no folder, no recording.
///
/// # Errors
/// What went wrong in the loop.
pub fn judged(scenario: &Scenario) -> Result<Vec<ProcessReport>, RunError> {
    whole(scenario, None, &mut |_| ())
}

/// Assembles all nodes and runs none: what only shows when they are built is refused before a long work begins.
///
/// # Errors
/// What could not be assembled.
pub fn assembled(scenario: &Scenario) -> Result<(), RunError> {
    process::open("embedded", &NodeId::LOOP_ORDER, scenario, None, None).map(drop)
}

fn whole(
    scenario: &Scenario,
    folder: Option<&RunFolder>,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<ProcessReport>, RunError> {
    let report = process::run("embedded", &NodeId::LOOP_ORDER, scenario, folder, None, progress)?;
    match report.failure {
        Some(failure) => Err(RunError::Setup(failure.sentence)),
        None => Ok(vec![report]),
    }
}
