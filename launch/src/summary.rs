//! What a run comes to: `summary.json` for programs, a table for people.

use crate::folder::RunFolder;
use crate::realtime::{ForeignCount, RealtimeSummary};
use crate::report::ProcessReport;
use crate::verdict::Verdict;
use anhyst_ipc::{Change, LinkReport, NodeId, NodeReport, Tunable, combine};
use anhyst_report::number::Si;
use anhyst_report::table::Table;
use anhyst_scenario::Scenario;
use serde::{Deserialize, Serialize};

/// Of the inputs that a law was fitted to: a run that goes no farther beyond them rounds.
const BEYOND_DATA: f64 = 0.1;

/// A law is known where it was fitted.
fn beyond_data(scenario: &Scenario, verdict: &Verdict) -> Option<String> {
    let [low, high] = scenario.material().ok()?.law.as_ref()?.input_extent;
    let (lowest, highest) = (verdict.field_lowest_a_per_m, verdict.field_highest_a_per_m);
    let room = BEYOND_DATA * (high - low);
    let unit = scenario.units().input;
    let ends = |low: f64, high: f64| format!("{} to {}", Si(low, &unit), Si(high, &unit));
    (lowest < low - room || highest > high + room).then(|| {
        format!(
            "the input went from {}, and the law was fitted to {} only: beyond it is a guess, and a stack that pushes must not be pulled; \
             guard.lowest_field_a_per_m and guard.field_limit_a_per_m hold it",
            ends(lowest, highest),
            ends(low, high)
        )
    })
}

/// The machine-readable summary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// True if the tolerance and all else that the scenario expects held; false, too, where no tolerance is stated.
    pub held: bool,
    /// What did not hold.
    pub failures: Vec<String>,
    /// What could have been told before the run, and where it went beyond what is known, as sentences.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Error, estimate, field.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// Name of the first event that the guard raised.
    #[serde(default)]
    pub first_event_name: Option<String>,
    /// The workpiece's tolerance, if one is stated.
    pub tolerance_m: Option<f64>,
    /// Tolerance minus largest error, at the samples and between them.
    pub tolerance_margin_m: Option<f64>,
    /// Settings that were changed while it ran.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<Change>,
    /// Field limit.
    pub field_limit_a_per_m: f64,
    /// Of the guard, where it is not as far as the limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lowest_field_a_per_m: Option<f64>,
    /// Ticks run.
    pub ticks: u64,
    /// Ticks per second of wall clock.
    pub ticks_per_s: f64,
    /// Simulated time over wall clock.
    pub realtime_factor: f64,
    /// Tokens that did not arrive, rows lost by the recording included.
    pub lost_tokens: u64,
    /// Tokens that a process slept on beside for up to 20 ms, because its notification was lost.
    #[serde(default)]
    pub lost_notifications: u64,
    /// Rows of the recording.
    pub recorded_rows: u64,
    /// Its files, and their bytes.
    #[serde(default)]
    pub recording_parts: u64,
    /// See there.
    #[serde(default)]
    pub recording_bytes: u64,
    /// Ticks of which its plots show the smallest and the largest value of each line; its tokens are whole.
    #[serde(default)]
    pub plotted_ticks: u64,
    /// Of a real-time run: what was asked of the system, missed deadlines, distributions, restarts.
    #[serde(default)]
    pub realtime: Option<RealtimeSummary>,
    /// Digest of all tokens of all nodes.
    pub digest: String,
    /// Digest of each node, in loop order.
    pub node_digests: Vec<(String, String)>,
    /// Latencies of the links between processes.
    pub links: Vec<LinkReport>,
}

