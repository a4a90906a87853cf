//! The estimation engine: numbers of a model out of what was measured, for `fit`, `estimate` and `diagnose` alike.
//!
//! A [`Simulator`] answers values with outputs; [`Problem`] makes Σ (measured − outputs − linear part)² and the priors small;
//! [`Covariance`] says how well the data fix what came out.

pub mod coordinate;
pub mod covariance;
pub mod least_squares;
pub mod span;

pub use coordinate::Coordinate;
pub use covariance::Covariance;
pub use least_squares::{Problem, Solution, Stop};
pub use span::{Span, dot};

/// Anything that can be run freely under a set of values, in the order of a problem's coordinates.
pub trait Simulator: Sync {
    /// All rows, over their noise; None where the model refuses the values.
    fn outputs(&self, values: &[f64]) -> Option<Vec<f64>>;
}

impl<F: Fn(&[f64]) -> Option<Vec<f64>> + Sync> Simulator for F {
    fn outputs(&self, values: &[f64]) -> Option<Vec<f64>> {
        self(values)
    }
}
