//! One file per subcommand.

#[cfg(feature = "bridge")]
pub mod bridge;
pub mod check;
pub mod compare;
pub mod diagnose;
pub mod doctor;
pub mod doctor_realtime;
pub mod estimate;
#[cfg(feature = "recorder")]
pub mod export;
pub mod fit;
pub mod graph;
pub mod interface;
pub mod laws;
pub mod node;
pub mod paper;
pub mod part;
pub mod replay;
#[cfg(feature = "recorder")]
pub mod replay_recording;
pub mod run;
pub mod study;
pub mod verify_amplifier;
#[cfg(feature = "recorder")]
pub mod view;

use std::process::ExitCode;

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

impl From<Ending> for ExitCode {
    fn from(ending: Ending) -> Self {
        ExitCode::from(match ending {
            Ending::Held => 0,
            Ending::NotHeld => 1,
            Ending::ProcessFailed => 3,
        })
    }
}

/// A progress bar over `length` ticks; silent when the output is not a terminal.
pub fn progress_bar(length: u64, name: &str) -> indicatif::ProgressBar {
    bar(
        length,
        name,
        "{prefix} {bar:40} {percent:>3} % {pos}/{len} ticks, {per_sec}, {eta} left",
    )
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
