//! Studies: the paper's figures, the estimation laws side by side, and the blind study of the diagnosis.

pub mod blind;
mod error;
pub mod laws;
pub mod paper;
pub mod scoreboard;

pub use error::StudyError;
