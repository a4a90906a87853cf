//! `anhyst compare A.ron B.ron …`: the same cut under several structures, in one table.
//!
//! Each scenario runs embedded and unrecorded; the result does not depend on that. Scenarios run side by side, one a core.

use super::Ending;
use super::progress_bar;
use crate::arguments::CompareArguments;
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::signals;
use anhyst_launch::summary::Summary;
use anhyst_launch::table::plain_table;
use anhyst_scenario::{Placement, Scenario, load_changed};
use comfy_table::CellAlignment;
use std::path::PathBuf;

/// Where each scenario's results go.
const RESULTS: &str = "runs/compare";

/// Runs the command. What the scenarios expect is shown, not judged: comparisons are made with some that fail.
///
/// # Errors
/// A bad scenario, or a run that failed.
pub fn run(arguments: &CompareArguments) -> miette::Result<Ending> {
    signals::install();
    let mut scenarios = Vec::new();
    for path in &arguments.scenarios {
        let scenario = load_changed(path, &arguments.settings, |scenario| {
            scenario.placement = Placement::Embedded;
            scenario.external.clear();
            scenario.recording.on = false;
        })?;
        scenarios.push(scenario);
    }
    // Folders of an earlier comparison would lie between this one's.
    match std::fs::remove_dir_all(RESULTS) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => {
            return Err(RunError::Write {
                path: RESULTS.into(),
                cause,
            }
            .into());
        }
        _ => {}
    }
    let summaries = run_all(&scenarios)?;
    if arguments.json {
        crate::say!(
            "{}",
            serde_json::to_string_pretty(&summaries).map_err(|error| RunError::Setup(error.to_string()))?
        );
    } else {
        print_table(&summaries);
    }
    Ok(Ending::Held)
}

fn run_all(scenarios: &[Scenario]) -> Result<Vec<Summary>, RunError> {
    let bar = progress_bar(scenarios.iter().map(Scenario::ticks).sum(), "compare");
    let summaries = crate::parallel::map(scenarios, |i, scenario| {
        let mut last = 0;
        run_one(scenario, i, &mut |tick| {
            bar.inc(tick - std::mem::replace(&mut last, tick))
        })
    });
    bar.finish_and_clear();
    summaries.into_iter().collect()
}

fn run_one(scenario: &Scenario, i: usize, progress: &mut dyn FnMut(u64)) -> Result<Summary, RunError> {
    let out = PathBuf::from(RESULTS).join(format!("{}-{}", i + 1, scenario.name));
    let folder = prepare(scenario, Some(&out))?;
    let reports = embedded(scenario, &folder, progress)?;
    let summary = Summary::new(scenario, &reports);
    summary.write(&folder).map_err(|cause| RunError::Write {
        path: folder.summary(),
        cause,
    })?;
    Ok(summary)
}

fn print_table(summaries: &[Summary]) {
    let mut table = plain_table();
    table.set_header([
        "scenario",
        "error rms, nm",
        "error max, nm",
        "rms / last",
        "a error rms, A/m",
        "field peak, kA/m",
        "held",
    ]);
    let reference = summaries.last().map_or(f64::NAN, |summary| summary.verdict.error_rms_m);
    for summary in summaries {
        let verdict = &summary.verdict;
        table.add_row([
            summary.scenario.clone(),
            format!("{:.2}", verdict.error_rms_m * 1e9),
            format!("{:.2}", verdict.error_max_m * 1e9),
            format!("{:.1}", verdict.error_rms_m / reference),
            format!("{:.2}", verdict.a_error_rms_a_per_m),
            format!("{:.2}", verdict.field_peak_a_per_m * 1e-3),
            if summary.held { "yes".into() } else { "no".into() },
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    crate::say!("{table}");
}
