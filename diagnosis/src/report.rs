//! `report.html`: the diagnosis as a page with pictures that stands alone.

use crate::diagnosis::{Diagnosed, Diagnosis, RunSeries, Verdict};
use crate::error::DiagnosisError;
use crate::wording::Amount;
use anhyst_report::page::{self, Block, Cell, Page, Section, Table};
use anhyst_report::plot::{Axis, Figure, Line, Panel, Role};

const WIDE: (u32, u32) = (900, 360);
const TALL: (u32, u32) = (900, 520);
const MOST_CANDIDATES: usize = 14;

/// The page as HTML text; `command` is how it was made.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn report(diagnosed: &Diagnosed, command: &str) -> Result<String, DiagnosisError> {
    Ok(page(diagnosed, command)?.html())
}

/// The page, for those who have more to put on it: the answer is its first section.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn page(diagnosed: &Diagnosed, command: &str) -> Result<Page, DiagnosisError> {
    let own = &diagnosed.diagnosis;
    let mut page = Page::new(&format!("Diagnosis of {}", own.model), &own.sentence)
        .section(answer(own))
        .section(gap(own, &diagnosed.runs)?)
        .section(candidates(own)?)
        .section(loops(own, &diagnosed.runs)?);
    if own.unknown_term.is_some() {
        page = page.section(unknown(own)?);
    }
    page = page.section(sight(own)).command(command);
    for data in &own.data {
        page = page.fact(&data.source, &format!("{} rows, XXH3 {}", data.rows, data.data_hash));
    }
    Ok(page)
}

fn number(value: f64) -> String {
    format!("{value:.5e}")
}

fn answer(own: &Diagnosis) -> Section {
    let tone = match own.verdict {
        Verdict::None => page::Verdict::Pass,
        Verdict::Unknown => page::Verdict::Fail,
        _ => page::Verdict::Note,
    };
    let mut table = Table::new(&["effect", "number", "value", "standard deviation", "unit"]);
    for effect in own.effects.iter().chain(&own.calibrated) {
        for value in &effect.values {
            table.rows.push(vec![
                Cell::from(effect.name.as_str()),
                Cell::from(value.name.as_str()),
                Cell::from(number(value.value).as_str()),
                Cell::from(value.standard_deviation.map_or("not fixed".to_owned(), number).as_str()),
                Cell::from(value.unit.as_str()),
            ]);
        }
    }
    let mut section = Section::new("Answer")
        .badge(tone, own.verdict.name())
        .paragraph(&format!(
            "Held-out gap: {} before, {} after; noise {}. Confidence among the explanations fitted: {:.3}.",
            Amount(own.gap_before, &own.unit),
            Amount(own.gap_after, &own.unit),
            Amount(own.noise_rms, &own.unit),
            own.confidence
        ));
    if !own.effects.is_empty() {
        section = section.table(table);
    }
    if let Some(rival) = &own.runner_up {
        section = section.paragraph(&format!(
            "Runner-up: `{}`, {:.0} higher in BIC, leaves {}.",
            rival.name,
            rival.delta_bic,
            Amount(rival.gap_after, &own.unit)
        ));
    }
    if let Some(experiment) = &own.experiment {
        section = section.paragraph(&experiment.advice);
        if !experiment.scenario.is_empty() {
            section = section.block(Block::Code(experiment.scenario.clone()));
        }
    }
    section
}

