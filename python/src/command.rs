//! The command line: whole, for the console script, and a command at a time, for functions of the module.

use crate::interrupt::interruptible;
use crate::refusal::{ProcessFailed, refused};
use anhyst::cli::Command;
use anhyst::commands::Ending;
use anhyst::entry;
use anhyst_launch::claim::claimed;
use anhyst_launch::{own_command, say};
use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::PathBuf;

/// Does what the words say, as the executable does; the first is the program's name. Prints; returns the exit status.
#[pyfunction]
pub fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| entry::main(&words))
}

/// Says by which words another process of this program is started: `node NAME …` is put behind them.
#[pyfunction]
pub fn tell_command(words: Vec<OsString>) {
    own_command::tell(words);
}

/// Does a command and prints nothing: whether what was expected held, and what it would have printed.
#[pyfunction]
pub fn command(py: Python<'_>, words: Vec<OsString>) -> PyResult<(bool, String)> {
    let program = std::iter::once(OsString::from("anhyst"));
    let words: Vec<OsString> = program.chain(words).collect();
    let read = entry::read(&words).map_err(|unread| refused(unread.sentence()))?;
    // Somebody may have interrupted the run before this one.
    anhyst_ipc::forget_stop();
    let work = || say::kept(|| entry::perform(&read));
    let (done, kept) = match read {
        // A run ends at its next tick.
        Command::Run(_) | Command::Sweep(_) | Command::Commission(_) => py.detach(work),
        _ => interruptible(py, work)?,
    };
    // Ctrl-C ends a run, and is then Python's: an exception of its own.
    py.check_signals()?;
    match done {
        Ok(Ending::Held) => Ok((true, kept.said)),
        Ok(Ending::NotHeld) => Ok((false, kept.said)),
        Ok(Ending::ProcessFailed) => Err(ProcessFailed::new_err(kept.complained.trim_end().to_owned())),
        Err(report) if entry::status(&report) == entry::BAD_INPUT => {
            let help = report.help().map(|help| format!("\nhelp: {help}"));
            Err(refused(format!("{report}{}", help.unwrap_or_default())))
        }
        Err(report) => Err(ProcessFailed::new_err(report.to_string())),
    }
}

/// A new folder under `runs/`, as the commands make them: `NAME-TIME`.
#[pyfunction]
pub fn new_folder(name: &str) -> PyResult<PathBuf> {
    let claimed = claimed(None, name).map_err(|error| ProcessFailed::new_err(error.to_string()))?;
    Ok(claimed.path.clone())
}
