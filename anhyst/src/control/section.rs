//! The comparison as a table for the terminal and a section of the report.

use super::{Control, Cut};
use anhyst_launch::error_course::ErrorWindow;
use anhyst_launch::say::quoted;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role, TIME};
use anhyst_report::number::Si;
use anhyst_report::page::{Bar, Bars, Block, Section};
use anhyst_report::table::Table;

impl Control {
    /// What each belief is worth.
    pub fn table(&self) -> Table {
        let mut table = Table::new(["the loop believes", "feedback", "error rms", "error max", "rms / old"]);
        for cut in &self.cuts {
            table.push(row(cut));
        }
        table
    }

    /// Everything to be read beside the table.
    pub fn sentences(&self) -> Vec<String> {
        let refused = self.cuts.iter().filter_map(|cut| {
            let why = cut.refused.as_ref()?;
            Some(format!(
                "The cut with the model \"{}\" cannot be made: {why}",
                cut.believes
            ))
        });
        self.replaced
            .iter()
            .chain(&self.compensation)
            .cloned()
            .chain(refused)
            .collect()
    }
}

/// For `report.html`.
pub fn section(control: &Control) -> Section {
    let bars = Bars {
        caption: "rms of reference minus true displacement, on a logarithmic scale.".to_owned(),
        unit: "m".to_owned(),
        logarithmic: true,
        bars: control.cuts.iter().map(bar).collect(),
        limit: None,
    };
    let recording = control.recording.as_ref();
    let recording = recording.map_or_else(String::new, |folder| {
        format!(" The amended cut was recorded: `anhyst view {}`.", quoted(folder))
    });
    Section::new("In the loop")
        .paragraph(&format!(
            "The cut of the scenario `{}` on a plant that is the amended model. Error: reference minus true displacement of the tip.{recording}",
            control.scenario
        ))
        .figure(
            Figure::new("Error over time", courses(control)).columns(1),
            "Largest error in each of at most 256 windows of the judged time.",
        )
        .block(Block::Bars(bars))
        .table(control.table())
        .block(Block::List(control.sentences()))
}

/// With the scenario's feedback and without.
fn courses(control: &Control) -> Vec<Chart> {
    let chart = |feedback: bool| {
        let cuts = control.cuts.iter().filter(move |cut| cut.feedback == feedback);
        let curves = cuts.filter(|cut| !cut.course.is_empty()).map(|cut| {
            let point = |own: &ErrorWindow| [own.time_s, own.max_m];
            Curve::new(cut.course.iter().map(point), role(cut)).named(&cut.believes)
        });
        let title = if feedback { "with feedback" } else { "without" };
        Chart::new(title, TIME, Axis::new("error", "m").logarithmic()).series(curves)
    };
    let charts = [true, false].map(chart).into_iter();
    charts.filter(|chart| !chart.curves.is_empty()).collect()
}

fn role(cut: &Cut) -> Role {
    match cut.believes.as_str() {
        "old" => Role::Nominal,
        "amended" => Role::Amended,
        _ => Role::Limit,
    }
}

fn bar(cut: &Cut) -> Bar {
    Bar {
        name: format!(
            "{}, {}",
            cut.believes,
            if cut.feedback { "with feedback" } else { "without" }
        ),
        value: cut.error_rms_m,
        role: role(cut),
        note: if cut.refused.is_some() { "cannot be made" } else { "" }.to_owned(),
    }
}

fn row(cut: &Cut) -> [String; 5] {
    let length = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| Si(value, "m").to_string());
    [
        cut.believes.clone(),
        if cut.feedback { "as the scenario has it" } else { "none" }.to_owned(),
        length(cut.error_rms_m),
        length(cut.error_max_m),
        cut.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.3}")),
    ]
}
