//! `report.html`: the diagnosis as a page with pictures that stands alone.

use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::decomposition::{self, Decomposition, Kind, Part, Run, Value};
use anhyst_report::number::{Si, percent};
use anhyst_report::page::{Block, Page, Section};
use anhyst_report::table::{self, Cell, Table};

use crate::diagnosis::{Diagnosed, Diagnosis, FoundEffect, RunSeries, Verdict};
use crate::shares::{Contribution, ContributionKind};
use crate::statistics::rms;

const MAX_CANDIDATES: usize = 14;
/// Parts of the nuisance below this share are in the table of the JSON only.
const SHOWN_SHARE: f64 = 1e-3;
const CALIBRATION: &str = "calibration of the constants";

/// The page as HTML text; `command` is how it was made.
pub fn report(diagnosed: &Diagnosed, command: &str) -> String {
    page(diagnosed, command).html()
}

/// The page, for those who have more to put on it: the answer is its first section.
pub fn page(diagnosed: &Diagnosed, command: &str) -> Page {
    let own = &diagnosed.diagnosis;
    let calibration = calibration(diagnosed);
    let mut page = Page::new(&format!("Diagnosis of {}", own.model), &own.sentence).section(answer(own));
    if own.verdict != Verdict::Columns {
        for section in taken_apart(diagnosed, &calibration).sections() {
            page = page.section(section);
        }
        page = page.section(place(own));
    }
    if own.unknown_term.is_some() {
        page = page.section(unknown(own));
    }
    page = page.section(sight(own)).command(command);
    for data in &own.data {
        page = page.fact(&data.source, &format!("{} rows, XXH3 {}", data.rows, data.data_hash));
    }
    page
}

/// The parts of the gap for a terminal: effects, the louder nuisance, the constants that moved for sure, and what is left.
pub fn table(diagnosed: &Diagnosed) -> Table {
    let moved = &diagnosed.diagnosis.calibrated;
    let mut parts = taken_apart(diagnosed, &[]);
    for part in parts.parts.iter_mut().filter(|part| part.kind == Kind::Parameter) {
        let is_moved = |value: &Value| {
            moved
                .iter()
                .flat_map(|own| &own.values)
                .any(|own| own.name == value.name)
        };
        part.values.retain(is_moved);
    }
    parts.table()
}

fn answer(own: &Diagnosis) -> Section {
    let tone = match own.verdict {
        Verdict::None => table::Verdict::Pass,
        Verdict::Unknown | Verdict::Columns => table::Verdict::Fail,
        _ => table::Verdict::Note,
    };
    let mut section = Section::new("Answer").badge(tone, own.verdict.name());
    for finding in &own.first_things {
        section = section.paragraph(&finding.sentence);
    }
    if own.verdict == Verdict::Columns {
        return section;
    }
    section = section.paragraph(&format!(
        "{:.1} % of the gap's energy is explained. Held out: {} before, {} after; noise {}. Confidence: {:.2}.",
        100.0 * own.explained,
        Si(own.gap_before, unit(own)),
        Si(own.gap_after, unit(own)),
        Si(own.noise_rms, unit(own)),
        own.confidence
    ));
    if let Some(experiment) = &own.experiment {
        section = section.paragraph(&experiment.advice);
        if !experiment.scenario.is_empty() {
            section = section.block(Block::Code(experiment.scenario.clone()));
        }
    }
    section
}

/// What the constants together add, by run.
fn calibration(diagnosed: &Diagnosed) -> Vec<Vec<f64>> {
    let mut sum: Vec<Vec<f64>> = diagnosed.runs.iter().map(|run| vec![0.0; run.measured.len()]).collect();
    let parts = diagnosed.contributions.iter();
    for part in parts.filter(|own| own.kind == ContributionKind::Parameter) {
        for (own, more) in sum.iter_mut().flatten().zip(part.series.iter().flatten()) {
            *own += more;
        }
    }
    sum
}

