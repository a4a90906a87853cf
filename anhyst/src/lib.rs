//! The one executable: scenario files, the launcher, and the commands.

pub mod assemble;
pub mod cli;
pub mod commands;
pub mod error;
pub mod folder;
pub mod judge;
pub mod launcher;
pub mod process;
#[cfg(feature = "recorder")]
mod recording;
pub mod report;
pub mod resources;
pub mod scenario;
pub mod scribe;
pub mod signals;
