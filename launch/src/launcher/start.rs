//! Starts the processes of a run: ours, and by their commands those of others.

use super::LaunchError;
use super::running::{Running, Stillness};
use super::waits::Waits;
use crate::across::{AcrossArguments, BRIDGE};
use crate::external::{self, ExternalCommand};
use crate::folder::RunFolder;
use crate::own_command;
use crate::resources::Resources;
use crate::supervisor::{GRACE, Supervised};
use anhyst_ipc::NodeId;
use anhyst_scenario::{ProcessKind, Scenario};
use std::time::Duration;

/// How processes are started.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// How they wait for each other, and where.
    pub waits: Waits,
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

/// Starts all that are to be here.
///
/// # Errors
/// The one that cannot be started.
pub(super) fn start(
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
pub(super) fn start_own(
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
    let mut command = own_command::command()?;
    command
        .args(nodes.first().map_or(vec![BRIDGE], |node| vec!["node", node.name()]))
        .arg(folder.scenario())
        .arg("--out")
        .arg(folder.path())
        .args(["--service-prefix", &options.resources.prefix])
        .args(["--yields", &options.waits.yields.to_string()])
        .args(["--start-limit-s", &start_limit.as_secs_f64().to_string()])
        .args(["--end-with-launcher", &std::process::id().to_string()])
        .arg("--root")
        .arg(&options.resources.root)
        .args(across.into_iter().flatten())
        .args(again.then_some("--rejoin"))
        .stderr(log);
    options.waits.start(nodes, || Supervised::start(&mut command))
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
        options.waits.yields,
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
