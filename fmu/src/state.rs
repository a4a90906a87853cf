//! All that an instance remembers: it can be kept and set back.

use crate::tokens::Tokens;
use crate::unit::Unit;
use anhyst_ipc::Change;

/// Where an instance stands in FMI's order of calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    Instantiated,
    Initialization,
    Step,
    Terminated,
}

impl Mode {
    /// In FMI's words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated state",
            Self::Initialization => "initialization mode",
            Self::Step => "step mode",
            Self::Terminated => "terminated state",
        }
    }
}

/// All that can change in an instance.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    pub mode: Mode,
    /// What the simulation calls the time of tick 0, s.
    pub start_time_s: f64,
    /// k of t_k.
    pub tick: u64,
    /// Bits of the parameters at the start, and now; none where the scenario has no such setting.
    pub at_start: Vec<Option<u64>>,
    pub now: Vec<Option<u64>>,
    /// Changes of parameters since.
    pub changes: Vec<Change>,
    pub tokens: Tokens,
    /// None before the start.
    pub unit: Option<Unit>,
}
