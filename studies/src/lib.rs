//! Studies: the paper's figures, and the estimation laws side by side.

pub mod figure;
pub mod laws;
pub mod paper;
