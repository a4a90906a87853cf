//! A run's page: the verdict, what was noticed, the error over time, figures, latencies. Self-contained, works without a network.

use crate::error::RunError;
use crate::error_course::ErrorWindow;
use crate::folder::RunFolder;
use crate::report::ProcessReport;
use crate::summary::Summary;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::page::{Block, Page, Section};
use anhyst_report::table::Verdict;
use anhyst_scenario::Scenario;

impl Summary {
    /// Of a run that has ended, written into its folder, with what was learned in it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn written(scenario: &Scenario, reports: &[ProcessReport], folder: &RunFolder) -> Result<Self, RunError> {
        let summary = Self::new(scenario, reports);
        let refuse = |path| move |cause| RunError::Write { path, cause };
        summary.write(folder).map_err(refuse(folder.summary()))?;
        let nodes = reports.iter().flat_map(|report| &report.nodes);
        if let Some(memory) = nodes.filter_map(|node| node.memory.as_ref()).next() {
            std::fs::write(folder.learned(), memory).map_err(refuse(folder.learned()))?;
        }
        let page = page(scenario, &summary).html();
        std::fs::write(folder.page(), page).map_err(refuse(folder.page()))?;
        Ok(summary)
    }
}

/// The page of a run that has ended.
fn page(scenario: &Scenario, summary: &Summary) -> Page {
    let sentence = summary.sentence(scenario.expect.settling_s);
    let (verdict, word) = match (summary.held, summary.failures.is_empty()) {
        (true, _) => (Verdict::Pass, "held"),
        (false, false) => (Verdict::Fail, "not held"),
        (false, true) => (Verdict::Note, "not judged"),
    };
    let mut run = Section::new("Verdict").badge(verdict, word).paragraph(&sentence);
    let told = [&summary.verdict.noticed[..], &summary.warnings].concat();
    if !told.is_empty() {
        run = run.block(Block::List(told));
    }
    let course = &summary.verdict.error_course;
    if !course.is_empty() {
        run = run.figure(
            Figure::new("Error over time", vec![error(course, summary)]).columns(1),
            "Reference minus true displacement, rms and largest magnitude in each of at most 256 windows of the judged time.",
        );
    }
    let mut page = Page::new(&format!("Run of {}", scenario.name), &sentence)
        .section(run.table(summary.figures()))
        .fact("digest", &summary.digest);
    if let Some(trajectory) = &summary.verdict.trajectory {
        page = page.section(trajectory.section());
    }
    if let Some(latencies) = summary.latency_table() {
        page = page.section(Section::new("Latencies, µs").table(latencies));
    }
    page
}

fn error(course: &[ErrorWindow], summary: &Summary) -> Chart {
    let curve =
        |of: fn(&ErrorWindow) -> f64, role: Role| Curve::new(course.iter().map(|own| [own.time_s, of(own)]), role);
    let mut curves = vec![
        curve(|own| own.max_m, Role::Measured).named("largest"),
        curve(|own| own.rms_m, Role::Remainder).named("rms"),
    ];
    if let (Some(tolerance_m), [first, .., last]) = (summary.tolerance_m, course) {
        let ends = [first.time_s, last.time_s].map(|time_s| [time_s, tolerance_m]);
        curves.push(Curve::new(ends, Role::Limit).named("tolerance"));
    }
    Chart::new("error", TIME, Axis::new("error", "m").logarithmic()).series(curves)
}
