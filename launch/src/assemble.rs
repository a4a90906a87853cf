//! From a scenario to blocks: the one place that knows all nodes.

use crate::error::RunError;
use crate::error_spectrum::ErrorSpectrum;
use crate::folder::RunFolder;
use crate::judge::Judge;
use crate::noticed::Noticing;
use crate::overheard::Overheard;
use crate::report::ProcessReport;
use crate::scribe::Scribe;
use anhyst_controller::Trajectory;
use anhyst_ipc::{Block, Channel, Connections, Node, NodeId, Stage};
use anhyst_scenario::{InverseBlock, Scenario};

/// Builds a node of the loop and opens its links.
///
/// # Errors
/// If a setting cannot be used or a link cannot be opened.
pub fn stage(node: NodeId, scenario: &Scenario, connections: &mut Connections) -> Result<Box<dyn Stage>, RunError> {
    if scenario.clock.has_empty_blocks() {
        return crate::realtime::empty_stage(node, scenario.ticks(), connections);
    }
    Ok(match node {
        NodeId::Plant => boxed(scenario.plant_block()?, scenario, connections)?,
        NodeId::Amplifier => boxed(scenario.amplifier_block()?, scenario, connections)?,
        NodeId::Estimator => boxed(scenario.estimator_block()?, scenario, connections)?,
        NodeId::Controller => boxed(scenario.controller()?, scenario, connections)?,
        NodeId::Inverse => match scenario.inverse_block()? {
            InverseBlock::Inverse(block) => boxed(block, scenario, connections)?,
            InverseBlock::Law(block) => boxed(block, scenario, connections)?,
            InverseBlock::Drive(block) => boxed(block, scenario, connections)?,
        },
        NodeId::Guard => boxed(scenario.guard_block()?, scenario, connections)?,
        NodeId::Recorder => return Err(RunError::Setup("the recorder is no stage of the loop".into())),
    })
}

/// Opens a block's links, with the faults that the scenario injects into what it sends.
fn boxed<B: Block + 'static>(
    block: B,
    scenario: &Scenario,
    connections: &mut Connections,
) -> Result<Box<dyn Stage>, RunError> {
    let node = Node::open(block, connections, scenario.ticks())?;
    Ok(Box::new(node.with_faults(&scenario.token_faults()?, scenario.seed)))
}

/// Channels whose tokens an injected fault makes late: their readers take them for what they are.
///
/// # Errors
/// A fault that makes no sense.
pub fn late_channels(scenario: &Scenario) -> Result<Vec<Channel>, RunError> {
    let faults = scenario.token_faults()?;
    let late = faults.iter().filter(|fault| fault.shifts_ticks());
    Ok(late.map(|fault| fault.channel).collect())
}

/// Builds the recorder's block: judge, and recording if the scenario wants one.
///
/// # Errors
/// If the recording cannot be created.
pub fn scribe(scenario: &Scenario, folder: Option<&RunFolder>, rejoins: bool) -> Result<Scribe, RunError> {
    let foreign = scenario.external_nodes().into_iter();
    let overheard = foreign.map(|node| Overheard::new(node, scenario.ticks())).collect();
    let limit_a_per_m = scenario.guard.field_limit_a_per_m;
    let judge = Judge::new(scenario.expect, scenario.tick_s, limit_a_per_m)
        .with_lowest_field(scenario.guard.lowest_field_a_per_m)
        .in_units(scenario.units())
        .noticing(Noticing::new(scenario))
        .following(followed(scenario)?)
        .with_changes(&scenario.changes)
        .with_spectrum(ErrorSpectrum::new(scenario));
    let scribe = Scribe::new(judge).with_overheard(overheard);
    let restarted = scenario
        .clock
        .realtime()
        .is_some_and(|realtime| realtime.restart.contains(&NodeId::Recorder));
    let scribe = match folder.filter(|_| restarted) {
        Some(folder) => scribe.with_notes(folder.judged(), rejoins),
        None => scribe,
    };
    let Some(folder) = folder.filter(|_| scenario.recording.on) else {
        return Ok(scribe);
    };
    #[cfg(feature = "recorder")]
    return crate::recording::add(scribe, scenario, folder, rejoins);
    #[cfg(not(feature = "recorder"))]
    {
        let _ = folder;
        Err(RunError::Setup(
            "this build has no recorder (cargo feature `recorder`): run with --no-recording".into(),
        ))
    }
}

/// The trajectory, where all know it: nobody else's controller follows another one, and nobody else's plant keeps where it was
/// between its samples to itself.
fn followed(scenario: &Scenario) -> Result<Option<Trajectory>, RunError> {
    let external = scenario.external_nodes();
    if external.contains(&NodeId::Controller) || external.contains(&NodeId::Plant) {
        return Ok(None);
    }
    // As stated: what is changed while it runs is not known here, and what was is to be judged the same when it runs again.
    let stated = Scenario {
        changes: Vec::new(),
        ..scenario.clone()
    };
    Ok(Some(stated.controller()?.trajectory().clone()))
}

/// Closes the recording, if there is one, and notes what it holds.
///
/// # Errors
/// If the recording could not be written to its end.
pub fn finish_recording(scribe: &mut Scribe, report: &mut ProcessReport) -> Result<(), RunError> {
    #[cfg(feature = "recorder")]
    if let Some(recorder) = scribe.take_recorder(report.failure.as_ref().map(|failure| failure.sentence.as_str())) {
        let recorded = recorder.finish()?;
        report.recorded_rows = recorded.rows - recorded.removed_rows;
        report.recording_parts = recorded.parts;
        report.recording_bytes = recorded.bytes;
        report.plotted_ticks = recorded.plotted_ticks;
        report.dropped_rows = recorded.dropped;
    }
    #[cfg(not(feature = "recorder"))]
    let _ = (scribe, report);
    Ok(())
}
