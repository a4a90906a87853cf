//! A blind study of the diagnosis: rigs that share no code with it hide effects behind nuisances, judged without mercy.
//!
//! A [`Plan`] lists [`Case`]s, each with a seed that decides effect, size, drive and nuisance (`case.rs`, `tests/witness`), of a [`Subject`]. [`study`]
//! makes one run and diagnoses it: the workflow is given the nominal model and the columns, nothing else. [`Results`] sums up against the
//! [`Bar`]s; [`markdown`] and [`page`] write it down.

mod bars;
mod case;
mod class;
mod outcome;
mod page;
mod places;
mod results;
mod run;
mod share;
mod subject;
mod tables;

pub use bars::Bar;
pub use case::{Case, Family, LIMIT_GAPS, Plan};
pub use class::Class;
pub use outcome::{Interval, Outcome};
pub use page::page;
pub use places::{Axis, Places};
pub use results::{Bin, ConfusionRow, Results};
pub use run::{Hidden, Said, StudyRun};
pub use share::Share;
pub use subject::Subject;
pub use tables::{markdown, summary};

pub use anhyst_witness::Nuisance;

use crate::error::StudyError;
use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, diagnose};
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::ActuatorModel;
use anhyst_witness::Made;

/// Draws a case's rig, has its run diagnosed on one thread, and judges the diagnosis.
pub fn study(case: &Case, subject: &Subject) -> StudyRun {
    let made = match subject.rig().draw(case.seed, &case.wanted) {
        Ok(made) => subject.in_its_units(made),
        Err(refusal) => return StudyRun::failed(case, refusal.to_string()),
    };
    let begin = std::time::Instant::now();
    let found = diagnosed(case, &made, subject.model());
    let found = found.map(|own| (own, begin.elapsed().as_secs_f64()));
    StudyRun::made(case, &made, found.map_err(|error| error.to_string()))
}

fn diagnosed(case: &Case, made: &Made, nominal: &ActuatorModel) -> Result<Diagnosed, StudyError> {
    let record = made.record.clone();
    let series = vec![
        (Quantity::FieldCommand, record.command_a_per_m),
        (Quantity::Field, record.field_a_per_m),
        (Quantity::Displacement, record.displacement_m),
    ];
    // The name says nothing of what is hidden.
    let run = MeasuredRun::in_memory(&format!("seed {}", case.seed), Some(made.time_s[1]), series)?;
    let options = DiagnoseOptions {
        threads: 1,
        ..DiagnoseOptions::default()
    };
    Ok(diagnose(nominal, &[run], &options, &mut |_, _| ())?)
}
