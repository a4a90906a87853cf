//! Hysteresis-inverse compensator: the field that brings the material to a demanded magnetization.
//!
//! [`Inverse`] with its structures ([`Structure`]) and the lead for the amplifier's lag ([`InverseSettings`]).
//! `node.rs` is the only file that knows messages.

mod error;
mod inverse;
mod lead;
mod node;
mod nominal;
mod settings;

pub use error::InverseError;
pub use inverse::{Command, Inverse, Known, Wanted};
pub use nominal::BLEND_TICKS;
pub use settings::{InverseSettings, Structure};
