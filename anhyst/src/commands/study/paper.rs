//! `anhyst study paper`: the paper's figures, computed, on one page.

use crate::arguments::{JsonArgument, OutArgument};
use crate::commands::{Ending, count_bar, json};
use anhyst_report::table::Cell;
use anhyst_studies::paper::{Figure, figures, publish, table};
use clap::Args;

/// `paper`
#[derive(Debug, Args)]
pub struct PaperArguments {
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// How the figures behind the figures are printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// How many figures there are.
const FIGURES: u64 = 5;

/// Runs the command.
///
/// # Errors
/// A result that cannot be written.
pub fn run(arguments: &PaperArguments) -> miette::Result<Ending> {
    let results = arguments.out.claim("paper")?;
    let bar = count_bar(FIGURES, "paper");
    let figures = figures(|| bar.inc(1))?;
    bar.finish_and_clear();
    publish(&figures, &results.path)?;
    if arguments.json.json {
        let found: Vec<_> = figures.iter().map(|figure| (figure.number, &figure.findings)).collect();
        crate::say!("{}", json(&found)?);
    } else {
        print(&figures);
        crate::say!("\nresults: {}", results.path.join("index.html").display());
    }
    Ok(Ending::Held)
}

fn print(figures: &[Figure]) {
    let mut shown = table(figures.iter().flat_map(|figure| &figure.findings));
    shown.header.insert(0, "figure".to_owned());
    let numbers = figures
        .iter()
        .flat_map(|figure| figure.findings.iter().map(|_| figure.number));
    for (row, number) in shown.rows.iter_mut().zip(numbers) {
        row.insert(0, Cell::from(number.to_string()));
    }
    crate::say!("{}", shown.terminal());
}
