//! `anhyst run`: a scenario from start to verdict; several are compared.

use super::failed::failed;
use super::run_arguments::{AloneArguments, RunArguments};
use super::{Ending, progress_bar};
use crate::arguments::{SetArguments, beside};
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::launcher::LaunchError;
use anhyst_launch::report::ProcessReport;
use anhyst_launch::say::quoted;
use anhyst_launch::summary::Summary;
use anhyst_launch::{launcher, resources, signals, tuning};
use anhyst_scenario::{Placement, Scenario, load_changed};
use std::path::Path;
use std::time::Duration;

/// Runs the command.
///
/// # Errors
/// Bad input; a process that fails is an [`Ending`].
pub fn run(arguments: &RunArguments) -> miette::Result<Ending> {
    signals::install();
    refuse_separate_port(arguments)?;
    let of_one = arguments.plot.is_some().then_some("--plot");
    match (&arguments.scenarios[..], arguments.alone.given().or(of_one)) {
        ([scenario], _) => alone(scenario, arguments),
        (several, Some(option)) => Err(miette::miette!(
            "{option} is for one scenario; {} are run embedded, in this process",
            several.len()
        )),
        (several, None) => super::several::run(several, arguments),
    }
}

/// A scenario with what the command line says of it, and checked with that: a fault may not suit it.
///
/// # Errors
/// Bad input.
pub(super) fn changed(
    scenario: &Path,
    set: &SetArguments,
    embedded: bool,
    arguments: &AloneArguments,
) -> miette::Result<Scenario> {
    let scenario = load_changed(scenario, &set.settings, |scenario| {
        if embedded {
            scenario.placement = Placement::Embedded;
        }
        add_external(scenario, arguments);
    })?;
    refuse_two_commands(arguments)?;
    if arguments.dedicated_cores && scenario.placement == Placement::Embedded {
        miette::bail!("--dedicated-cores is for processes that wait for each other; an embedded run is one process");
    }
    Ok(scenario)
}

fn alone(scenario: &Path, all: &RunArguments) -> miette::Result<Ending> {
    let arguments = &all.alone;
    let out = all.out.out.as_deref();
    beside(out, "scenario.ron", scenario)?;
    let mut scenario = changed(scenario, &all.set, all.embedded, arguments)?;
    super::part::validate(all, &scenario)?;
    if all.no_recording {
        scenario.recording.on = false;
    }
    if arguments.live.is_some() {
        scenario.recording.live_port = arguments.live;
    }
    if let Some(port) = scenario.recording.live_port.filter(|_| scenario.recording.on) {
        crate::complain!("watch: rerun rerun+http://127.0.0.1:{port}/proxy");
    }
    let (folder, outcome) = perform(&scenario, arguments, out)?;
    match outcome {
        Ok(reports) if arguments.across.is_part() => super::part::finish(&scenario, &folder, &reports, all.json.json),
        Ok(reports) => finish(&scenario, &folder, &reports, all),
        Err(error) => {
            let left = format!("what was recorded until then is in {}", folder.path().display());
            Ok(failed(&error, &left, all.json.json))
        }
    }
}

