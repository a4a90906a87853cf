//! Why a study's run has no diagnosis.

use anhyst_diagnosis::DiagnosisError;
use anhyst_measured::MeasuredError;
use thiserror::Error;

/// A run of a study without a diagnosis.
#[derive(Debug, Error)]
pub enum StudyError {
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    #[error(transparent)]
    Diagnosis(#[from] DiagnosisError),
    #[error("no rig can be made of the model \"{model}\": it needs {lacking}")]
    NoRig { model: String, lacking: &'static str },
}
