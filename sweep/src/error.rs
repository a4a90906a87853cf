use anhyst_launch::error::RunError;
use anhyst_scenario::ScenarioError;
use std::path::{Path, PathBuf};

/// Why a sweep cannot begin, go on, or be put together.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SweepError {
    /// What varies, or is to be done at all, cannot be.
    #[error("{0}")]
    Refused(String),
    /// A value that varies does not suit the scenario.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scenario(#[from] ScenarioError),
    /// A run did not come to its end.
    #[error(transparent)]
    Run(RunError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(RunError),
    /// A file of a sweep cannot be read.
    #[error("{path} cannot be read: {cause}", path = path.display())]
    Unreadable {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A line that is none of ours.
    #[error("{path}:{line}: {sentence}", path = path.display())]
    Line {
        /// Which file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// What is wrong with it.
        sentence: String,
    },
    /// The folder belongs to another sweep.
    #[error("{folder} has another sweep: {difference}. Give this one a folder of its own, or ask for the same", folder = folder.display())]
    Another {
        /// Which folder.
        folder: PathBuf,
        /// What differs, with both values.
        difference: String,
    },
}

impl SweepError {
    /// For `map_err`: a file that cannot be written.
    pub(crate) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        |cause| {
            let path = path.to_owned();
            Self::Write(RunError::Write { path, cause })
        }
    }

    /// For `map_err`: a file that cannot be read.
    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        |cause| {
            let path = path.to_owned();
            Self::Unreadable { path, cause }
        }
    }
}