/// Runs a scenario, in this process or in several; its folder and what came of it.
///
/// # Errors
/// Names that somebody else uses, a folder that cannot be had.
pub(super) fn perform(
    scenario: &Scenario,
    arguments: &AloneArguments,
    out: Option<&Path>,
) -> miette::Result<(RunFolder, Result<Vec<ProcessReport>, RunError>)> {
    let meeting = resources::Resources::chosen(
        arguments.meeting.service_prefix.as_deref(),
        arguments.meeting.root.as_deref(),
    )
    .map_err(|sentence| miette::miette!("{sentence}"))?;
    // An embedded run has nothing there to keep.
    let claims = (scenario.placement != Placement::Embedded).then(|| meeting.claim());
    let _claimed = claims.transpose().map_err(|sentence| miette::miette!("{sentence}"))?;
    if scenario.placement != Placement::Embedded {
        resources::sweep();
        // Before there is a folder: nothing will be in it.
        resources::shared_memory_left().map_err(|sentence| RunError::from(LaunchError::SharedMemory(sentence)))?;
    }
    let folder = prepare(scenario, out)?;
    if scenario.placement != Placement::Embedded {
        tuning::announce(&folder, &meeting)?;
    }
    let bar = progress_bar(scenario.ticks(), &scenario.name);
    let outcome = if scenario.placement == Placement::Embedded {
        embedded(scenario, &folder, &mut |tick| bar.set_position(tick))
    } else {
        let options = launcher::Options {
            waits: if arguments.across.is_part() && !arguments.dedicated_cores {
                launcher::Waits::shared()
            } else {
                launcher::Waits::of(scenario, arguments.dedicated_cores)
            },
            reverse_start: arguments.reverse_start,
            resources: meeting,
            start_limit: Duration::from_secs_f64(arguments.meeting.start_limit_s),
            commands: arguments.external_commands.clone(),
            across: arguments.across.clone(),
        };
        launcher::launch(scenario, &folder, &options, &mut |tick| bar.set_position(tick)).map_err(RunError::from)
    };
    bar.finish_and_clear();
    Ok((folder, outcome))
}

/// # Errors
/// If a port stands behind `--live` as a word of its own.
fn refuse_separate_port(arguments: &RunArguments) -> miette::Result<()> {
    let mut names = arguments.scenarios.iter().filter_map(|scenario| scenario.to_str());
    match names.find(|name| arguments.alone.live.is_some() && name.parse::<u16>().is_ok()) {
        Some(port) => Err(miette::miette!("{port} is no scenario: write --live={port}")),
        None => Ok(()),
    }
}

/// # Errors
/// If a node would be started by two commands.
fn refuse_two_commands(arguments: &AloneArguments) -> miette::Result<()> {
    let mut known = Vec::new();
    for node in arguments.external_commands.iter().flat_map(|command| &command.nodes) {
        if known.contains(&node) {
            miette::bail!("{node} has two --external-command; it can have one");
        }
        known.push(node);
    }
    Ok(())
}

/// Works `--external` and `--external-command` into the scenario.
fn add_external(scenario: &mut Scenario, arguments: &AloneArguments) {
    let named = arguments.external.iter().flat_map(|nodes| &nodes.0);
    let commanded = arguments.external_commands.iter().flat_map(|command| &command.nodes);
    for node in named.chain(commanded) {
        if !scenario.external.contains(node) {
            scenario.external.push(*node);
        }
    }
}

fn finish(
    scenario: &Scenario,
    folder: &RunFolder,
    reports: &[ProcessReport],
    arguments: &RunArguments,
) -> miette::Result<Ending> {
    let summary = Summary::written(scenario, reports, folder)?;
    if let Some(path) = &arguments.plot {
        summary.draw(scenario, path)?;
    }
    if arguments.json.json {
        let told = summary
            .for_programs()
            .map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{}", super::json(&told)?);
    } else {
        crate::say!("{}\n", summary.sentence(scenario.expect.settling_s));
        for noticed in &summary.verdict.noticed {
            crate::say!("noticed: {noticed}");
        }
        for warning in &summary.warnings {
            crate::say!("warning: {warning}");
        }
        crate::say!("{}", summary.table());
        if let Some(latencies) = summary.latencies().filter(|_| arguments.alone.latencies) {
            crate::say!("\n{latencies}");
        }
        crate::say!("results: {} (report.html)", folder.path().display());
        if let Some(path) = &arguments.plot {
            crate::say!("picture: {}", path.display());
        }
        if scenario.recording.on {
            crate::say!("look at it: anhyst view {}", quoted(folder.path()));
        }
    }
    Ok(if summary.failures.is_empty() {
        Ending::Held
    } else {
        Ending::NotHeld
    })
}
