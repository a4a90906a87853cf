//! The command that starts another process of ours: this executable, or what a program that has ours within it says.

use std::ffi::OsString;
use std::process::Command;
use std::sync::OnceLock;

static TOLD: OnceLock<Vec<OsString>> = OnceLock::new();

/// Says the command's words, of which the first is the program; `node`, `bridge` and what follows them come behind. The first to say it
/// is heard.
pub fn tell(words: Vec<OsString>) {
    let _ = TOLD.set(words);
}

/// The command, without what it is to do.
///
/// # Errors
/// If the system does not tell which executable this is.
pub fn command() -> std::io::Result<Command> {
    match TOLD.get().and_then(|words| words.split_first()) {
        Some((program, words)) => {
            let mut command = Command::new(program);
            command.args(words);
            Ok(command)
        }
        None => std::env::current_exe().map(Command::new),
    }
}
