//! `anhyst run A.ron B.ron …`: the same cut under several structures, in one table and one picture.
//!
//! Each scenario runs embedded and unrecorded; the result does not depend on that. Scenarios run side by side, one a core.

use super::Ending;
use super::progress_bar;
use super::run_arguments::RunArguments;
use anhyst_identify::parallel;
use anhyst_ipc::stop_requested;
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::summary::Summary;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::number::{Digits, Si};
use anhyst_report::page::{Page, Section};
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
    let summaries = summaries.into_iter().collect::<Result<Vec<_>, RunError>>();
    let summaries = summaries.map_err(|error| if stop_requested() { RunError::Stopped } else { error })?;
    super::save(&results.path, "compare.html", &page(&summaries).html())?;
    if arguments.json.json {
        let summaries: Result<Vec<_>, _> = summaries.iter().map(Summary::for_programs).collect();
        let summaries = summaries.map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{}", super::json(&summaries)?);
    } else {
        crate::say!("{}", table(&summaries).terminal());
        crate::say!("results: {} (compare.html)", results.path.display());
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

/// The runs side by side.
fn table(summaries: &[Summary]) -> Table {
    let shape = summaries.iter().any(|summary| summary.verdict.units.shape);
    let a = shape.then_some("a error rms");
    let header = ["scenario", "error rms", "error max", "rms / last"]
        .into_iter()
        .chain(a);
    let mut table = Table::new(header.chain(["largest field or input", "held"]));
    let reference = summaries.last().map_or(f64::NAN, |summary| summary.verdict.error_rms_m);
    for summary in summaries {
        let verdict = &summary.verdict;
        let units = &verdict.units;
        let a = shape.then(|| match units.shape {
            true => Si(verdict.a_error_rms_a_per_m, "A/m").to_string(),
            false => String::new(),
        });
        let figures = [
            summary.scenario.clone(),
            Si(verdict.error_rms_m, &units.output).to_string(),
            Si(verdict.error_max_m, &units.output).to_string(),
            Digits(verdict.error_rms_m / reference, 3).to_string(),
        ];
        let held = match (summary.held, summary.tolerance_m) {
            (true, _) => "yes",
            (false, Some(_)) => "no",
            (false, None) => "not judged",
        };
        let field = Si(verdict.field_peak_a_per_m, &units.input).to_string();
        table.push(figures.into_iter().chain(a).chain([field, held.to_owned()]));
    }
    table
}

/// One picture and one table of all.
fn page(summaries: &[Summary]) -> Page {
    let roles = [
        Role::Limit,
        Role::Nominal,
        Role::Remainder,
        Role::Measured,
        Role::Truth,
        Role::Amended,
    ];
    let curve = |(summary, role): (&Summary, &Role)| {
        let course = summary.verdict.error_course.iter();
        Curve::new(course.map(|window| [window.time_s, window.rms_m]), *role).named(&summary.scenario)
    };
    let unit = summaries
        .last()
        .map_or("m", |summary| summary.verdict.units.output.as_str());
    let curves = summaries.iter().zip(roles.iter().cycle()).map(curve);
    let chart =
        Chart::new("error", TIME, Axis::new("error, rms", unit).logarithmic()).series(curves.collect::<Vec<_>>());
    let caption = "Reference minus true output, rms in each of at most 256 windows of the judged time.";
    let section = Section::new("Error").table(table(summaries));
    let section = section.figure(Figure::new("Error over time", vec![chart]).columns(1), caption);
    Page::new(
        "Runs compared",
        "The same motion by several structures; the last one is what the others are held against.",
    )
    .section(section)
}
