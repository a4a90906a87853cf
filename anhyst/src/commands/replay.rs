//! `anhyst replay RUN`: feeds a run's tokens to one node and compares its outputs bit by bit. The tokens of a real-time run
//! come from its token logs, those of a lockstep run from its recording.

use super::{Ending, expect_recording, run_folder};
use crate::arguments::JsonArgument;
use anhyst_ipc::NodeId;
use anhyst_launch::across::one_of;
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::{self, Logs};
use anhyst_launch::run_again::Replayed;
use anhyst_scenario::{Scenario, load};
use clap::Args;
use std::path::PathBuf;

/// `replay`
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// Folder of the recorded run.
    pub run: PathBuf,
    /// Which node (default: every node that the recording can feed).
    #[arg(long, value_name = "NODE", value_parser = one_of(&NodeId::SENDERS))]
    pub node: Option<NodeId>,
    /// How the result is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A run without recording.
pub fn run(arguments: &ReplayArguments) -> miette::Result<Ending> {
    let folder = run_folder(&arguments.run)?;
    let scenario = load(&folder.scenario(), &[])?;
    let nodes = arguments
        .node
        .map_or_else(|| NodeId::SENDERS.to_vec(), |node| vec![node]);
    let (replayed, held_ticks) = if scenario.clock.realtime().is_some() {
        let foreign = scenario.external_nodes();
        let logs = Logs::open_but(&folder, &foreign)?;
        let (theirs, ours): (Vec<NodeId>, Vec<NodeId>) = nodes.into_iter().partition(|node| foreign.contains(node));
        for node in &theirs {
            crate::complain!("{node} was external and is not replayed: it keeps no log of what it consumed");
        }
        if ours.is_empty() {
            return Err(miette::miette!("nothing that was asked for can be replayed"));
        }
        let replayed = ours.into_iter().map(|node| realtime::replay(node, &scenario, &logs));
        (replayed.collect::<Result<Vec<_>, _>>()?, u64::MAX)
    } else {
        expect_recording(&folder)?;
        from_recording(&nodes, &scenario, &folder)?
    };
    if arguments.json.json {
        crate::say!("{}", super::json(&replayed)?);
    } else {
        for result in &replayed {
            match &result.difference {
                None => crate::say!("{}: {} ticks, every bit the same", result.node, result.ticks),
                Some(difference) => crate::say!("{}: DIFFERS: {difference}", result.node),
            }
        }
    }
    let whole = missing_ticks(&folder, held_ticks);
    if let Some(ticks) = whole {
        crate::complain!("the recording holds {held_ticks} of the {ticks} ticks that the run had");
    }
    Ok(if whole.is_none() && replayed.iter().all(|result| result.same) {
        Ending::Held
    } else {
        Ending::NotHeld
    })
}

/// How many ticks the run had, if the recording has fewer. A run that did not come to its end has no summary to tell.
fn missing_ticks(folder: &RunFolder, recorded: u64) -> Option<u64> {
    let summary: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.summary()).ok()?).ok()?;
    summary["ticks"].as_u64().filter(|ticks| *ticks > recorded)
}

/// Replays from the recording; also how many ticks it holds.
#[cfg(feature = "recorder")]
fn from_recording(nodes: &[NodeId], scenario: &Scenario, folder: &RunFolder) -> Result<(Vec<Replayed>, u64), RunError> {
    super::replay_recording::replay(nodes, scenario, folder)
}

#[cfg(not(feature = "recorder"))]
fn from_recording(_: &[NodeId], _: &Scenario, _: &RunFolder) -> Result<(Vec<Replayed>, u64), RunError> {
    Err(RunError::Setup(
        "this build reads no recordings (cargo feature `recorder`); real-time runs can be replayed".into(),
    ))
}
