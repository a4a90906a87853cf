//! `anhyst fit --law`: hysteresis laws from measured data, chosen by what they predict of data that were kept back.

use super::fit_arguments::FitArguments;
use super::unread::unread;
use super::{Ending, json, save, stem};
use crate::law_picture;
use anhyst_identify::laws::{Family, LawData, LawError, LawFit, LawOptions, LawReport, Reaction, fit_laws};
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_measured::MeasuredRun;
use anhyst_report::number::Si;
use anhyst_report::table::Table;
use anhyst_scenario::to_ron;
use std::path::Path;

/// Runs the command.
///
/// # Errors
/// Bad data, a law that does not describe them, or a result that cannot be written.
pub fn run(arguments: &FitArguments, data: &Path, law: &str) -> miette::Result<Ending> {
    let reading = arguments.table.reading();
    let runs = MeasuredRun::read_records(data, &reading).map_err(unread("fit --law", data, &reading))?;
    let refused = |error: LawError| miette::miette!("{error}");
    let records = LawData::of(&runs, None, arguments.output).map_err(unread("fit --law", data, &reading))?;
    let bar = super::count_bar(0, "fit");
    let progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let found = fit_laws(
        Family::named(law),
        &records,
        &LawOptions::default(),
        arguments.threads.count(),
        &progress,
    )
    .map_err(refused)?;
    bar.finish_and_clear();
    let results = arguments.out.claim(&format!("fit-{}", stem(data)))?;
    write(&found, &records, &results.path)?;
    if arguments.json.json {
        crate::say!("{}", json(&found.report)?);
    } else {
        print(&found.report);
        crate::say!("\nresults: {} (fit.svg, law.ron)", results.path.display());
        let law = results.path.join("law.ron");
        crate::say!("a loop that follows it: anhyst new mine --material {}", quoted(&law));
    }
    Ok(Ending::Held)
}

fn write(found: &LawFit, data: &LawData, out: &Path) -> Result<(), RunError> {
    let setup = |error: String| RunError::Setup(error);
    let law = to_ron(&found.file).map_err(|error| setup(error.to_string()))? + "\n";
    let title = format!(
        "{}: {:.3} % of range rms, {:.3} % of what was kept back",
        found.report.law,
        100.0 * found.report.nrmse,
        100.0 * found.report.held_out_nrmse
    );
    let drawing = law_picture::picture(&title, data, &found.modelled).map_err(|error| setup(error.to_string()))?;
    save(out, "law.ron", &law)?;
    save(out, "fit.json", &(json(&found.report)? + "\n"))?;
    save(out, "fit.svg", &drawing)
}

fn print(report: &LawReport) {
    let mut table = Table::new(["law", "numbers", "left, % of range", "predicted, % of range"]);
    for own in &report.candidates {
        let chosen = if own.law == report.law { " <-" } else { "" };
        table.push([
            format!("{}{chosen}", own.law),
            own.parameters.to_string(),
            format!("{:.3}", 100.0 * own.nrmse),
            format!("{:.3}", 100.0 * own.held_out_nrmse),
        ]);
    }
    crate::say!("{}", table.terminal());
    crate::say!(
        "\n{} over {}: {} leaves {:.4e} {} rms ({:.3} % of the range), and predicts what was kept back to {:.3} %",
        report.output,
        report.input,
        report.law,
        report.rms,
        report.unit,
        100.0 * report.nrmse,
        100.0 * report.held_out_nrmse
    );
    if !report.why.is_empty() {
        crate::say!("taken: {}", report.why);
    }
    let Reaction { delay_s, lag_s } = report.reaction;
    for (name, amount_s, place) in [
        ("delay", delay_s, "amplifier.delay_ticks"),
        ("lag", lag_s, "amplifier.bandwidth_hz"),
    ] {
        if amount_s > 0.0 {
            crate::say!(
                "found beside the law: a {name} of {} before it; in a loop it is {place}, to which `anhyst new` takes it",
                Si(amount_s, "s")
            );
        }
    }
    crate::say!("assumed: {}", report.start);
    if report.falls {
        crate::say!(
            "assumed: the {} falls as the {} rises; the law is that of its negative",
            report.output,
            report.input
        );
    }
    for warning in &report.warnings {
        crate::say!("WARNING: {warning}");
    }
}
