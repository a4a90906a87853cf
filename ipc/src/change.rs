//! What can be changed while a run goes on, and a change as data: from which tick on which setting has which value.

use crate::message::NodeId;
use serde::{Deserialize, Serialize};

/// Changes that a run takes, those of its scenario among them.
pub const MAX_CHANGES: usize = 256;

/// A setting that can be changed while a run goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Tunable {
    /// The PID's kp, m/m.
    Kp,
    /// Its ki_per_s, 1/s.
    KiPerS,
    /// Its kd_s, s.
    KdS,
    /// The learner is heard and learns (1), or is faded out and holds (0).
    Learning,
    /// The part of the error that a step of the learner takes away.
    LearningGain,
    /// How many times the stated trajectory.
    Amplitude,
    /// The workpiece's tolerance, m.
    Tolerance,
}

impl Tunable {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Kp,
        Self::KiPerS,
        Self::KdS,
        Self::Learning,
        Self::LearningGain,
        Self::Amplitude,
        Self::Tolerance,
    ];

    /// Where it stands in a scenario, or would.
    pub const fn path(self) -> &'static str {
        match self {
            Self::Kp => "controller.feedback.kp",
            Self::KiPerS => "controller.feedback.ki_per_s",
            Self::KdS => "controller.feedback.kd_s",
            Self::Learning => "controller.learning.on",
            Self::LearningGain => "controller.learning.gain",
            Self::Amplitude => "controller.trajectory.amplitude",
            Self::Tolerance => "expect.tolerance_m",
        }
    }

    /// The one at that path.
    pub fn at(path: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.path() == path)
    }

    /// Who takes the change.
    pub const fn node(self) -> NodeId {
        match self {
            Self::Tolerance => NodeId::Recorder,
            _ => NodeId::Controller,
        }
    }
}

impl std::fmt::Display for Tunable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(self.path())
    }
}

impl TryFrom<String> for Tunable {
    type Error = String;

    fn try_from(path: String) -> Result<Self, String> {
        Self::at(&path).ok_or_else(|| {
            let known = Self::ALL.map(Self::path).join(", ");
            format!("{path} cannot be changed while a run goes on; what can: {known}")
        })
    }
}

impl From<Tunable> for String {
    fn from(own: Tunable) -> Self {
        own.path().into()
    }
}

/// From `tick` on `set` goes to `value`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Change {
    pub tick: u64,
    pub set: Tunable,
    pub value: f64,
}

impl std::fmt::Display for Change {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} = {}", self.set, self.value)
    }
}