impl Summary {
    /// Gathers the processes' reports.
    pub fn new(scenario: &Scenario, reports: &[ProcessReport]) -> Self {
        let mut nodes: Vec<&NodeReport> = reports.iter().flat_map(|report| &report.nodes).collect();
        nodes.sort_by_key(|report| report.node);
        let senders = || nodes.iter().filter(|report| report.node != NodeId::Recorder);
        let verdict = reports
            .iter()
            .find_map(|report| report.verdict.clone())
            .unwrap_or_default();
        let ticks = || senders().map(|report| report.ticks);
        // In real time a node may leave out the last ticks; the plant leaves out none.
        let ticks = if scenario.clock.realtime().is_some() {
            ticks().max()
        } else {
            ticks().min()
        };
        let ticks = ticks.unwrap_or_default();
        let verdict = verdict.of_ticks(ticks, scenario.tick_s, &scenario.expect);
        let failures = verdict.failures(&scenario.expect);
        let loop_s = reports.iter().map(|report| report.loop_s).fold(0.0, f64::max);
        let ticks_per_s = if loop_s > 0.0 { ticks as f64 / loop_s } else { 0.0 };
        let links: Vec<LinkReport> = nodes.iter().flat_map(|report| report.links.clone()).collect();
        Self {
            scenario: scenario.name.clone(),
            held: failures.is_empty() && scenario.expect.tolerance_m.is_some(),
            failures,
            warnings: scenario
                .warnings()
                .into_iter()
                .chain(beyond_data(scenario, &verdict))
                .collect(),
            first_event_name: verdict.first_event_name().map(str::to_owned),
            tolerance_m: scenario.expect.tolerance_m,
            tolerance_margin_m: verdict.least.map(|least| least.margin_m),
            changes: scenario.changes.clone(),
            field_limit_a_per_m: scenario.guard.field_limit_a_per_m,
            lowest_field_a_per_m: scenario.guard.lowest_field_a_per_m,
            verdict,
            ticks,
            ticks_per_s,
            realtime_factor: ticks_per_s * scenario.tick_s,
            lost_tokens: links.iter().map(|link| link.lost).sum::<u64>()
                + reports.iter().map(|report| report.dropped_rows).sum::<u64>(),
            lost_notifications: reports.iter().map(|report| report.lost_notifications).sum(),
            recorded_rows: reports.iter().map(|report| report.recorded_rows).sum(),
            recording_parts: reports.iter().map(|report| report.recording_parts).sum(),
            recording_bytes: reports.iter().map(|report| report.recording_bytes).sum(),
            plotted_ticks: reports.iter().map(|report| report.plotted_ticks).sum(),
            realtime: RealtimeSummary::new(reports).map(|realtime| RealtimeSummary {
                external: ForeignCount::of(&scenario.external_nodes(), &links),
                ..realtime
            }),
            digest: combine(senders().map(|report| (report.node.name(), report.digest))),
            node_digests: senders()
                .map(|report| (report.node.name().to_owned(), format!("{:016x}", report.digest)))
                .collect(),
            links,
        }
    }

    /// Writes `summary.json` and `digest.txt`.
    pub(crate) fn write(&self, folder: &RunFolder) -> std::io::Result<()> {
        std::fs::write(
            folder.summary(),
            serde_json::to_string_pretty(&self.for_programs()?)? + "\n",
        )?;
        let nodes: String = self
            .node_digests
            .iter()
            .map(|(node, digest)| format!("{digest}  {node}\n"))
            .collect();
        std::fs::write(folder.digest(), format!("{}  run\n{nodes}", self.digest))
    }

    /// As JSON, where a figure that is no finite number is null. (What processes tell each other says which of them it is.)
    ///
    /// # Errors
    /// None in practice: every summary has a JSON form.
    pub fn for_programs(&self) -> serde_json::Result<serde_json::Value> {
        let mut told = self.clone();
        told.verdict.history = told.verdict.history.without_pictures();
        let mut summary = serde_json::to_value(told)?;
        finite(&mut summary);
        Ok(summary)
    }

    /// The verdict, in a sentence.
    pub fn sentence(&self, settling_s: f64) -> String {
        let mut sentence = self.verdict.sentence(&self.failures, self.tolerance_m, settling_s);
        let is_tolerance = |change: &Change| change.set == Tunable::Tolerance;
        if self.failures.is_empty() && self.changes.iter().any(is_tolerance) {
            sentence.push_str(", and within what it was changed to");
        }
        sentence
    }

    /// The table for people.
    pub fn table(&self) -> String {
        let mut text = self.figures().terminal();
        if let Some(trajectory) = &self.verdict.trajectory {
            text.push_str("\n\n");
            text.push_str(&trajectory.terminal(&self.verdict.units.output));
        }
        if let Some(realtime) = &self.realtime {
            text.push_str("\n\nreal time\n");
            text.push_str(&crate::summary_realtime::table(realtime));
        }
        text
    }

