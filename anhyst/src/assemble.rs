//! From a scenario to blocks: the one place that knows all nodes.

use crate::error::RunError;
use crate::folder::RunFolder;
use crate::judge::Judge;
use crate::report::ProcessReport;
use crate::scenario::Scenario;
use crate::scribe::Scribe;
use anhyst_controller::Controller;
use anhyst_estimator::Estimator;
use anhyst_guard::Guard;
use anhyst_inverse::Inverse;
use anhyst_ipc::{Connections, Node, NodeId, Stage, Wire, wiring};
use anhyst_plant_sim::{AmplifierNode, PlantNode};

fn setup(error: impl std::fmt::Display) -> RunError {
    RunError::Setup(error.to_string())
}

/// Every arrow of the loop.
pub fn wires() -> Vec<Wire> {
    [
        wiring::<PlantNode>(),
        wiring::<Estimator>(),
        wiring::<Controller>(),
        wiring::<Inverse>(),
        wiring::<Guard>(),
        wiring::<AmplifierNode>(),
        wiring::<Scribe>(),
    ]
    .concat()
}

/// Builds a node of the loop and opens its links.
///
/// # Errors
/// If a setting cannot be used or a link cannot be opened.
pub fn stage(node: NodeId, scenario: &Scenario, connections: &mut Connections) -> Result<Box<dyn Stage>, RunError> {
    if scenario.clock.realtime().is_some_and(|realtime| realtime.empty_blocks) {
        return crate::realtime::empty_stage(node, scenario.ticks(), connections);
    }
    let material = scenario.material()?;
    let ticks = scenario.ticks();
    let fault = scenario.fault;
    let tick_s = scenario.tick_s;
    Ok(match node {
        NodeId::Plant => {
            let rod = &scenario.rod.constants;
            let block = PlantNode::new(&scenario.plant, material, rod, tick_s, scenario.seed).map_err(setup)?;
            Box::new(Node::open(block, connections, ticks, fault)?)
        }
        NodeId::Amplifier => {
            let block = AmplifierNode::new(&scenario.amplifier, tick_s).map_err(setup)?;
            Box::new(Node::open(block, connections, ticks, fault)?)
        }
        NodeId::Estimator => {
            let block = Estimator::new(
                &scenario.estimator,
                material,
                scenario.two_pole()?,
                scenario.amplifier,
                tick_s,
            )
            .map_err(setup)?;
            Box::new(Node::open(block, connections, ticks, fault)?)
        }
        NodeId::Controller => Box::new(Node::open(scenario.controller()?, connections, ticks, fault)?),
        NodeId::Inverse => {
            let block = Inverse::new(
                &scenario.inverse,
                material.hysteresis,
                &scenario.amplifier,
                scenario.guard.field_limit_a_per_m,
            )
            .map_err(setup)?;
            Box::new(Node::open(block, connections, ticks, fault)?)
        }
        NodeId::Guard => Box::new(Node::open(
            Guard::new(&scenario.guard, tick_s)?,
            connections,
            ticks,
            fault,
        )?),
        NodeId::Recorder => return Err(RunError::Setup("the recorder is no stage of the loop".into())),
    })
}

/// Builds the recorder's block: judge, and recording if the scenario wants one.
///
/// # Errors
/// If the recording cannot be created.
pub fn scribe(scenario: &Scenario, folder: &RunFolder) -> Result<Scribe, RunError> {
    let scribe = Scribe::new(Judge::new(scenario.expect, scenario.tick_s));
    if !scenario.recording.on {
        return Ok(scribe);
    }
    #[cfg(feature = "recorder")]
    return crate::recording::add(scribe, scenario, folder);
    #[cfg(not(feature = "recorder"))]
    {
        let _ = folder;
        Err(RunError::Setup(
            "this build has no recorder (cargo feature `recorder`): run with --no-recording".into(),
        ))
    }
}

/// Closes the recording, if there is one, and notes what it holds.
///
/// # Errors
/// If the recording could not be written to its end.
pub fn finish_recording(scribe: &mut Scribe, report: &mut ProcessReport) -> Result<(), RunError> {
    #[cfg(feature = "recorder")]
    if let Some(recorder) = scribe.take_recorder() {
        let recorded = recorder.finish()?;
        report.recorded_rows = recorded.rows;
        report.dropped_rows = recorded.dropped;
    }
    #[cfg(not(feature = "recorder"))]
    let _ = (scribe, report);
    Ok(())
}
