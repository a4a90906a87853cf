//! The table of parameters: every number that a model has and that data may fix, one [`ParameterSpec`] each.
//!
//! Constants of the nominal chain are the rows of [`NominalParameter`]; an effect is a named set of rows
//! ([`crate::EffectKind::parameters`]). What is asked on a command line, fitted, believed beforehand, screened and reported
//! follows from a row.

mod nominal;
mod rows;
mod spec;

pub use nominal::NominalParameter;
pub use rows::REVERSIBILITY_BOUNDS;
pub use spec::{ParameterRole, ParameterSpec, Screening, Signal};

pub(crate) use rows::{HYSTERESIS, nominal_rows};
