//! Parts of the loop as FMI 3.0 co-simulation units: for the library inside an FMU and for the command that writes one.
//!
//! As a `cdylib` this crate is that library: it exports the functions of the standard and reads the scenario from the FMU's folder of
//! resources. As an `rlib` it says what stands in `modelDescription.xml` ([`description`]). Both have their variables from the
//! same table ([`variables`]), so that neither can differ from the other. A unit's blocks are those of a run
//! ([`anhyst_scenario::SteppedLoop`]), and so are the bits of its outputs.
//!
//! Beside `driver` this is the only crate with a boundary to another language. Every function catches panics: none may cross it.

mod boundary;
mod description;
mod instance;
mod kind;
mod parameters;
mod refusal;
mod si_units;
mod state;
mod tokens;
mod unit;
mod unsupported;
mod variables;

pub use description::description;
pub use kind::{KIND_FILE, Kind, SCENARIO_FILE, instantiation_token};
pub use refusal::Refusal;
pub use unit::refuse_unsteppable;
pub use variables::{Causality, Place, Variable, variables};