fn gap(own: &Diagnosis, runs: &[RunSeries]) -> Result<Section, DiagnosisError> {
    let mut section = Section::new("Where the gap is").block(Block::List(own.place.clone()));
    for run in runs {
        let (x, axis) = along(run);
        let left = |model: &[f64]| run.measured.iter().zip(model).map(|(y, m)| y - m).collect::<Vec<f64>>();
        let panel = Panel::new(&run.source, axis, Axis::new("measured − model", unit(own)))
            .line(Line::over(&x, &left(&run.before), Role::Model).named("model as given"))
            .line(Line::over(&x, &left(&run.after), Role::Amended).named("with what was found"));
        section = section.figure(
            &Figure::new("Residual before and after").panel(panel),
            WIDE,
            "Measured minus model along the run.",
        )?;
    }
    let mut table = Table::new(&[
        "channel",
        "over",
        "cell",
        "share of rows",
        "share of energy",
        "rms there",
    ]);
    for over in own.gap_over.iter().filter(|over| over.channel == "output") {
        for cell in &over.cells {
            table.rows.push(vec![
                Cell::from(format!("{} {}", over.channel, over.run).as_str()),
                Cell::from(over.over.as_str()),
                Cell::from(cell.label.as_str()),
                Cell::from(
                    cell.share_of_rows
                        .map_or_else(|| "–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
                        .as_str(),
                ),
                Cell::from(format!("{:.0} %", 100.0 * cell.share_of_energy).as_str()),
                Cell::from(Amount(cell.rms, &own.unit).to_string().as_str()),
            ]);
        }
    }
    Ok(section.table(table))
}

fn candidates(own: &Diagnosis) -> Result<Section, DiagnosisError> {
    let mut table = Table::new(&["explanation", "terms", "BIC over the answer's", "held-out gap"]);
    for candidate in own.candidates.iter().take(MOST_CANDIDATES) {
        table.rows.push(vec![
            Cell::from(candidate.name.as_str()),
            Cell::from(candidate.terms.to_string().as_str()),
            Cell::from(format!("{:.1}", candidate.delta_bic).as_str()),
            Cell::from(Amount(candidate.gap_after, &own.unit).to_string().as_str()),
        ]);
    }
    let ranked: Vec<(f64, f64)> = own
        .candidates
        .iter()
        .enumerate()
        .map(|(rank, own)| (rank as f64 + 1.0, own.gap_after))
        .collect();
    let panel = Panel::new(
        "",
        Axis::new("rank", ""),
        Axis::new("held-out gap", unit(own)).logarithmic(),
    )
    .line(Line::new(ranked, Role::Measured).as_points())
    .horizontal(own.noise_rms, Role::Limit, "noise");
    let section = Section::new("Candidates, ranked").table(table).figure(
        &Figure::new("What each explanation leaves").panel(panel),
        WIDE,
        "Held-out rms of the output by rank of the BIC.",
    )?;
    Ok(section)
}

fn loops(own: &Diagnosis, runs: &[RunSeries]) -> Result<Section, DiagnosisError> {
    let mut section = Section::new("Loops");
    for run in runs {
        let panel = Panel::new(&run.source, Axis::new("field", "A/m"), Axis::new("output", unit(own)))
            .line(Line::over(&run.field_a_per_m, &run.measured, Role::Measured).named("measured"))
            .line(Line::over(&run.field_a_per_m, &run.before, Role::Model).named("model as given"))
            .line(Line::over(&run.field_a_per_m, &run.after, Role::Amended).named("with what was found"));
        section = section.figure(&Figure::new("Output over field").panel(panel), TALL, "Whole run.")?;
    }
    Ok(section)
}

fn unknown(own: &Diagnosis) -> Result<Section, DiagnosisError> {
    let mut section = Section::new("Free-form term");
    let Some(term) = &own.unknown_term else {
        return Ok(section);
    };
    section = section.paragraph(&format!(
        "It explains {:.0} % of the gap's energy on held-out rows. It is a description, not physics.",
        100.0 * term.share_of_energy_explained
    ));
    for curve in term.curves.iter().filter(|curve| curve.second_knots.is_empty()) {
        let name = curve.over.name();
        let panel = Panel::new("", Axis::new(&name, ""), Axis::new("added to the output", unit(own))).line(Line::over(
            &curve.knots,
            &curve.values,
            Role::Amended,
        ));
        section = section.figure(
            &Figure::new(&format!("Over {name}")).panel(panel),
            WIDE,
            "Fitted curve.",
        )?;
    }
    Ok(section)
}

fn sight(own: &Diagnosis) -> Section {
    let mut seen = Table::new(&["term", "number", "smallest that would have been seen", "unit"]);
    for found in &own.detectable {
        seen.rows.push(vec![
            Cell::from(found.term.name()),
            Cell::from(found.quantity.as_str()),
            Cell::from(format!("{:.2e}", found.smallest).as_str()),
            Cell::from(found.unit.as_str()),
        ]);
    }
    let unseen = own
        .not_excited
        .iter()
        .map(|own| format!("`{}`: {}", own.term, own.reason))
        .collect();
    Section::new("What these data could show")
        .table(seen)
        .block(Block::List(unseen))
}

fn unit(own: &Diagnosis) -> &str {
    &own.unit
}

fn along(run: &RunSeries) -> (Vec<f64>, Axis) {
    let rows = run.measured.len();
    match run.tick_s {
        Some(tick_s) => (
            (0..rows).map(|row| row as f64 * tick_s).collect(),
            Axis::new("time", "s"),
        ),
        None => ((0..rows).map(|row| row as f64).collect(), Axis::new("row", "")),
    }
}
