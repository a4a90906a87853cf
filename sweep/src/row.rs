//! What a run came to, in a line.

use anhyst_launch::any_number;
use anhyst_launch::summary::Summary;
use serde::{Deserialize, Serialize};

/// A run of a sweep. What varied follows from the index.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// From 0.
    pub index: u64,
    /// Of all its noise.
    pub seed: u64,
    /// Whether the tolerance and all else that the scenario expects held; false, too, where no tolerance is stated.
    pub held: bool,
    /// Root mean square error, m; NaN where nothing ran.
    #[serde(with = "any_number")]
    pub error_rms_m: f64,
    /// Largest error, m; NaN where nothing ran.
    #[serde(with = "any_number")]
    pub error_max_m: f64,
    /// The first thing that did not hold, or why nothing ran; empty if all did.
    pub first_failure: String,
    /// Ticks run.
    pub ticks: u64,
    /// Of all tokens; empty where nothing ran.
    pub digest: String,
}

impl Row {
    /// Of a run that came to its end.
    pub fn of(index: u64, seed: u64, summary: &Summary) -> Self {
        Self {
            index,
            seed,
            held: summary.held,
            error_rms_m: summary.verdict.error_rms_m,
            error_max_m: summary.verdict.error_max_m,
            first_failure: summary.failures.first().cloned().unwrap_or_default(),
            ticks: summary.ticks,
            digest: summary.digest.clone(),
        }
    }

    /// Of a run that did not come to its end.
    pub fn failed(index: u64, seed: u64, first_failure: String) -> Self {
        Self {
            index,
            seed,
            held: false,
            error_rms_m: f64::NAN,
            error_max_m: f64::NAN,
            first_failure,
            ticks: 0,
            digest: String::new(),
        }
    }

    /// Whether it came to its end.
    pub fn ran(&self) -> bool {
        !self.digest.is_empty()
    }

    /// Whether another line of the same run says the same, bit for bit.
    pub fn is_same(&self, other: &Self) -> bool {
        let said = |row: &Self| serde_json::to_string(row).ok();
        said(self) == said(other)
    }
}
