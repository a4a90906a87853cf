//! `anhyst fit`: a material from measured loops. (arguments placeholder until diagnosis is there)

use super::Ending;
use clap::Args;

/// `fit`
#[derive(Debug, Args)]
pub struct FitArguments {}

/// Runs the command.
///
/// # Errors
/// Bad data.
pub fn run(_arguments: &FitArguments) -> miette::Result<Ending> {
    Err(miette::miette!("not there yet"))
}
