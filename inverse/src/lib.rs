//! Hysteresis-inverse compensator: the field that brings the material to a demanded magnetization.
//!
//! [`Inverse`] with its structures ([`Structure`]) and the lead for the amplifier's lag ([`InverseSettings`]).
//! [`LawInverse`] is that of any other hysteresis law. [`Drive`] takes its place in an open-loop experiment. `node.rs`, `law.rs` and
//! `drive.rs` are the only files that know messages.

mod drive;
mod error;
mod inverse;
mod law;
mod lead;
mod node;
mod nominal;
mod settings;

pub use drive::Drive;
pub use error::InverseError;
pub use inverse::{Command, Inverse, MagnetizationDemand, OtherParameters, StateEstimate};
pub use law::LawInverse;
pub use nominal::BLEND_TICKS;
pub use settings::{InverseSettings, Structure};
