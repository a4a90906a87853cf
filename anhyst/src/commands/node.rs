//! One process of a run: `anhyst node controller SCENARIO`, started by the launcher or by hand.

use super::Ending;
use crate::arguments::ProcessArguments;
use anhyst_ipc::NodeId;
use anhyst_launch::across::one_of;
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::process::{self, Meeting};
use anhyst_launch::report::{self, Failure};
use anhyst_launch::resources::Resources;
use anhyst_launch::{resources, signals};
use anhyst_scenario::load;
use clap::Args;
use std::time::Duration;

/// Prefix of the resources of processes that are started by hand, unless they are told another.
const BY_HAND: &str = "anhyst_hand_";

/// `node`
#[derive(Debug, Args)]
pub struct NodeArguments {
    /// Which node; its process runs, with whatever shares it.
    #[arg(value_name = "NODE", value_parser = one_of(&NodeId::LOOP_ORDER))]
    pub node: NodeId,
    /// How its process is run.
    #[command(flatten)]
    pub process: ProcessArguments,
}

/// Runs the process that the node belongs to.
///
/// # Errors
/// Bad input, or what prevented the process from starting.
pub fn run(arguments: &NodeArguments) -> miette::Result<Ending> {
    let NodeArguments {
        node,
        process: arguments,
    } = arguments;
    signals::install();
    run_process(*node, arguments).or_else(|report| {
        let supervised = arguments.end_with_launcher.is_some();
        // Another process did not come, or not as it should, or there is no room for results: the scenario is good.
        match report.downcast::<RunError>() {
            Ok(error @ (RunError::Link(_) | RunError::Write { .. })) => Failure::new(0, &error).tell(supervised),
            Ok(error) if supervised => Failure::new(0, &error).tell(true),
            Ok(error) => return Err(error.into()),
            Err(report) if supervised => Failure::refused(&report).tell(true),
            Err(report) => return Err(report),
        }
        Ok(Ending::ProcessFailed)
    })
}

/// Binds this process to the launcher that has started it, if one has.
///
/// # Errors
/// If that launcher has gone already.
pub fn end_with_launcher(arguments: &ProcessArguments) -> miette::Result<()> {
    let Some(launcher) = arguments.end_with_launcher else {
        return Ok(());
    };
    report::tell_panics();
    // Best effort: without it a child of a killed launcher ends at its receive limit.
    let _ = rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::TERM));
    // One that died before that sends no signal.
    let parent = rustix::process::getppid().map(|pid| pid.as_raw_nonzero().get() as u32);
    if parent != Some(launcher) {
        return Err(RunError::Orphan { launcher }.into());
    }
    Ok(())
}

fn run_process(node: NodeId, arguments: &ProcessArguments) -> miette::Result<Ending> {
    end_with_launcher(arguments)?;
    let mut scenario = load(&arguments.scenario.scenario, &arguments.scenario.set.settings)?;
    let effective = scenario.to_ron().map_err(|error| RunError::Setup(error.to_string()))?;
    let agreement = scenario
        .agreement()
        .map_err(|error| RunError::Setup(error.to_string()))?;
    if arguments.live.is_some() {
        scenario.recording.live_port = arguments.live;
    }
    let (process, nodes) = scenario
        .placement
        .processes()
        .into_iter()
        .find(|(_, nodes)| nodes.contains(&node))
        .ok_or_else(|| RunError::Setup(format!("{node} has no process in this scenario")))?;
    if arguments.live.is_some() && !nodes.contains(&NodeId::Recorder) {
        miette::bail!("--live is for the recorder's process, and this one is {process}");
    }
    if arguments.rejoin && scenario.clock.realtime().is_none() {
        return Err(miette::miette!(
            "--rejoin is for real-time runs: in lockstep the loop ends with the process that died"
        ));
    }
    let meeting = meeting(arguments, agreement)?;
    let folder = RunFolder::open(&arguments.out);
    folder.make_result_folders().map_err(|cause| RunError::Write {
        path: folder.path().to_owned(),
        cause,
    })?;
    let by_hand = arguments.end_with_launcher.is_none();
    // So that nobody takes what it opens for leftovers.
    let _claimed = by_hand.then(|| resources::Claim::shared(&meeting.prefix));
    if node == NodeId::Recorder && by_hand {
        // By hand there is no launcher to write it; replay needs it.
        let path = folder.scenario();
        std::fs::write(&path, effective).map_err(|cause| RunError::Write { path, cause })?;
    }
    let report = process::run(&process, &nodes, &scenario, Some(&folder), Some(&meeting), &mut |_| {})?;
    let path = folder.report(&process);
    let text = serde_json::to_string_pretty(&report).map_err(|error| RunError::Setup(error.to_string()))?;
    std::fs::write(&path, text).map_err(|cause| RunError::Write { path, cause })?;
    if arguments.end_with_launcher.is_none() {
        crate::say!(
            "{process}: {} ticks in {:.2} s",
            report.nodes.first().map_or(0, |node| node.ticks),
            report.loop_s
        );
    }
    // Whatever it failed of was told when it happened.
    Ok(report.failure.map_or(Ending::Held, |_| Ending::ProcessFailed))
}

/// Where the processes of this host meet.
///
/// # Errors
/// If the names cannot be used.
pub fn meeting(arguments: &ProcessArguments, agreement: u64) -> miette::Result<Meeting> {
    let told = &arguments.meeting;
    let names = Resources {
        prefix: told.service_prefix.clone().unwrap_or_else(|| BY_HAND.into()),
        root: told
            .root
            .clone()
            .unwrap_or_else(|| resources::user_root().join(resources::HAND)),
    };
    names.check().map_err(|sentence| miette::miette!("{sentence}"))?;
    let Resources { prefix, root } = names;
    Ok(Meeting {
        prefix,
        root,
        agreement,
        yields: arguments.yields,
        start_limit: Duration::from_secs_f64(told.start_limit_s),
        rejoin: arguments.rejoin,
        supervised: arguments.end_with_launcher.is_some(),
    })
}
