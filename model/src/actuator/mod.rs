//! The actuator as a chain: command → coil field H → field in the material → M → free strain λ → tip u → what the sensor says y.
//!
//! ü + k̂ u̇ + ĉ u = w λ(M)/λ′ + f F, with λ′ the strain law's slope at M = 0 (at Ms/2 for an even law): for a linear law w M.
//! H and F are straight lines between samples; lags and the rod are propagated exactly. Effects join where
//! [`crate::Stage`] says, in the order of [`EffectKind::ALL`]; one that is not there costs nothing in a run.
//! Without a rod the tip is that of a free bar one metre long: y is the strain.
//! [`ActuatorModel`] is immutable and is what a file holds; [`Actuator`] holds the state. Source: the paper's (1)-(13).

mod chain;
mod fields;
mod magnetizer;
mod model;
mod nonlinear_rod;
mod parts;
mod restated;
mod rod;
mod rod_stage;
mod samples;
mod signals;
mod strain;

pub use chain::{Actuator, simulate};
pub use magnetizer::MagneticStart;
pub use model::{ActuatorModel, validate_effects};
pub use parts::{CoilGain, Creep, Expansion, FieldPath, OwnForces, PinningGrowth, SignalPath};
pub use restated::{rod_per_magnetization, rod_per_strain, with_known_effects};
pub use rod::ActuatorRod;
pub use samples::{ActuatorInput, ActuatorInputs, ActuatorOutput, ActuatorOutputs, Drive, MagneticHalf};
