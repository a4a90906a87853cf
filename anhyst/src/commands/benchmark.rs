//! `anhyst benchmark`: every hysteresis law on open data, beside a line and what others have published.

use super::{Ending, json, save};
use crate::arguments::{JsonArgument, OutArgument, ThreadsArgument};
use anhyst_report::table::Table;
use anhyst_studies::scoreboard::{Scoreboard, scoreboard, sets};
use clap::Args;
use std::path::PathBuf;

/// `benchmark`
#[derive(Debug, Args)]
pub struct BenchmarkArguments {
    /// Folder of the open data; nothing is fetched, and what is missing is named with its source.
    #[arg(long, value_name = "FOLDER")]
    pub data: PathBuf,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the fits.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How benchmark.json is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A folder without open data, a file that cannot be read, or a result that cannot be written.
pub fn run(arguments: &BenchmarkArguments) -> miette::Result<Ending> {
    let bar = super::count_bar(sets() as u64, "benchmark");
    let board = scoreboard(&arguments.data, arguments.threads.count(), &mut |_| bar.inc(1))
        .map_err(|error| miette::miette!("{error}"))?;
    bar.finish_and_clear();
    let results = arguments.out.claim("benchmark")?;
    save(&results.path, "benchmark.json", &(json(&board)? + "\n"))?;
    save(&results.path, "benchmark.md", &markdown(&board))?;
    if arguments.json.json {
        crate::say!("{}", json(&board)?);
    } else {
        crate::say!("{}", markdown(&board));
        crate::say!("results: {}", results.path.display());
    }
    Ok(Ending::Held)
}

/// A heading and a table for each set.
fn markdown(board: &Scoreboard) -> String {
    let mut text = String::new();
    for set in &board.sets {
        let mut table = Table::new([
            "law",
            "numbers",
            "fit leaves, %",
            "score, %",
            "score",
            "each left out, %",
        ]);
        for own in &set.laws {
            let chosen = if own.law == set.chosen { " <-" } else { "" };
            let left_out: Vec<String> = own.left_out_percent.iter().map(|share| format!("{share:.2}")).collect();
            let score = if left_out.is_empty() {
                format!("{:.3e} {}", own.score, set.unit)
            } else {
                String::new()
            };
            table.push([
                format!("{}{chosen}", own.law),
                own.parameters.to_string(),
                format!("{:.3}", own.fitted_percent),
                format!("{:.3}", own.score_percent),
                score,
                left_out.join(" "),
            ]);
        }
        text += &format!(
            "\n### {}\n\n{}; `<-`: what `fit --law auto` takes. Published: {}. Data: {}.\n\n{}\n",
            set.set,
            set.metric,
            set.published,
            set.source,
            table.markdown()
        );
    }
    for (set, own) in board.sets.iter().filter_map(|set| set.on_line.map(|own| (set, own))) {
        let number = |value: f64| format!("{value:.3e}");
        let mut table = Table::new(["free run of bent-plays, rms after the mean", set.unit]);
        for (of, value) in [
            ("weights up to 60 % wrong", own.wrong),
            ("adapted along this file for 10 s", own.after_10_s),
            ("adapted to its end", own.at_end),
            ("the last, along the file that was fitted", own.other_at_end),
        ] {
            table.push([of.to_owned(), number(value)]);
        }
        let heading = format!("On line: {}, the other file", set.set);
        text += &format!("\n### {heading}\n\nThe worst of five draws.\n\n{}\n", table.markdown());
    }
    let mut table = Table::new(["spring", "numbers", "multisine, m", "sweep, m"]);
    for own in &board.oscillator {
        let [multisine, sweep] = [own.multisine_m, own.sweep_m].map(|rms| format!("{rms:.2e}"));
        table.push([own.law.to_owned(), own.parameters.to_string(), multisine, sweep]);
    }
    text += &format!(
        "\n### Bouc-Wen oscillator\n\nrms of the free run along the test signals, after a fit to a noisy multisine; data made here from the benchmark's published \
         constants (Noël and Schoukens, nonlinearbenchmark.org), because the files may not be copied. Published: identified models of several \
         kinds on that site.\n\n{}\n",
        table.markdown()
    );
    for missing in &board.missing {
        text += &format!("\nnot there: {missing}\n");
    }
    text
}
