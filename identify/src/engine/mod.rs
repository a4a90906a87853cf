//! The estimation engine: numbers of a model out of what was measured, for `fit`, `estimate` and `diagnose` alike.
//!
//! A [`Simulator`] answers values with outputs; [`Problem`] makes Σ (measured − outputs − linear part)² and the priors small;
//! [`Covariance`] says how well the data fix what came out.

pub mod coordinate;
pub mod covariance;
pub mod least_squares;
mod simulator;
pub mod span;

pub use coordinate::Coordinate;
pub use covariance::Covariance;
pub use least_squares::{Problem, Solution, Stop};
pub use simulator::Simulator;
pub use span::{Span, dot};
