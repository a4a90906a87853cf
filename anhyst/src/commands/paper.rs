//! `anhyst paper`: the paper's figures, computed, on one page.

use super::Ending;
use anhyst_launch::error::RunError;
use anhyst_launch::table::plain_table;
use anhyst_studies::paper::{Figure, figures, publish};
use clap::Args;
use std::path::PathBuf;

/// `paper`
#[derive(Debug, Args)]
pub struct PaperArguments {
    /// Folder of the results: index.html, figure-N.svg, figure-N.png, paper.rrd.
    #[arg(long, default_value = "runs/paper")]
    pub out: PathBuf,
    /// Print the figures behind the figures as JSON.
    #[arg(long)]
    pub json: bool,
}

/// How many figures there are.
const FIGURES: u64 = 5;

/// Runs the command.
///
/// # Errors
/// A result that cannot be written.
pub fn run(arguments: &PaperArguments) -> miette::Result<Ending> {
    std::fs::create_dir_all(&arguments.out).map_err(|cause| RunError::Write {
        path: arguments.out.clone(),
        cause,
    })?;
    let bar = super::count_bar(FIGURES, "paper");
    let figures = figures(|| bar.inc(1))?;
    bar.finish_and_clear();
    publish(&figures, &arguments.out)?;
    if arguments.json {
        let found: Vec<_> = figures.iter().map(|figure| (figure.number, &figure.findings)).collect();
        let text = serde_json::to_string_pretty(&found).map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{text}");
    } else {
        print(&figures);
        crate::say!("\nresults: {}", arguments.out.join("index.html").display());
    }
    Ok(Ending::Held)
}

fn print(figures: &[Figure]) {
    let mut table = plain_table();
    table.set_header(["figure", "what", "paper", "found", "with the printed erratum"]);
    for figure in figures {
        for finding in &figure.findings {
            table.add_row([
                figure.number.to_string(),
                finding.what.clone(),
                finding.paper.clone(),
                finding.found.clone(),
                finding.as_printed.clone(),
            ]);
        }
    }
    crate::say!("{table}");
}
