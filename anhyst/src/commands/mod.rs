//! One file per subcommand.

pub mod bench;
pub mod benchmark;
#[cfg(feature = "bridge")]
pub mod bridge;
pub mod check;
#[cfg(feature = "recorder")]
pub mod commission;
pub mod data;
pub mod diagnose;
pub mod doctor;
pub mod doctor_arguments;
mod doctor_lockstep;
pub mod doctor_realtime;
pub mod estimate;
pub mod explain;
#[cfg(feature = "recorder")]
pub mod export;
#[cfg(feature = "recorder")]
mod export_fmu;
pub mod failed;
pub mod fit;
pub mod fit_arguments;
pub mod fit_law;
pub mod graph;
pub mod interface;
mod least;
pub mod live;
pub mod man;
pub mod new;
pub mod node;
pub mod part;
pub mod predict;
pub mod replay;
#[cfg(feature = "recorder")]
pub mod replay_recording;
pub mod run;
pub mod run_arguments;
pub mod several;
pub mod study;
pub mod sweep;
pub mod tune;
mod unread;
pub mod verify_amplifier;
#[cfg(feature = "recorder")]
pub mod view;

use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use serde::Serialize;
use std::path::Path;

/// How a command ended; the process's exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// What was expected held.
    Held,
    /// It ran, but what was expected did not hold.
    NotHeld,
    /// A process failed.
    ProcessFailed,
}

impl Ending {
    /// The process's exit status.
    pub fn status(self) -> u8 {
        match self {
            Ending::Held => 0,
            Ending::NotHeld => 1,
            Ending::ProcessFailed => 3,
        }
    }
}

/// Any result as JSON. A number that is none is null there.
///
/// # Errors
/// If it has no JSON form; ours always have.
pub fn json(value: &impl Serialize) -> Result<String, RunError> {
    serde_json::to_string_pretty(value).map_err(|error| RunError::Setup(error.to_string()))
}

/// Writes a text into the folder of the results.
///
/// # Errors
/// What the system says.
pub fn save(out: &Path, file: &str, text: &str) -> Result<(), RunError> {
    let path = out.join(file);
    std::fs::write(&path, text).map_err(|cause| RunError::Write { path, cause })
}

/// The folder of a run that was made.
///
/// # Errors
/// If it is none.
fn run_folder(path: &Path) -> miette::Result<RunFolder> {
    let folder = RunFolder::open(path);
    if !folder.scenario().is_file() {
        let shown = path.display();
        return Err(miette::miette!(
            "{shown} is not the folder of a run: there is no scenario.ron in it"
        ));
    }
    Ok(folder)
}

/// Refuses a run that was not recorded.
fn expect_recording(folder: &RunFolder) -> miette::Result<()> {
    if folder.recordings().iter().any(|own| own.is_file()) {
        return Ok(());
    }
    let shown = folder.path().display();
    Err(miette::miette!(
        "{shown} has no recording: the run was made without one (--no-recording, recording.on)"
    ))
}

/// The name of a file without its ending.
pub fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A progress bar over `length` ticks; silent when the output is not a terminal.
pub fn progress_bar(length: u64, name: &str) -> indicatif::ProgressBar {
    long_bar(length, name, "ticks")
}

/// The same over `length` of anything that there are many of.
pub fn long_bar(length: u64, name: &str, unit: &str) -> indicatif::ProgressBar {
    let template = format!("{{prefix}} {{bar:40}} {{percent:>3}} % {{pos}}/{{len}} {unit}, {{per_sec}}, {{eta}} left");
    bar(length, name, &template)
}

/// A progress bar over the hundredths of a work whose steps differ.
pub fn share_bar(name: &str) -> indicatif::ProgressBar {
    bar(100, name, "{prefix} {bar:40} {percent:>3} %, {eta} left")
}

/// A progress bar over `length` pieces of work that take seconds each.
pub fn count_bar(length: u64, name: &str) -> indicatif::ProgressBar {
    bar(length, name, "{prefix} {bar:40} {pos}/{len}, {eta} left")
}

fn bar(length: u64, name: &str, template: &str) -> indicatif::ProgressBar {
    let bar = indicatif::ProgressBar::new(length);
    // A template of our own always parses; the default is as good if it ever did not.
    if let Ok(style) = indicatif::ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.set_prefix(name.to_owned());
    bar
}
