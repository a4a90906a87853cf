use anhyst_ipc::Invalid;
use anhyst_model::ModelError;

/// Why an estimator could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// A setting cannot be used.
    #[error(transparent)]
    Setting(#[from] Invalid),
    /// The material, the rod or the amplifier cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
}
