//! `anhyst study`: what was studied with this product, made again.

mod blind;
mod laws;
mod paper;

use super::Ending;
use clap::Subcommand;

/// `study`
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Hide effects in rigs with nuisances, diagnose their runs, and count what is named rightly.
    ///
    /// Results: runs.jsonl, study.json, study.md, study.html.
    Blind(Box<blind::BlindArguments>),
    /// Compare the estimation laws under motions, noise and drift.
    Laws(laws::LawsArguments),
    /// Compute the paper's figures and put them on one page.
    ///
    /// Results: index.html, figure-N.svg, paper.rrd.
    Paper(paper::PaperArguments),
}

/// Runs the command.
///
/// # Errors
/// Bad input, or a result that cannot be written.
pub fn run(study: &StudyCommand) -> miette::Result<Ending> {
    match study {
        StudyCommand::Blind(arguments) => blind::run(arguments),
        StudyCommand::Laws(arguments) => laws::run(arguments),
        StudyCommand::Paper(arguments) => paper::run(arguments),
    }
}
