//! What a real-time process counts.

use super::Attempt;
use anhyst_ipc::{Bin, Latency, LatencySummary};
use serde::{Deserialize, Serialize};

/// A distribution of times.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Count, quantiles, largest.
    #[serde(flatten)]
    pub summary: LatencySummary,
    /// The histogram, three bins an octave.
    pub bins: Vec<Bin>,
}

impl From<&Latency> for Distribution {
    fn from(latency: &Latency) -> Self {
        Self {
            summary: latency.summary(),
            bins: latency.bins(),
        }
    }
}

/// What a real-time process reports besides its nodes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RealtimeReport {
    /// What was asked of the system.
    pub asked: Vec<Attempt>,
    /// The tick that the process began with; not 0 if it took the place of one that died.
    pub first_tick: u64,
    /// From one tick to the next: between two wakings of the timer, elsewhere between the ends of two ticks' work.
    pub period: Distribution,
    /// From the moment at which a tick begins to waking up; only in the process that has the timer.
    pub wake: Option<Distribution>,
    /// From sending the measurement to sending the coil's field of the same tick; only where the recorder runs.
    pub round: Option<Distribution>,
    /// Ticks in which a token was not there in time, and older ones were taken; with the timer, those not done when the next began.
    pub late_ticks: u64,
    /// Ticks that were left out because the process was held up.
    pub left_out_ticks: u64,
    /// Most missed ticks in a row, late and left out together.
    pub longest_row: u64,
    /// Tokens that did not reach every reader.
    pub undelivered: u64,
    /// CPU time from the first tick to the last.
    #[serde(default)]
    pub cpu_s: f64,
}

impl RealtimeReport {
    /// Ticks whose deadline was missed.
    pub fn missed(&self) -> u64 {
        self.late_ticks + self.left_out_ticks
    }
}

/// A process that died and was started again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restart {
    /// Which.
    pub process: String,
    /// How it ended, in words.
    pub how: String,
    /// Where the plant was.
    pub tick: u64,
}
