use anhyst_ipc::Invalid;
use anhyst_model::ModelError;

/// Why an inverse could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InverseError {
    /// A setting cannot be used.
    #[error(transparent)]
    Setting(#[from] Invalid),
    /// The material or the amplifier cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
}
