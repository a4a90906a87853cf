//! A blind study of the diagnosis: runs in which a generator hides effects, judged without mercy.
//!
//! A [`Plan`] lists [`Case`]s, each with a seed that decides effect, size, excitation and noise (`case.rs`, `make.rs`). [`study`]
//! makes one run and diagnoses it: the workflow is given the nominal model and the columns, nothing else. [`Results`] sums up
//! against the [`Bar`]s, with the confusion matrix and the detection limits; [`markdown`] writes them down.

mod bars;
mod case;
mod draw;
mod excitation;
mod ideal;
mod limits;
mod make;
mod outcome;
mod results;
mod sizes;
mod text;
mod unlisted;

use anhyst_model::ActuatorModel;
use serde::{Deserialize, Serialize};

pub use bars::{Bar, Share};
pub use case::{Case, Family, LIMIT_GAPS, Plan};
pub use excitation::Excitation;
pub use ideal::Ideal;
pub use limits::{Level, Limit};
pub use make::{TrueValue, Truth};
pub use outcome::{Interval, Outcome};
pub use results::{ConfusionRow, Results};
pub use text::markdown;

use crate::diagnose::{DiagnoseOptions, Verdict, diagnose};
use crate::error::DiagnosisError;

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

/// Makes a case's run, has it diagnosed on one thread, and judges the diagnosis.
pub fn study(case: &Case, nominal: &ActuatorModel, rows: usize) -> StudyRun {
    match studied(case, nominal, rows) {
        Ok(run) => run,
        Err(error) => StudyRun::failed(case, rows, error.to_string()),
    }
}

fn studied(case: &Case, nominal: &ActuatorModel, rows: usize) -> Result<StudyRun, DiagnosisError> {
    let made = make::make(case, nominal, rows)?;
    let options = DiagnoseOptions {
        threads: 1,
        ..DiagnoseOptions::default()
    };
    let begin = std::time::Instant::now();
    let diagnosed = diagnose(nominal, std::slice::from_ref(&made.run), &options, &mut |_, _| ());
    let seconds = begin.elapsed().as_secs_f64();
    let found = match diagnosed {
        Ok(diagnosed) => diagnosed.diagnosis,
        Err(error) => {
            return Ok(StudyRun {
                truth: Some(made.truth),
                seconds,
                ..StudyRun::failed(case, rows, error.to_string())
            });
        }
    };
    Ok(StudyRun {
        outcome: outcome::outcome(case, &found),
        verdict: Some(found.verdict),
        named: outcome::named(&found),
        intervals: outcome::intervals(&made.truth, &found),
        gap_before: found.gap_before / made.truth.output_noise_m,
        gap_after: found.gap_after / made.truth.output_noise_m,
        ambiguous_with: found.ambiguous_with,
        error: None,
        truth: Some(made.truth),
        seconds,
        ..StudyRun::failed(case, rows, String::new())
    })
}
