//! Why a study's run cannot be made.

use anhyst_measured::MeasuredError;
use thiserror::Error;

/// A run of a study that cannot be made.
#[derive(Debug, Error)]
pub enum StudyError {
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    #[error("{sentence}")]
    NotMade { sentence: String },
}
