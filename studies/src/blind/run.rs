//! One run of the study: what was hidden and what was said.

use anhyst_diagnosis::Verdict;
use serde::{Deserialize, Serialize};

use super::case::{Case, Family};
use super::make::Truth;
use super::outcome::{Interval, Outcome};

/// One run of the study: what was hidden and what was said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyRun {
    pub family: Family,
    pub index: u64,
    pub seed: u64,
    pub rows: usize,
    /// None where no run could be made.
    pub truth: Option<Truth>,
    pub outcome: Outcome,
    pub verdict: Option<Verdict>,
    pub named: Vec<String>,
    pub ambiguous_with: Vec<String>,
    pub intervals: Vec<Interval>,
    /// Held-out rms over the noise, before and after.
    pub gap_before: f64,
    pub gap_after: f64,
    /// Why there is no diagnosis.
    pub error: Option<String>,
    /// Of the diagnosis alone, by the wall clock.
    pub seconds: f64,
}

impl StudyRun {
    /// A run that came to nothing.
    pub fn failed(case: &Case, rows: usize, error: String) -> Self {
        StudyRun {
            family: case.family,
            index: case.index,
            seed: case.seed,
            rows,
            truth: None,
            outcome: Outcome::Failed,
            verdict: None,
            named: Vec::new(),
            ambiguous_with: Vec::new(),
            intervals: Vec::new(),
            gap_before: 0.0,
            gap_after: 0.0,
            error: Some(error),
            seconds: 0.0,
        }
    }

    /// What was hidden, as one name; "none" for nothing.
    pub fn truth_name(&self) -> String {
        match &self.truth {
            Some(truth) if truth.names.is_empty() => "none".to_owned(),
            Some(truth) => truth.names.join(" + "),
            None => "not made".to_owned(),
        }
    }

    /// The smallest gap of what was hidden, over the noise; 0 for nothing.
    pub fn gap_over_noise(&self) -> f64 {
        let gaps = self
            .truth
            .iter()
            .flat_map(|truth| truth.gaps_over_noise.iter().copied());
        let least = gaps.fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }
}
