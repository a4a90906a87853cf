//! What commissioning came to: for programs, as a table, as a page.

use crate::fitness::Step;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::number::Si;
use anhyst_report::page::{Block, Page, Section};
use anhyst_report::table::{Table, Verdict};
use serde::Serialize;
use std::path::PathBuf;

/// `commission.json`.
#[derive(Debug, Default, Serialize)]
pub(super) struct Commission {
    /// The rig is in the loop.
    pub fit: bool,
    pub sentence: String,
    /// What was measured before the cuts.
    pub steps: Vec<Step>,
    pub cuts: Vec<Cut>,
    pub findings: Vec<String>,
}

/// One cut of the whole profile.
#[derive(Debug, Serialize)]
pub(super) struct Cut {
    /// What is believed: the scenario's model, or what a diagnosis made of it.
    pub believes: String,
    pub error_rms_m: f64,
    pub error_max_m: f64,
    /// How long the cut took.
    pub seconds: f64,
    pub folder: PathBuf,
    #[serde(skip)]
    pub course: Vec<[f64; 2]>,
}

/// The cuts.
pub(super) fn table(result: &Commission) -> Table {
    let mut table = Table::new(["cut", "the loop believes", "error rms", "error max", "took"]);
    for (index, cut) in result.cuts.iter().enumerate() {
        table.push([
            (index + 1).to_string(),
            cut.believes.clone(),
            Si(cut.error_rms_m, "m").to_string(),
            Si(cut.error_max_m, "m").to_string(),
            Si(cut.seconds, "s").to_string(),
        ]);
    }
    table
}

/// For `commission.html`.
pub(super) fn page(result: &Commission) -> Page {
    let roles = [Role::Nominal, Role::Amended, Role::Measured];
    let curves = result.cuts.iter().enumerate().map(|(index, cut)| {
        Curve::new(cut.course.iter().copied(), roles[index % roles.len()]).named(&format!("cut {}", index + 1))
    });
    let chart = Chart::new("each cut", TIME, Axis::new("error", "m").logarithmic()).series(curves);
    let colour = if result.fit { Verdict::Pass } else { Verdict::Fail };
    let mut section = Section::new("Commissioning")
        .badge(colour, if result.fit { "fit" } else { "not fit" })
        .paragraph(&result.sentence);
    if !result.cuts.is_empty() {
        section = section
            .figure(
                Figure::new("Error over time", vec![chart]).columns(1),
                "Largest error in each of at most 256 windows of the judged time.",
            )
            .table(table(result));
    }
    let findings = Block::List(result.findings.clone());
    let page = Page::new("Commissioning", &result.sentence)
        .section(section)
        .section(Section::new("Findings").block(findings));
    let steps = result.steps.iter().enumerate().map(|(place, step)| {
        let mut section = step.section.clone();
        section.id = format!("step-{place}-{}", section.id);
        // What is measured again is so with what the next cut believes.
        let same = |own: &&Step| own.name == step.name;
        if result.steps.iter().filter(same).count() > 1 {
            let cut = result.steps[..=place].iter().filter(same).count();
            section.heading = format!("{}, cut {cut}", section.heading);
        }
        section
    });
    steps.fold(page, Page::section)
}
