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
mod run;
mod sizes;
mod text;
mod unlisted;

use anhyst_model::ActuatorModel;

pub use bars::{Bar, Share};
pub use case::{Case, Family, LIMIT_GAPS, Plan};
pub use excitation::Excitation;
pub use ideal::Ideal;
pub use limits::{Level, Limit};
pub use make::{TrueValue, Truth};
pub use outcome::{Interval, Outcome};
pub use results::{ConfusionRow, Results};
pub use run::StudyRun;
pub use text::markdown;

use crate::error::StudyError;
use anhyst_diagnosis::{DiagnoseOptions, diagnose};

/// Makes a case's run, has it diagnosed on one thread, and judges the diagnosis.
pub fn study(case: &Case, nominal: &ActuatorModel, rows: usize) -> StudyRun {
    match studied(case, nominal, rows) {
        Ok(run) => run,
        Err(error) => StudyRun::failed(case, rows, error.to_string()),
    }
}

fn studied(case: &Case, nominal: &ActuatorModel, rows: usize) -> Result<StudyRun, StudyError> {
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
