//! `anhyst run A.ron B.ron …`: the same cut under several structures, in one table.
//!
//! Each scenario runs embedded and unrecorded; the result does not depend on that. Scenarios run side by side, one a core.

use super::Ending;
use super::progress_bar;
use super::run_arguments::RunArguments;
use anhyst_identify::parallel;
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::summary::Summary;
use anhyst_report::table::Table;
use anhyst_scenario::{Placement, Scenario, load_changed};
use std::path::{Path, PathBuf};

/// Runs the command. What the scenarios expect is shown, not judged: comparisons are made with some that fail.
///
/// # Errors
/// A bad scenario, or a run that failed.
pub fn run(paths: &[PathBuf], arguments: &RunArguments) -> miette::Result<Ending> {
    let mut scenarios = Vec::new();
    for path in paths {
        let scenario = load_changed(path, &arguments.set.settings, |scenario| {
            scenario.placement = Placement::Embedded;
            scenario.external.clear();
            scenario.recording.on = false;
        })?;
        scenarios.push(scenario);
    }
    let results = arguments.out.claim("compare")?;
    remove_earlier(&results.path).map_err(|cause| RunError::Write {
        path: results.path.clone(),
        cause,
    })?;
    let bar = progress_bar(scenarios.iter().map(Scenario::ticks).sum(), "compare");
    let numbered: Vec<(usize, &Scenario)> = scenarios.iter().enumerate().collect();
    let summaries = parallel::map(arguments.threads.count(), &numbered, |(i, scenario)| {
        let mut last = 0;
        let out = results.path.join(format!("{}-{}", i + 1, scenario.name));
        run_one(scenario, &out, &mut |tick| {
            bar.inc(tick - std::mem::replace(&mut last, tick))
        })
    });
    bar.finish_and_clear();
    let summaries = summaries.into_iter().collect::<Result<Vec<_>, RunError>>()?;
    if arguments.json.json {
        let summaries: Result<Vec<_>, _> = summaries.iter().map(Summary::for_programs).collect();
        let summaries = summaries.map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{}", super::json(&summaries)?);
    } else {
        print_table(&summaries);
        crate::say!("results: {}", results.path.display());
    }
    Ok(Ending::Held)
}

/// Removes the folders `NUMBER-NAME` of an earlier comparison: they would lie between this one's.
fn remove_earlier(out: &Path) -> std::io::Result<()> {
    for entry in std::fs::read_dir(out)? {
        let entry = entry?;
        let name = entry.file_name();
        let number = name
            .to_string_lossy()
            .split_once('-')
            .map(|(number, _)| number.parse::<usize>().is_ok());
        if number == Some(true) && entry.file_type()?.is_dir() {
            std::fs::remove_dir_all(entry.path())?;
        }
    }
    Ok(())
}

fn run_one(scenario: &Scenario, out: &Path, progress: &mut dyn FnMut(u64)) -> Result<Summary, RunError> {
    let folder = prepare(scenario, Some(out))?;
    let reports = embedded(scenario, &folder, progress)?;
    Summary::written(scenario, &reports, &folder)
}

fn print_table(summaries: &[Summary]) {
    let mut table = Table::new([
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
        table.push([
            summary.scenario.clone(),
            format!("{:.2}", verdict.error_rms_m * 1e9),
            format!("{:.2}", verdict.error_max_m * 1e9),
            format!("{:.1}", verdict.error_rms_m / reference),
            format!("{:.2}", verdict.a_error_rms_a_per_m),
            format!("{:.2}", verdict.field_peak_a_per_m * 1e-3),
            if summary.held { "yes".into() } else { "no".into() },
        ]);
    }
    crate::say!("{}", table.terminal());
}