    /// Its figures.
    pub(crate) fn figures(&self) -> Table {
        let mut table = Table::default();
        let verdict = &self.verdict;
        let units = &verdict.units;
        let length = |metres: f64| Si(metres, &units.output).to_string();
        let mut row = |name: &str, value: String| {
            table.push([name.to_owned(), value]);
        };
        row("error rms", length(verdict.error_rms_m));
        row(
            "error max",
            format!("{} at {:.3} s", length(verdict.error_max_m), verdict.error_max_at_s),
        );
        if let Some(between) = verdict.between {
            let (rms, max) = (length(between.rms_m), length(between.max_m));
            row(
                "between samples rms, max",
                format!("{rms}, {max} at {:.3} s", between.max_at_s),
            );
        }
        if verdict.uncounted_ticks > 0 {
            row(
                "not counted (turns, settling)",
                format!("{} ticks", verdict.uncounted_ticks),
            );
        }
        if let (Some(tolerance_m), Some(margin_m)) = (self.tolerance_m, self.tolerance_margin_m) {
            row(
                "tolerance, margin",
                format!("±{}, {}", length(tolerance_m), length(margin_m)),
            );
        }
        if units.shape {
            row(
                "a true, estimated",
                format!("{:.1}, {:.1} A/m", verdict.a_true_a_per_m, verdict.a_estimated_a_per_m),
            );
            if let Some(own) = &verdict.parameters {
                let ((ms, ms_off), (k, k_off), (c, c_off)) = (
                    own.saturation_magnetization_a_per_m,
                    own.pinning_a_per_m,
                    own.reversibility,
                );
                let told = format!("{ms:.0} ± {ms_off:.0} A/m, {k:.1} ± {k_off:.1} A/m, {c:.4} ± {c_off:.4}");
                row("Ms, k, c estimated", told);
            }
            row(
                "a error rms, final",
                format!(
                    "{:.2}, {:.2} A/m",
                    verdict.a_error_rms_a_per_m, verdict.a_final_error_a_per_m
                ),
            );
        }
        if units.shape {
            let [peak, limit] = [verdict.field_peak_a_per_m, self.field_limit_a_per_m].map(|own| Si(own, &units.input));
            row("field used, limit", format!("{peak}, {limit}"));
        } else {
            let ends = |own: [f64; 2]| format!("{} to {}", Si(own[0], &units.input), Si(own[1], &units.input));
            let lowest = self.lowest_field_a_per_m.unwrap_or(-self.field_limit_a_per_m);
            let limits = ends([lowest, self.field_limit_a_per_m]);
            row(
                "input used, limits",
                format!(
                    "{}, {limits}",
                    ends([verdict.field_lowest_a_per_m, verdict.field_highest_a_per_m])
                ),
            );
        }
        if verdict.guarded_ticks > 0 {
            let first = self.first_event_name.as_ref();
            let first = first.map(|name| format!(", first {name} at tick {}", verdict.first_event_tick));
            row(
                "guard acted in",
                format!("{} ticks{}", verdict.guarded_ticks, first.unwrap_or_default()),
            );
        }
        if verdict.watchdog_ticks > 0 {
            let (ticks, first) = (verdict.watchdog_ticks, verdict.first_watchdog_tick);
            row(
                "amplifier's watchdog acted in",
                format!("{ticks} ticks, first at tick {first}"),
            );
        }
        row("ticks", format!("{} ({} lost)", self.ticks, self.lost_tokens));
        if self.recording_parts > 0 {
            let megabytes = self.recording_bytes as f64 * 1e-6;
            let parts = match self.recording_parts {
                1 => String::new(),
                parts => format!(" in {parts} parts"),
            };
            let rows = match self.recorded_rows {
                all if all == self.ticks => String::new(),
                some => format!("{some} ticks, "),
            };
            let plots = match self.plotted_ticks {
                0 | 1 => String::new(),
                ticks => format!(", plots: ends of {ticks} ticks"),
            };
            row("recorded", format!("{rows}{megabytes:.1} MB{parts}{plots}"));
        }
        row(
            "ticks per second",
            format!("{:.0} ({:.2} times real time)", self.ticks_per_s, self.realtime_factor),
        );
        row("digest", self.digest.clone());
        table
    }

    /// Latencies of the links between processes; none where there are none.
    pub fn latencies(&self) -> Option<String> {
        let table = self.latency_table()?;
        Some(format!("latency, µs\n{}", table.terminal()))
    }

    pub(crate) fn latency_table(&self) -> Option<Table> {
        if self.links.iter().all(|link| link.latency.count == 0) {
            return None;
        }
        let mut table = Table::new(["link", "p50", "p99", "p99.9", "max"]);
        for link in self.links.iter().filter(|link| link.latency.count > 0) {
            let latency = &link.latency;
            let us = |value: f64| format!("{value:.1}");
            table.push([
                format!("{} → {}", link.channel, link.reader),
                us(latency.p50_us),
                us(latency.p99_us),
                us(latency.p999_us),
                us(latency.max_us),
            ]);
        }
        Some(table)
    }
}

/// Puts null where a figure is no finite number.
fn finite(value: &mut serde_json::Value) {
    use serde_json::Value;
    match value {
        Value::String(text) if matches!(text.as_str(), "inf" | "-inf" | "NaN") => *value = Value::Null,
        Value::Array(values) => values.iter_mut().for_each(finite),
        Value::Object(fields) => fields.values_mut().for_each(finite),
        _ => {}
    }
}
