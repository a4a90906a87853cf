//! What a process says of itself when its part of a run is over; the launcher reads it from the run's folder.

use crate::error::RunError;
use crate::realtime::{RealtimeReport, Restart};
use crate::verdict::Verdict;
use anhyst_ipc::{Change, LinkError, NodeReport};
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
    /// Its files, and their bytes.
    #[serde(default)]
    pub recording_parts: u64,
    /// See there.
    #[serde(default)]
    pub recording_bytes: u64,
    /// Ticks of which its plots show the ends.
    #[serde(default)]
    pub plotted_ticks: u64,
    /// Rows that the recording lost.
    pub dropped_rows: u64,
    /// Tokens that it slept on beside, because nobody woke it.
    #[serde(default)]
    pub lost_notifications: u64,
    /// What a real-time process counted besides.
    #[serde(default)]
    pub realtime: Option<RealtimeReport>,
    /// What the launcher knows: processes of this name that died before.
    #[serde(default)]
    pub restarts: Vec<Restart>,
    /// Changes of settings that it took while it ran.
    #[serde(default)]
    pub changes: Vec<Change>,
    /// From tick 0 to the last.
    pub loop_s: f64,
    /// Why it ended early.
    #[serde(default)]
    pub failure: Option<Failure>,
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

/// Why a process ended before its run did. A launcher's child tells it on its standard output, in one line, as soon as it knows:
/// no full disk can keep it from that, and nobody has to read prose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// The tick that it could not finish.
    pub tick: u64,
    /// What happened.
    pub cause: Cause,
    /// The same for people.
    pub sentence: String,
}

/// What happened to a process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// A link: whom it waited for, what did not come, or that it was told to end.
    Link(LinkError),
    /// Results cannot be written.
    Write,
    /// The program is at fault.
    Panic,
    /// What it was given cannot be used.
    Refused,
}

impl Failure {
    /// Of an error in tick `tick`.
    pub fn new(tick: u64, error: &RunError) -> Self {
        Self {
            tick,
            cause: match error {
                RunError::Link(error) => Cause::Link(error.clone()),
                RunError::Write { .. } => Cause::Write,
                _ => return Self::refused(error),
            },
            sentence: error.to_string(),
        }
    }

    /// Of what cannot be used.
    pub fn refused(sentence: &impl std::fmt::Display) -> Self {
        Self {
            tick: 0,
            cause: Cause::Refused,
            sentence: sentence.to_string(),
        }
    }

    /// Says it: to people on standard error, to a launcher (`supervised`) also on standard output.
    pub fn tell(&self, supervised: bool) {
        crate::complain!("{}", self.sentence);
        if supervised && let Ok(line) = serde_json::to_string(self) {
            crate::say!("{line}");
        }
    }

    /// What a launcher's child has told in one line of its standard output; none if the line is something else.
    pub fn heard(line: &str) -> Option<Self> {
        serde_json::from_str(line).ok()
    }
}

/// Lets a launcher's child that panics tell that before it ends.
pub fn tell_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        usual(panic);
        let failure = Failure {
            tick: 0,
            cause: Cause::Panic,
            sentence: panic.to_string().replace('\n', " "),
        };
        failure.tell(true);
    }));
}
