//! What a process says of itself when its part of a run is over; the launcher reads it from the run's folder.

use crate::judge::Verdict;
use crate::realtime::{RealtimeReport, Restart};
use anhyst_ipc::NodeReport;
use serde::{Deserialize, Serialize};

/// What a process reports.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ProcessReport {
    /// Its name.
    pub process: String,
    /// Its nodes.
    pub nodes: Vec<NodeReport>,
    /// The judge's verdict, from the process that has the recorder.
    pub verdict: Option<Verdict>,
    /// Rows that the recording holds.
    pub recorded_rows: u64,
    /// Rows that the recording lost.
    pub dropped_rows: u64,
    /// What a real-time process counted besides.
    #[serde(default)]
    pub realtime: Option<RealtimeReport>,
    /// What the launcher knows: processes of this name that died before.
    #[serde(default)]
    pub restarts: Vec<Restart>,
    /// From tick 0 to the last.
    pub loop_s: f64,
    /// Why it ended early.
    pub error: Option<String>,
    /// True if it ended because it was asked to.
    pub stopped: bool,
    /// How the field was brought to safety, if it ended early.
    #[serde(default)]
    pub ending: Option<Ending>,
}

/// What a process did after its links had failed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// The tick that it could not finish.
    pub failed_at_tick: u64,
    /// Ticks that were still heard, then ticks that its nodes answered alone.
    pub heard_ticks: u64,
    /// See there.
    pub alone_ticks: u64,
}
