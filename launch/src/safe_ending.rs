//! The last ticks of a process whose links have failed: the field goes to its safe value before the process ends.
//!
//! The guard cannot hear any more and ramps by itself. The amplifier follows the guard as long as it hears it, for a bounded
//! time, then its own watchdog acts. The plant follows the amplifier as long as it hears it; then the amplifier is dead, and the current dies.

use crate::report::Ending;
use anhyst_ipc::{NodeId, SharedContext, Stage};
use std::time::{Duration, Instant};

/// How long a last token of the guard, and of the amplifier behind it, is waited for.
const LAST_WAIT: Duration = Duration::from_millis(100);
const LAST_WAIT_OF_PLANT: Duration = Duration::from_millis(350);
/// So far ahead of the process that listens nobody runs: half of what its buffer takes.
const MAX_AHEAD_TICKS: u64 = 32;
/// How long such a listener is waited for in all: it may be dead.
const PATIENCE: Duration = Duration::from_millis(200);
/// How long an amplifier on its way follows a guard: one that knows nothing of the end may go on to the last tick of the run.
const MAX_FOLLOWING: Duration = Duration::from_millis(800);
const STEP: Duration = Duration::from_micros(200);
/// More ticks than any stated ramp has are not needed; a ramp that never ends must not keep a process alive.
const MAX_TICKS: u64 = 1_000_000;

/// Runs the stages that can harm something from `failed_at_tick` until each is safe.
pub fn bring_to_safety(stages: &mut [Box<dyn Stage>], shared: Option<&SharedContext>, failed_at_tick: u64) -> Ending {
    let has_plant = stages.iter().any(|stage| stage.node() == NodeId::Plant);
    if let Some(shared) = shared {
        shared.wait_at_most(if has_plant { LAST_WAIT_OF_PLANT } else { LAST_WAIT });
    }
    let mut ending = Ending {
        failed_at_tick,
        ..Ending::default()
    };
    // The guard does not listen any more: what it would hear is what has failed.
    let mut moving: Vec<(&mut Box<dyn Stage>, bool)> = stages
        .iter_mut()
        .filter(|stage| matches!(stage.node(), NodeId::Plant | NodeId::Guard | NodeId::Amplifier))
        .map(|stage| {
            stage.end();
            let listens = stage.node() != NodeId::Guard;
            (stage, listens)
        })
        .collect();
    let has = |node| moving.iter().any(|(stage, _)| stage.node() == node);
    let (has_guard, has_amplifier) = (has(NodeId::Guard), has(NodeId::Amplifier));
    let next = match (has_guard, has_amplifier) {
        (true, false) => Some(NodeId::Amplifier),
        (_, true) if !has_plant => Some(NodeId::Plant),
        _ => None,
    };
    let listener = next.and_then(|node| shared?.process_of(node));
    let mut patience = PATIENCE;
    let (mut guard_moved, mut amplifier_moved) = (true, true);
    let begin = Instant::now();
    for tick in failed_at_tick..failed_at_tick.saturating_add(MAX_TICKS) {
        let (mut any_heard, mut any_alone, mut any_moved) = (false, false, false);
        for (stage, listens) in &mut moving {
            let node = stage.node();
            // Within one process nobody waits: who has nothing more to say is not listened to.
            let speaks = match node {
                NodeId::Plant => !has_amplifier || amplifier_moved,
                NodeId::Amplifier if has_guard => guard_moved,
                NodeId::Amplifier => begin.elapsed() < MAX_FOLLOWING,
                _ => true,
            };
            // The failure came in the middle of a tick: some have answered it.
            let answered = stage.report().ticks > tick;
            *listens = answered && *listens || *listens && speaks && stage.tick(tick).is_ok();
            let alone = !answered && !*listens && stage.alone(tick);
            let moved = answered || *listens || alone;
            match node {
                NodeId::Guard => guard_moved = moved,
                NodeId::Amplifier => amplifier_moved = moved,
                _ => {}
            }
            any_heard |= *listens;
            any_alone |= alone;
            any_moved |= moved;
        }
        ending.heard_ticks += u64::from(any_heard);
        ending.alone_ticks += u64::from(any_alone);
        if !any_moved {
            break;
        }
        if let Some(shared) = shared {
            shared.set_tick(tick + 1);
            let behind = || listener.and_then(|name| shared.tick_of(name));
            while !patience.is_zero() && behind().is_some_and(|reached| reached + MAX_AHEAD_TICKS < tick) {
                std::thread::sleep(STEP);
                patience = patience.saturating_sub(STEP);
            }
        }
    }
    ending
}
