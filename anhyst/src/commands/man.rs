//! `anhyst man`: one manual page for each command, from what the command line knows of itself.

use super::Ending;
use anhyst_launch::error::RunError;
use clap::Args;
use std::path::PathBuf;

/// `man`
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Folder of the pages, as ~/.local/share/man/man1.
    #[arg(long, default_value = "man", value_name = "FOLDER")]
    pub out: PathBuf,
}

/// Runs the command; `all` is the whole command line.
///
/// # Errors
/// A folder that cannot be written.
pub fn run(arguments: &ManArguments, all: clap::Command) -> miette::Result<Ending> {
    let out = &arguments.out;
    std::fs::create_dir_all(out)
        .and_then(|()| clap_mangen::generate_to(all, out))
        .map_err(|cause| RunError::Write {
            path: out.clone(),
            cause,
        })?;
    crate::say!("manual pages: {}", out.display());
    Ok(Ending::Held)
}
