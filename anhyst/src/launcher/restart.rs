//! Starts again what a real-time loop can do without for a while: estimator, inverse, recorder.

use super::{LaunchError, Options, Running, describe, spawn};
use crate::folder::RunFolder;
use crate::realtime::Restart;
use crate::resources::Resources;
use crate::scenario::Scenario;

/// Starts again what has died and may, as often as the scenario permits.
///
/// # Errors
/// If a process cannot be started.
pub(super) fn restart(
    scenario: &Scenario,
    folder: &RunFolder,
    options: Options,
    resources: &Resources,
    children: &mut [Running],
    tick: u64,
) -> Result<(), LaunchError> {
    let Some(realtime) = scenario.clock.realtime() else {
        return Ok(());
    };
    let processes = scenario.placement.processes();
    let before: usize = children.iter().map(|running| running.restarts.len()).sum();
    let mut left = (realtime.most_restarts as usize).saturating_sub(before);
    for running in children.iter_mut().filter(|running| running.failed()) {
        let nodes = processes.iter().find(|(name, _)| *name == running.name);
        let Some((_, nodes)) = nodes.filter(|(_, nodes)| nodes.iter().all(|node| realtime.restart.contains(node)))
        else {
            continue;
        };
        if left == 0 || tick == 0 {
            // Before the loop runs there is nothing to rejoin.
            continue;
        }
        left -= 1;
        let how = describe(running.ended);
        crate::complain!("{} {how} at tick {tick}; it is started again", running.name);
        let first = nodes.first().map_or("", |node| node.name());
        running.child = spawn(&running.name, first, folder, options, resources, true)?;
        running.ended = None;
        running.restarts.push(Restart {
            process: running.name.clone(),
            how,
            tick,
        });
    }
    Ok(())
}