fn taken_apart<'a>(diagnosed: &'a Diagnosed, calibration: &'a [Vec<f64>]) -> Decomposition<'a> {
    let own = &diagnosed.diagnosis;
    let mut parts: Vec<Part> = Vec::new();
    let mut series: Vec<&[Vec<f64>]> = Vec::new();
    let mut add = |found: &'a FoundEffect, kind: Kind| {
        let contribution = diagnosed.contributions.iter().find(|own| own.name == found.name);
        series.push(contribution.map_or(&[], |own: &Contribution| own.series.as_slice()));
        parts.push(Part {
            name: &found.name,
            kind,
            share: found.share,
            share_alone: Some(found.share_alone),
            over_field: kind == Kind::Effect,
            values: found.values.iter().map(value).collect(),
        });
    };
    own.effects.iter().for_each(|found| add(found, Kind::Effect));
    let loud = |found: &&FoundEffect| found.share.abs() > SHOWN_SHARE;
    own.nuisance
        .iter()
        .filter(loud)
        .for_each(|found| add(found, Kind::Nuisance));
    parts.push(Part {
        name: CALIBRATION,
        kind: Kind::Parameter,
        share: own.parameters.iter().map(|found| found.share).sum(),
        share_alone: None,
        over_field: false,
        values: own
            .parameters
            .iter()
            .flat_map(|found| found.values.iter().map(value))
            .collect(),
    });
    series.push(calibration);
    let gap = |run: &'a RunSeries| run.measured.iter().zip(&run.before).map(|(y, m)| y - m);
    Decomposition {
        unit: unit(own),
        gap_rms: rms(diagnosed.runs.iter().flat_map(gap)),
        remainder_rms: own.remainder_rms,
        noise_rms: own.noise_rms,
        remainder_share: 1.0 - own.explained,
        runs: diagnosed
            .runs
            .iter()
            .enumerate()
            .map(|(number, run)| Run {
                name: &run.source,
                tick_s: run.tick_s,
                field_a_per_m: &run.field_a_per_m,
                measured: &run.measured,
                nominal: &run.before,
                amended: &run.after,
                nuisance: &run.nuisance,
                contributions: series
                    .iter()
                    .map(|own| own.get(number).map_or(&[][..], Vec::as_slice))
                    .collect(),
            })
            .collect(),
        candidates: own
            .candidates
            .iter()
            .take(MAX_CANDIDATES)
            .map(|candidate| decomposition::Candidate {
                name: &candidate.name,
                left_rms: candidate.gap_after,
                chosen: candidate.delta_bic == 0.0,
                note: if own.ambiguous_with.contains(&candidate.name) {
                    "explains as well"
                } else {
                    ""
                },
            })
            .collect(),
        parts,
    }
}

fn value(own: &crate::diagnosis::FittedValue) -> Value<'_> {
    Value {
        name: &own.name,
        unit: &own.unit,
        value: own.value,
        standard_deviation: own.standard_deviation,
        nominal: own.nominal,
    }
}

fn place(own: &Diagnosis) -> Section {
    let mut table = Table::new([
        "channel",
        "over",
        "cell",
        "share of rows",
        "share of energy",
        "rms there",
    ]);
    for over in own.gap_over.iter().filter(|over| over.channel == "output") {
        for cell in &over.cells {
            table.push([
                Cell::from(format!("{} {}", over.channel, over.run)),
                Cell::from(over.over.as_str()),
                Cell::from(cell.label.as_str()),
                Cell::from(
                    cell.share_of_rows
                        .map_or_else(|| "–".to_owned(), |share| percent(share, 0)),
                ),
                Cell::from(percent(cell.share_of_energy, 0)),
                Cell::from(Si(cell.rms, unit(own)).to_string()),
            ]);
        }
    }
    let section = Section::new("Where the gap is").block(Block::List(own.place.clone()));
    if table.rows.is_empty() {
        return section.paragraph("What calibration and nuisance leave of the output does not stand above its noise.");
    }
    section.table(table)
}

fn unknown(own: &Diagnosis) -> Section {
    let mut section = Section::new("What has no name").paragraph(
        "A curve over a signal of the simulated run takes part of what is left. It is a description, not physics.",
    );
    for curve in own.unknown_term.iter().flat_map(|term| &term.curves) {
        let name = curve.over.name();
        let chart = Chart::new(
            "",
            Axis::new(name, ""),
            Axis::new("added to the output at rest", unit(own)),
        )
        .curve(Curve::over(&curve.knots, &curve.values, Role::Amended));
        section = section.figure(Figure::new(&format!("Over the {name}"), vec![chart]), "Fitted curve.");
    }
    section
}

fn sight(own: &Diagnosis) -> Section {
    let mut seen = Table::new(["term", "number", "smallest that would have been seen"]);
    for found in &own.detectable {
        seen.push([
            Cell::from(found.term.name()),
            Cell::from(found.quantity.as_str()),
            Cell::from(Si(found.smallest, &found.unit).to_string()),
        ]);
    }
    let unseen = own
        .not_excited
        .iter()
        .map(|own| format!("`{}`: {}", own.term, own.reason));
    Section::new("What these data could show")
        .table(seen)
        .block(Block::List(unseen.collect()))
}

/// As the report writes it: a strain is a length over a length.
fn unit(own: &Diagnosis) -> &str {
    if own.unit.is_empty() { "m/m" } else { &own.unit }
}
