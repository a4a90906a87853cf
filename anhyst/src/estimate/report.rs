//! `estimate.json`.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EstimatedParameter {
    /// SI.
    pub value: f64,
    /// In the value's unit.
    pub standard_deviation: f64,
}

/// What an estimation comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EstimateReport {
    /// By symbol: a, k, alpha, Ms, c.
    pub parameters: BTreeMap<String, EstimatedParameter>,
    /// The run says enough about every parameter.
    pub informed: bool,
    /// Which law.
    pub law: String,
    /// True if `standard_deviation` is the law's own; false if it is the Cramér-Rao bound of what the run says, since the law gives none.
    pub standard_deviation_of_law: bool,
    /// Samples used.
    pub samples: usize,
    /// Samples per second of wall clock, predictions included.
    pub samples_per_s: f64,
    /// Which output was compared.
    pub output: String,
    /// rms of the output's noise, in its unit.
    pub noise_rms: f64,
    /// rms of measured minus predicted with the model as it was given.
    pub residual_rms_before: f64,
    /// The same with the estimate.
    pub residual_rms_after: f64,
    /// File that was used.
    pub data: String,
    /// XXH3 of its bytes.
    pub data_hash: String,
    /// What was decided on the way.
    pub notes: Vec<String>,
    /// What to be careful about.
    pub warnings: Vec<String>,
}
