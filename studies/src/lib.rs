//! Studies: many runs of a whole workflow, judged by what was put into them.

pub mod blind;
mod error;

pub use error::StudyError;
