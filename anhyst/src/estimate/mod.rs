//! Parameters from a measured run, off line: `a` by a law of the loop, several constants by the estimation engine.
//!
//! For a law f(u, θ) is the whole chain of the model, effects included: every member of the bank is an actuator with its own `a`, run
//! freely along the command. The law then sees what it would have seen on line. Fields in A/m; the output in its own unit (m of
//! displacement, strain, A/m of magnetization).

mod one;
mod picture;
mod report;
mod several;

pub use one::one_parameter;
pub use picture::picture;
pub use report::{EstimateReport, EstimatedParameter};
pub use several::several_parameters;

use anhyst_identify::IdentifyError;
use anhyst_launch::error::RunError;

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Choices {
    /// Name of the law.
    pub law: String,
    /// Θ of `a`, A/m; none: 10 % to either side of the model's.
    pub range_a_per_m: Option<(f64, f64)>,
    /// First estimate of `a`, A/m; none: the model's.
    pub start_a_per_m: Option<f64>,
    /// How fast `a` may wander, (A/m)²/s.
    pub drift_variance_per_s: f64,
    /// The first seconds are simulated and not compared.
    pub settle_s: f64,
    /// Threads that work side by side.
    pub threads: usize,
}

/// What came out, with its course.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimated {
    /// For `estimate.json`.
    pub report: EstimateReport,
    /// Time (s) or sample number of each row.
    pub abscissa: Vec<f64>,
    /// Each parameter's symbol and course: value and standard deviation (0: none is known there) at every row.
    pub courses: Vec<(String, Vec<[f64; 2]>)>,
    /// What the model gives along the whole run: with the final estimate, or along the course of one that drifts.
    pub predicted: Vec<f64>,
}

/// As the executable says it.
fn refused(error: IdentifyError) -> RunError {
    RunError::Setup(error.to_string())
}
