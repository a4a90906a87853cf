//! A run's page: the verdict, what was noticed, the error over time and over frequency, the loop, figures, latencies. Self-contained,
//! works without a network.

use crate::error::RunError;
use crate::error_course::ErrorWindow;
use crate::error_spectrum::SpectrumBand;
use crate::folder::RunFolder;
use crate::report::ProcessReport;
use crate::summary::Summary;
use crate::tuning::as_it_ran;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::number::Si;
use anhyst_report::page::{Block, Page, Section};
use anhyst_report::table::{Table, Verdict};
use anhyst_scenario::Scenario;
use std::path::Path;

impl Summary {
    /// Of a run that has ended, written into its folder, with what was learned in it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn written(scenario: &Scenario, reports: &[ProcessReport], folder: &RunFolder) -> Result<Self, RunError> {
        let scenario = &as_it_ran(scenario, reports, folder)?;
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

    /// The charts of a run's page as one picture, SVG.
    ///
    /// # Errors
    /// If it cannot be drawn or written.
    pub fn draw(&self, scenario: &Scenario, path: &Path) -> Result<(), RunError> {
        let drawn = page(scenario, self).charts().svg();
        let svg = drawn.map_err(|error| RunError::Setup(error.to_string()))?;
        std::fs::write(path, svg).map_err(|cause| RunError::Write {
            path: path.to_owned(),
            cause,
        })
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
    if !summary.changes.is_empty() {
        let mut changes =
            Table::new(["changed", "to", "in tick", "at"]).caption("What was changed while the run went on.");
        for change in &summary.changes {
            let time_s = change.tick as f64 * scenario.tick_s;
            let row = [
                change.set.to_string(),
                change.value.to_string(),
                change.tick.to_string(),
            ];
            changes.push(row.into_iter().chain([format!("{time_s:.4} s")]));
        }
        run = run.table(changes);
    }
    let course = &summary.verdict.error_course;
    if !course.is_empty() {
        run = run.figure(
            Figure::new("Error over time", vec![error(course, summary)]).columns(1),
            &format!(
                "Reference minus true {}, rms and largest magnitude in each of at most 256 windows of the judged time.",
                summary.verdict.units.output_name()
            ),
        );
    }
    let mut page = Page::new(&format!("Run of {}", scenario.name), &sentence)
        .section(run.table(summary.figures()))
        .fact("digest", &summary.digest)
        .fact("seed", &scenario.seed.to_string())
        .fact("anhyst", env!("CARGO_PKG_VERSION"))
        .fact("as it ran", "scenario.ron, beside this page");
    let own = &summary.verdict;
    let own = own.trajectory.as_ref().map(|course| course.section(&own.units.output));
    let sections = [
        summary.verdict.history.last_turns(&summary.verdict.units),
        own,
        spectrum(&summary.verdict),
        crate::loop_section::loop_section(scenario),
    ];
    let history = summary
        .verdict
        .history
        .sections(scenario.tick_s, &summary.verdict.units);
    for section in sections.into_iter().flatten().chain(history) {
        page = page.section(section);
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
    Chart::new(
        "error",
        TIME,
        Axis::new("error", summary.verdict.units.output.as_str()).logarithmic(),
    )
    .series(curves)
}

/// The error over frequency, and its lines by name.
fn spectrum(verdict: &crate::verdict::Verdict) -> Option<Section> {
    let (bands, output) = (&verdict.error_spectrum, &verdict.units.output);
    if bands.is_empty() {
        return None;
    }
    let curve = |of: fn(&SpectrumBand) -> f64, role: Role| {
        Curve::new(bands.iter().map(|own| [own.frequency_hz, of(own)]), role)
    };
    let chart = Chart::new(
        "spectrum of the error",
        Axis::new("frequency", "Hz").logarithmic(),
        Axis::new("amplitude density", &format!("{output}/√Hz")).logarithmic(),
    )
    .curve(curve(|own| own.sensor_m_per_sqrt_hz, Role::Limit).named("sensor's noise"))
    .curve(curve(|own| own.error_m_per_sqrt_hz, Role::Remainder).named("error"));
    let mut lines = Table::new(["line", "amplitude", "of the reference"])
        .caption("The strongest lines of the error, ten times and more above what is around them.");
    for line in &verdict.error_lines {
        let harmonic = line.harmonic.map(|number| format!("harmonic {number}"));
        lines.push([
            Si(line.frequency_hz, "Hz").to_string(),
            Si(line.amplitude_m, output).to_string(),
            harmonic.unwrap_or_else(|| "no harmonic".into()),
        ]);
    }
    let caption = "Reference minus true displacement, and what the sensor adds to the true displacement: the largest in each of at most 400 \
                   bands, Welch's method, the window of Blackman and Harris.";
    let section = Section::new("Spectrum").figure(Figure::new("", vec![chart]).columns(1), caption);
    Some(match verdict.error_lines.as_slice() {
        [] => section.paragraph("No line of the error stands ten times above what is around it."),
        _ => section.table(lines),
    })
}
