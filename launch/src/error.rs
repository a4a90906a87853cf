use crate::launcher::error::LaunchError;
use anhyst_ipc::{Invalid, LinkError};
use std::path::PathBuf;

/// Why a run, or a process of it, could not go on.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum RunError {
    /// A setting that only shows when the block is built.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// A link failed before the loop began.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A process failed.
    #[error(transparent)]
    Launch(#[from] LaunchError),
    /// A result cannot be written.
    #[error("{path} cannot be written: {cause}{left}", path = path.display(), left = crate::disk::left_after(path, cause))]
    Write {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// Two runs into one folder would overwrite each other's results.
    #[error("another run writes to {path}: wait for its end, or give this one a folder of its own", path = path.display())]
    Claimed {
        /// Which.
        path: PathBuf,
    },
    /// A launcher's child that came to life too late.
    #[error("the launcher with process number {launcher} has gone: nobody is there to run for")]
    Orphan {
        /// Its process number.
        launcher: u32,
    },
    /// The recording cannot be written.
    #[cfg(feature = "recorder")]
    #[error(transparent)]
    Recorder(#[from] anhyst_recorder::RecorderError),
    /// The user asked to stop.
    #[error("stopped on request")]
    Stopped,
    /// Anything else, in a sentence.
    #[error("{0}")]
    Setup(String),
}

impl RunError {
    /// True if there is no more room on a disk or in shared memory, or the user asked to stop: that is nobody's bad input.
    pub fn is_no_bad_input(&self) -> bool {
        match self {
            Self::Write { cause, .. } => crate::disk::is_full(cause),
            Self::Stopped | Self::Launch(LaunchError::SharedMemory(_)) => true,
            _ => false,
        }
    }
}
