//! `anhyst view RUN`: the recording in the Rerun viewer.

use super::Ending;
use anhyst_launch::folder::RunFolder;
use clap::Args;
use std::path::PathBuf;

/// `view`
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Folder of the run, or a recording.
    pub run: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// If there is no recording or no viewer.
pub fn run(arguments: &ViewArguments) -> miette::Result<Ending> {
    let recordings = if arguments.run.is_dir() {
        RunFolder::open(&arguments.run).recordings()
    } else {
        vec![arguments.run.clone()]
    };
    if let Some(missing) = recordings.iter().find(|path| !path.is_file()) {
        return Err(miette::miette!(
            "{} does not exist: was the run recorded?",
            missing.display()
        ));
    }
    anhyst_recorder::view(&recordings, None).map_err(|error| miette::miette!("{error}"))?;
    Ok(Ending::Held)
}
