//! Why there is no diagnosis.

use anhyst_identify::IdentifyError;
use thiserror::Error;

/// Runs or a model that cannot be compared, or a result that cannot be written.
#[derive(Debug, Error)]
pub enum DiagnosisError {
    #[error("{sentence}")]
    NoDiagnosis { sentence: String },
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    #[error("the fitted material cannot be written: {0}")]
    MaterialText(#[from] ron::Error),
}
