//! Why a simulated rig cannot be built.

use anhyst_ipc::Invalid;
use anhyst_model::ModelError;

/// A refused setting, material or rod.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// A setting of the plant: the path tells where it stands.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// The material, the rod, the tick or the amplifier.
    #[error(transparent)]
    Model(#[from] ModelError),
}
