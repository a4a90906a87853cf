//! All that an instance remembers: it can be kept, set back and written as bytes.

use crate::refusal::Refusal;
use crate::tokens::Tokens;
use crate::unit::Unit;
use anhyst_ipc::Change;
use serde::{Deserialize, Serialize};

/// Where an instance stands in FMI's order of calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

impl State {
    /// As bytes that begin with what they belong to.
    pub fn to_bytes(&self, token: &str) -> Result<Vec<u8>, Refusal> {
        postcard::to_extend(self, token.as_bytes().to_vec())
            .map_err(|error| Refusal::new(format!("the state cannot be written as bytes: {error}")))
    }

    /// The inverse of [`State::to_bytes`], for the same FMU.
    pub fn from_bytes(bytes: &[u8], token: &str, parameters: usize) -> Result<Self, Refusal> {
        let Some(body) = bytes.strip_prefix(token.as_bytes()) else {
            return Err(Refusal::new("the bytes are not of a state of this FMU"));
        };
        let state: Self = postcard::from_bytes(body)
            .map_err(|error| Refusal::new(format!("the bytes are of no whole state: {error}")))?;
        if !state.tokens.is_whole() || [&state.at_start, &state.now].iter().any(|own| own.len() != parameters) {
            return Err(Refusal::new("the bytes are of no whole state"));
        }
        Ok(state)
    }
}
