//! What a real-time process counts, and what the processes' counts come to.

use super::Attempt;
use crate::report::ProcessReport;
use anhyst_ipc::{Bin, Channel, Latency, LatencySummary, LinkReport, NodeId};
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
    /// Ticks in which a token was not there in time, and older ones were taken.
    pub late_ticks: u64,
    /// Ticks that were left out because the process was held up.
    pub left_out_ticks: u64,
    /// Most missed ticks in a row, late and left out together.
    pub longest_row: u64,
    /// Tokens that did not reach every reader.
    pub undelivered: u64,
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

/// How a reader of ours saw a foreign process, which leaves no report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForeignCount {
    /// Whose tokens.
    pub node: NodeId,
    /// On which channel.
    pub channel: Channel,
    /// Who read them.
    pub reader: NodeId,
    /// Ticks in which the token was not there in time.
    pub late_ticks: u64,
    /// Ticks whose token never came.
    pub missing_ticks: u64,
}

impl ForeignCount {
    /// Of the links of a run, those from these nodes.
    pub fn of(foreign: &[NodeId], links: &[LinkReport]) -> Vec<Self> {
        let theirs = links.iter().filter(|link| foreign.contains(&link.channel.producer()));
        theirs
            .map(|link| Self {
                node: link.channel.producer(),
                channel: link.channel,
                reader: link.reader,
                late_ticks: link.late,
                missing_ticks: link.lost,
            })
            .collect()
    }
}

/// What a real-time run comes to.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RealtimeSummary {
    /// Each process.
    pub processes: Vec<(String, RealtimeReport)>,
    /// Missed deadlines of all processes but the recorder's.
    pub missed: u64,
    /// Most misses in a row in any of them.
    pub longest_row: u64,
    /// Processes that were started again.
    pub restarts: Vec<Restart>,
    /// Foreign processes, as their readers saw them.
    #[serde(default)]
    pub external: Vec<ForeignCount>,
}

impl RealtimeSummary {
    /// Gathers the reports; none in lockstep.
    pub fn new(reports: &[ProcessReport]) -> Option<Self> {
        let processes: Vec<(String, RealtimeReport)> = reports
            .iter()
            .filter_map(|report| Some((report.process.clone(), report.realtime.clone()?)))
            .collect();
        if processes.is_empty() {
            return None;
        }
        let of_the_loop = || processes.iter().filter(|(name, _)| name != NodeId::Recorder.name());
        let missed = of_the_loop().map(|(_, report)| report.missed()).sum();
        let longest_row = of_the_loop().map(|(_, report)| report.longest_row).max();
        Some(Self {
            missed,
            longest_row: longest_row.unwrap_or_default(),
            restarts: reports.iter().flat_map(|report| report.restarts.clone()).collect(),
            processes,
            external: Vec::new(),
        })
    }

    /// The one distribution of a kind in the run.
    pub fn find(&self, kind: impl Fn(&RealtimeReport) -> Option<&Distribution>) -> Option<&Distribution> {
        self.processes.iter().find_map(|(_, report)| kind(report))
    }
}
