//! The part of a run's table that is about real time.

use crate::realtime::{RealtimeSummary, Restart};
use anhyst_report::table::Table;

/// The table for people.
pub fn table(summary: &RealtimeSummary) -> String {
    let mut table = Table::new([
        "process",
        "late",
        "left out",
        "longest row",
        "period p50",
        "p99",
        "max, µs",
    ]);
    for (name, report) in &summary.processes {
        let period = &report.period.summary;
        table.push([
            name.clone(),
            report.late_ticks.to_string(),
            report.left_out_ticks.to_string(),
            report.longest_row.to_string(),
            format!("{:.1}", period.p50_us),
            format!("{:.1}", period.p99_us),
            format!("{:.1}", period.max_us),
        ]);
    }
    let mut text = format!("{}\nmissed deadlines: {}", table.terminal(), summary.missed);
    let kinds = [
        ("waking of the timer", summary.find(|report| report.wake.as_ref())),
        (
            "measurement to coil field",
            summary.find(|report| report.round.as_ref()),
        ),
    ];
    for (name, summary) in kinds
        .into_iter()
        .filter_map(|(name, found)| Some((name, found?.summary)))
    {
        let (p50, p99, max) = (summary.p50_us, summary.p99_us, summary.max_us);
        text += &format!("\n{name}: p50 {p50:.1}, p99 {p99:.1}, max {max:.1} µs");
    }
    for seen in &summary.external {
        let (node, channel, reader) = (seen.node, seen.channel, seen.reader);
        let (late, missing) = (seen.late_ticks, seen.missing_ticks);
        text += &format!("\n{node} is external; its {channel} at {reader}: {late} ticks late, {missing} never came");
    }
    for attempt in asked(summary) {
        text += &format!("\n{attempt}");
    }
    for Restart { process, how, tick } in &summary.restarts {
        text += &format!("\n{process} {how} at tick {tick} and was started again");
    }
    text
}

/// What was asked of the system, each thing once, with who got it and who did not.
fn asked(summary: &RealtimeSummary) -> Vec<String> {
    let mut whats: Vec<&str> = Vec::new();
    let all = || summary.processes.iter().flat_map(|(_, report)| &report.asked);
    for attempt in all() {
        if !whats.contains(&attempt.what.as_str()) {
            whats.push(&attempt.what);
        }
    }
    let sentence = |what: &str| {
        let of_kind = || all().filter(|attempt| attempt.what == what);
        let refusal = of_kind().find_map(|attempt| attempt.refused_because.as_deref());
        let granted = of_kind().filter(|attempt| attempt.granted).count();
        let because = refusal
            .map(|refusal| format!(" (refused: {refusal})"))
            .unwrap_or_default();
        format!(
            "{what}: granted to {granted} of {} processes{because}",
            of_kind().count()
        )
    };
    whats.into_iter().map(sentence).collect()
}
