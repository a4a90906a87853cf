//! Injected faults of a scenario: of what travels on a link, or of a process. Exact to the tick and the same in every run.
//!
//! A fault of a process happens in that process, before it answers the tick; the launcher wakes what was stopped.

use super::{Placement, Scenario};
use anhyst_ipc::{Channel, Invalid, NodeId, TokenFault, TokenKind};
use serde::{Deserialize, Serialize};

/// One injected fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Fault {
    /// Of what is sent on a channel.
    Link(LinkFault),
    /// Of the process in which a node runs.
    Process(ProcessFault),
}

/// A fault of what is sent on a channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkFault {
    /// When it begins; this or `from_tick`.
    #[serde(default)]
    pub at_s: Option<f64>,
    /// The tick in which it begins.
    #[serde(default)]
    pub from_tick: Option<u64>,
    /// How long it lasts.
    #[serde(default = "one")]
    pub for_ticks: u64,
    /// Whose tokens.
    pub channel: Channel,
    /// Which number of the token; none: all.
    #[serde(default)]
    pub field: Option<String>,
    /// What happens.
    pub kind: TokenKind,
}

/// A fault of a process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessFault {
    /// When; this or `from_tick`.
    #[serde(default)]
    pub at_s: Option<f64>,
    /// In which tick.
    #[serde(default)]
    pub from_tick: Option<u64>,
    /// The process in which this node runs.
    pub node: NodeId,
    /// What happens to it.
    pub kind: ProcessKind,
}

/// What happens to a process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ProcessKind {
    /// It is gone at once.
    Kill,
    /// It stands still for so many seconds of wall clock.
    Stop(f64),
}

fn one() -> u64 {
    1
}

fn begin(at_s: Option<f64>, from_tick: Option<u64>, tick_s: f64) -> Result<u64, Invalid> {
    match (at_s, from_tick) {
        (Some(at_s), None) => {
            Invalid::unless_between("at_s", at_s, 0.0, 1e9, "s")?;
            Ok((at_s / tick_s).round() as u64)
        }
        (None, Some(tick)) => Ok(tick),
        _ => Err(Invalid::new(
            "",
            "a fault begins at_s or from_tick: give exactly one of them",
        )),
    }
}

impl LinkFault {
    fn on_tokens(&self, tick_s: f64) -> Result<TokenFault, Invalid> {
        let fault = TokenFault {
            from_tick: begin(self.at_s, self.from_tick, tick_s)?,
            for_ticks: self.for_ticks,
            channel: self.channel,
            field: self.field.clone(),
            kind: self.kind,
        };
        fault.validate()?;
        Ok(fault)
    }
}

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
        for (index, fault) in self.faults.iter().enumerate() {
            let Fault::Process(process) = fault else { continue };
            let refuse = |invalid: Invalid| invalid.within(&format!("faults.{index}"));
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
