//! Starts again what a real-time loop can do without for a while: estimator, inverse, recorder.

use super::LaunchError;
use super::running::{Running, Stillness};
use super::start::{Options, start_own};
use crate::folder::RunFolder;
use crate::realtime::Restart;
use anhyst_ipc::{NodeId, Observer};
use anhyst_scenario::Scenario;

/// True for a process of ours that the scenario permits to be started again.
pub(super) fn may_come_back(scenario: &Scenario, running: &Running) -> bool {
    let processes = scenario.placement.processes();
    let nodes = processes.iter().find(|(name, _)| *name == running.name);
    let permitted = |node: &NodeId| {
        scenario
            .clock
            .realtime()
            .is_some_and(|realtime| realtime.restart.contains(node))
    };
    !running.foreign && nodes.is_some_and(|(_, nodes)| nodes.iter().all(permitted))
}

/// Starts again what has died and may, as often as the scenario permits.
///
/// # Errors
/// If a process cannot be started.
pub(super) fn restart(
    scenario: &Scenario,
    folder: &RunFolder,
    options: &Options,
    children: &mut [Running],
    (tick, mut observer): (u64, Option<&mut Observer>),
) -> Result<(), LaunchError> {
    let Some(realtime) = scenario.clock.realtime() else {
        return Ok(());
    };
    let processes = scenario.placement.processes();
    let before: usize = children.iter().map(|running| running.restarts.len()).sum();
    let mut left = (realtime.most_restarts as usize).saturating_sub(before);
    // A foreign process is somebody else's to start.
    for running in children
        .iter_mut()
        .filter(|running| running.child.has_failed() && may_come_back(scenario, running))
    {
        let Some((_, nodes)) = processes.iter().find(|(name, _)| *name == running.name) else {
            continue;
        };
        if left == 0 || tick == 0 {
            // Before the loop runs there is nothing to rejoin.
            continue;
        }
        left -= 1;
        let how = running.how();
        crate::complain!("{} {how} at tick {tick}; it is started again", running.name);
        let refused = |cause: std::io::Error| LaunchError::Spawn {
            process: running.name.clone(),
            cause: cause.to_string(),
        };
        running.child = start_own(&running.name, nodes, folder, options, true).map_err(refused)?;
        running.stops.clear();
        running.failure = None;
        running.stillness = Stillness::default();
        if let Some(observer) = &mut observer {
            observer.forget(&running.name);
        }
        running.restarts.push(Restart {
            process: running.name.clone(),
            how,
            tick,
        });
    }
    Ok(())
}
