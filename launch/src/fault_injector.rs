//! Faults of a process that a scenario injects: the process does them to itself, exactly at their tick.

use crate::error::RunError;
use anhyst_ipc::NodeId;
use anhyst_scenario::{ProcessKind, Scenario};
use rustix::process::{Signal, getpid, kill_process};

/// What is to happen to this process.
pub struct FaultInjector {
    /// By tick, the next one last.
    coming: Vec<(u64, ProcessKind)>,
}

impl FaultInjector {
    /// The faults of the process that runs `nodes`; `has_others` if other processes take part in the run.
    ///
    /// # Errors
    /// If there are any, but all nodes share this process.
    pub fn new(scenario: &Scenario, nodes: &[NodeId], has_others: bool) -> Result<Self, RunError> {
        let mut coming = scenario.process_faults(nodes)?;
        if !coming.is_empty() && !has_others {
            let sentence = "a fault kills or stops a process, but all nodes share this one: run without --embedded";
            return Err(RunError::Setup(sentence.into()));
        }
        coming.reverse();
        Ok(Self { coming })
    }

    /// Injects what is due before tick `tick` is answered.
    pub fn inject(&mut self, tick: u64) {
        while let Some((_, kind)) = self.coming.pop_if(|(at, _)| *at <= tick) {
            let signal = match kind {
                ProcessKind::Kill => Signal::KILL,
                ProcessKind::Stop(_) => Signal::STOP,
            };
            // A process may always signal itself.
            let _ = kill_process(getpid(), signal);
        }
    }
}
