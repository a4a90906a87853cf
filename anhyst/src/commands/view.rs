//! `anhyst view RUN`: the recording in the Rerun viewer.

use super::Ending;
use crate::cli::ViewArguments;
use crate::folder::RunFolder;

/// Runs the command.
///
/// # Errors
/// If there is no recording or no viewer.
pub fn run(arguments: &ViewArguments) -> miette::Result<Ending> {
    let recording = if arguments.run.is_dir() {
        RunFolder::open(&arguments.run).recording()
    } else {
        arguments.run.clone()
    };
    if !recording.is_file() {
        return Err(miette::miette!(
            "{} does not exist: was the run recorded?",
            recording.display()
        ));
    }
    anhyst_recorder::view(&[recording], None).map_err(|error| miette::miette!("{error}"))?;
    Ok(Ending::Held)
}
