//! Which of a scenario's faults happen where and when; those that make no sense are refused.

use super::faults::{Fault, ProcessKind, begin};
use super::{Placement, Scenario};
use anhyst_ipc::{Invalid, NodeId, TokenFault};

impl Scenario {
    /// The faults of links.
    ///
    /// # Errors
    /// The first that makes no sense.
    pub fn token_faults(&self) -> Result<Vec<TokenFault>, Invalid> {
        self.collect_faults(|fault| match fault {
            Fault::Link(link) => Some(link.on_tokens(self.tick_s)),
            Fault::Process(_) => None,
        })
    }

    /// The faults of the process that runs these nodes, by tick.
    ///
    /// # Errors
    /// The first that makes no sense.
    pub fn process_faults(&self, nodes: &[NodeId]) -> Result<Vec<(u64, ProcessKind)>, Invalid> {
        let mut faults = self.collect_faults(|fault| match fault {
            Fault::Process(process) if nodes.contains(&process.node) => {
                let tick = begin(process.at_s, process.from_tick, self.tick_s);
                Some(tick.map(|tick| (tick, process.kind)))
            }
            _ => None,
        })?;
        faults.sort_by_key(|(tick, _)| *tick);
        Ok(faults)
    }

    fn collect_faults<T>(&self, of: impl Fn(&Fault) -> Option<Result<T, Invalid>>) -> Result<Vec<T>, Invalid> {
        let all = self.faults.iter().enumerate();
        all.filter_map(|(index, fault)| {
            of(fault).map(|result| result.map_err(|invalid| invalid.within(&format!("faults.{index}"))))
        })
        .collect()
    }

    pub(super) fn validate_faults(&self) -> Result<(), Invalid> {
        self.token_faults()?;
        self.process_faults(&NodeId::LOOP_ORDER)?;
        let external = self.external_nodes();
        for (index, fault) in self.faults.iter().enumerate() {
            let refuse = |invalid: Invalid| invalid.within(&format!("faults.{index}"));
            if fault.begin_tick(self.tick_s).map_err(refuse)? >= self.ticks() {
                return Err(refuse(fault.too_late(self.duration_s, self.ticks())));
            }
            if external.contains(&fault.node()) {
                return Err(refuse(fault.not_read(&external)));
            }
            let Fault::Process(process) = fault else { continue };
            if self.placement == Placement::Embedded {
                let sentence = "all nodes share one process: there is no other to see what its fault does";
                return Err(refuse(Invalid::new("node", sentence)));
            }
            if let ProcessKind::Stop(stop_s) = process.kind {
                Invalid::unless_between("kind", stop_s, 0.0, 3600.0, "s").map_err(refuse)?;
            }
        }
        Ok(())
    }
}
