//! What the counts of a real-time run's processes come to.

use super::report::{Distribution, RealtimeReport, Restart};
use crate::report::ProcessReport;
use anhyst_ipc::{Channel, LinkReport, NodeId};
use serde::{Deserialize, Serialize};

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
        let mut summary = Self {
            restarts: reports.iter().flat_map(|report| report.restarts.clone()).collect(),
            processes,
            ..Self::default()
        };
        summary.missed = summary.of_the_loop().map(RealtimeReport::missed).sum();
        let longest_row = summary.of_the_loop().map(|report| report.longest_row).max();
        summary.longest_row = longest_row.unwrap_or_default();
        Some(summary)
    }

    /// Of all processes but the recorder's.
    fn of_the_loop(&self) -> impl Iterator<Item = &RealtimeReport> {
        let others = self
            .processes
            .iter()
            .filter(|(name, _)| name != NodeId::Recorder.name());
        others.map(|(_, report)| report)
    }

    /// Ticks that the process missed that missed most.
    pub fn most_missed(&self) -> u64 {
        self.of_the_loop().map(RealtimeReport::missed).max().unwrap_or_default()
    }

    /// CPU time of the loop's processes, s.
    pub fn cpu_s(&self) -> f64 {
        self.of_the_loop().map(|report| report.cpu_s).sum()
    }

    /// The one distribution of a kind in the run.
    pub fn find(&self, kind: impl Fn(&RealtimeReport) -> Option<&Distribution>) -> Option<&Distribution> {
        self.processes.iter().find_map(|(_, report)| kind(report))
    }
}
