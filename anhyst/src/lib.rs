//! The one executable: its command line and its commands.

pub use anhyst_launch::{complain, say};

mod arguments;
pub mod cli;
pub mod commands;
pub mod control;
pub mod design;
#[cfg(feature = "recorder")]
mod diagnosis_album;
pub mod entry;
pub mod estimate;
mod fit_picture;
pub mod fitness;
mod law_picture;
pub mod live;
pub mod spelling;
#[cfg(feature = "recorder")]
mod written;
