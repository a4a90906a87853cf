//! How the processes of a run wait for each other's tokens, and on which cores.

use anhyst_ipc::{NodeId, YIELDS_SHARED};
use anhyst_scenario::Scenario;
use rustix::thread::{sched_getaffinity, sched_getcpu, sched_setaffinity};

/// Polls before a waiting process sleeps, where every process has a core of its own.
const YIELDS_DEDICATED: u32 = 1000;
/// The same where all share one: whose token has not come when it has its turn again sleeps, and is woken when it has come: so
/// they get into the order of the loop, and then each has its token when it has its turn, and nobody needs to sleep or be woken.
const YIELDS_ONE_CORE: u32 = 1;

/// What a run's processes are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Waits {
    /// Polls before a waiting process sleeps.
    pub yields: u32,
    /// The only CPU that the loop gets; the recorder gets the others, if there are any.
    pub cpu: Option<usize>,
}

impl Waits {
    /// Of a run of this scenario on this host. In lockstep only one process works at a time: where none has a core of its own they all take
    /// the one that this process is on, because to wake a process on another takes several times as long. Where somebody else's program
    /// is in the loop, the system places them.
    pub fn of(scenario: &Scenario, dedicated_cores: bool) -> Self {
        let is_ours = scenario.clock.realtime().is_none() && scenario.external_nodes().is_empty();
        match (dedicated_cores, is_ours) {
            (true, _) => Self {
                yields: YIELDS_DEDICATED,
                cpu: None,
            },
            (false, true) => Self {
                yields: YIELDS_ONE_CORE,
                cpu: Some(sched_getcpu()),
            },
            (false, false) => Self::shared(),
        }
    }

    /// Where the system places the processes.
    pub fn shared() -> Self {
        Self {
            yields: YIELDS_SHARED,
            cpu: None,
        }
    }

    /// Starts a process that has these nodes: what this thread starts inherits its CPUs.
    ///
    /// # Errors
    /// What `start` says.
    pub fn start<T>(self, nodes: &[NodeId], start: impl FnOnce() -> std::io::Result<T>) -> std::io::Result<T> {
        // Where CPUs cannot be chosen, the loop is only slower.
        let allowed = sched_getaffinity(None);
        if let (Some(cpu), Ok(allowed)) = (self.cpu, &allowed) {
            let mut own = *allowed;
            match nodes {
                [] => {}
                [NodeId::Recorder] if allowed.count() > 1 => own.unset(cpu),
                _ => {
                    own.clear();
                    own.set(cpu);
                }
            }
            let _ = sched_setaffinity(None, &own);
        }
        let started = start();
        if let Ok(allowed) = allowed {
            let _ = sched_setaffinity(None, &allowed);
        }
        started
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the loop's core: its processes get that one only, the recorder none of it, and who starts them keeps all.
    #[test]
    fn a_loop_has_one_core_and_the_recorder_the_others() {
        let allowed = sched_getaffinity(None).unwrap();
        let cpu = sched_getcpu();
        let waits = Waits {
            cpu: Some(cpu),
            ..Waits::shared()
        };
        let granted = |waits: Waits, nodes: &[NodeId]| waits.start(nodes, || Ok(sched_getaffinity(None)?)).unwrap();
        let in_loop = granted(waits, &[NodeId::Controller, NodeId::Recorder]);
        assert!(in_loop.is_set(cpu) && in_loop.count() == 1);
        let records = granted(waits, &[NodeId::Recorder]);
        assert_eq!(records.is_set(cpu), allowed.count() == 1);
        assert_eq!(records.count(), (allowed.count() - 1).max(1));
        assert_eq!(granted(waits, &[]), allowed);
        assert_eq!(granted(Waits::shared(), &[NodeId::Controller]), allowed);
        assert_eq!(sched_getaffinity(None).unwrap(), allowed);
    }
}
