//! Notices in real time a process of ours that neither ends nor goes on. There nobody waits for it: the guard and the amplifier
//! take the field away, and without this the run would go on so to its end.

use super::running::{Running, Stillness};
use crate::supervisor::LOOK_PERIOD;
use anhyst_ipc::{NodeId, Observer};
use anhyst_scenario::Scenario;
use std::time::{Duration, Instant};

/// A process that has not gone on for so long hangs; on a busy machine it may be late.
const PATIENCE: Duration = Duration::from_secs(2);
/// The recorder may wait for a disk.
const PATIENCE_WITH_A_DISK: Duration = Duration::from_secs(10);
/// A process says where it is once in 64 ticks: so many must have passed, and one may have been under way.
const SAYINGS_TICKS: f64 = 3.0 * 64.0;
/// More time than this does not count between two looks: then the launcher, or the machine, stood still as well.
const MAX_LOOK: Duration = Duration::from_millis(10 * LOOK_PERIOD.as_millis() as u64);

/// Looks at where the processes are.
pub(super) struct HangDetector {
    looked: Instant,
    /// Where the plant was then.
    tick: u64,
    /// Of the run.
    ticks: u64,
    tick_s: f64,
    patience: Duration,
    plant: Option<String>,
    recorder: Option<String>,
}

impl HangDetector {
    /// In lockstep nobody is needed: whoever waits for a token says so.
    pub fn of(scenario: &Scenario) -> Option<Self> {
        scenario.clock.realtime()?;
        let processes = scenario.placement.processes();
        let name_of = |wanted: &dyn Fn(&[NodeId]) -> bool| {
            let found = processes.iter().find(|(_, nodes)| wanted(nodes));
            found.map(|(name, _)| name.clone())
        };
        Some(Self {
            looked: Instant::now(),
            tick: 0,
            ticks: scenario.ticks(),
            tick_s: scenario.tick_s,
            patience: PATIENCE.max(Duration::from_secs_f64(SAYINGS_TICKS * scenario.tick_s)),
            plant: name_of(&|nodes| nodes.contains(&NodeId::Plant)),
            recorder: name_of(&|nodes| *nodes == [NodeId::Recorder]),
        })
    }

    /// Kills what hangs: it cannot be asked. `tick` is the plant's. Paced by the measurement all stand still with the plant:
    /// of them only the time counts in which it goes on, and that after its end.
    pub fn look(&mut self, observer: &mut Observer, children: &mut [Running], tick: u64) {
        let passed = self.looked.elapsed().min(MAX_LOOK);
        self.looked = Instant::now();
        let of_the_plant = match tick >= self.ticks {
            true => passed,
            false => Duration::from_secs_f64(tick.saturating_sub(self.tick) as f64 * self.tick_s),
        };
        self.tick = tick;
        let living = |running: &&mut Running| !running.foreign && running.child.end().is_none();
        for running in children.iter_mut().filter(living) {
            let restarts = running.restarts.len() as u64;
            let reached = match restarts {
                0 => observer.tick_of(&running.name),
                _ => observer.tick_after(&running.name, restarts),
            };
            // Whoever takes the place of another has its own limit to come in; the scenario's own stops are woken.
            let comes = restarts > 0 && reached.is_none_or(|reached| reached == 0);
            let done = reached.is_some_and(|reached| reached >= self.ticks);
            let stillness = &mut running.stillness;
            if tick == 0 || comes || done || running.wake_at.is_some() || reached != stillness.reached {
                *stillness = Stillness {
                    reached,
                    ..Stillness::default()
                };
                continue;
            }
            let is = |name: &Option<String>| name.as_ref() == Some(&running.name);
            stillness.lasts += if is(&self.plant) { passed } else { of_the_plant };
            let patience = match is(&self.recorder) {
                true => self.patience.max(PATIENCE_WITH_A_DISK),
                false => self.patience,
            };
            if stillness.lasts > patience {
                stillness.hung = true;
                running.child.signal(rustix::process::Signal::KILL);
            }
        }
    }
}
