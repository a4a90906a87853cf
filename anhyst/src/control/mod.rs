//! What a diagnosis is worth in a cut: the plant has the effect, the controller's side does not know it, knows it, or
//! believes the runner-up.
//!
//! Every cut has the same plant, trajectory, noise and feedback; only what is believed differs. Each is made twice,
//! with the scenario's feedback and without: feedback hides what a model lacks where it is fast enough.

mod compensation;
mod section;
mod variant;

pub use compensation::Compensation;
pub use section::section;
pub use variant::{replaced, variant};

use anhyst_identify::parallel;
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::error_course::ErrorWindow;
use anhyst_launch::summary::Summary;
use anhyst_model::ActuatorModel;
use anhyst_scenario::Scenario;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The comparison, as `diagnosis.json` holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Control {
    /// Name of the scenario.
    pub scenario: String,
    /// Sentences on what the models stand in for.
    pub replaced: Vec<String>,
    /// Sentences on how each effect is made up for, or why not.
    pub compensation: Vec<String>,
    /// Old, amended, runner-up; first with the feedback, then without.
    pub cuts: Vec<Cut>,
    /// Folder of the amended cut, where it was recorded.
    pub recording: Option<PathBuf>,
}

/// One cut.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cut {
    /// Whose model the controller's side believes: old, amended, or the runner-up by its name.
    pub believes: String,
    /// With the scenario's feedback.
    pub feedback: bool,
    /// rms of reference minus true displacement after settling; none where the cut could not be made.
    pub error_rms_m: Option<f64>,
    /// Largest of the same.
    pub error_max_m: Option<f64>,
    /// rms over that with the old model.
    pub ratio: Option<f64>,
    /// Why the cut could not be made.
    pub refused: Option<String>,
    /// The error over time.
    #[serde(skip)]
    pub course: Vec<ErrorWindow>,
}

/// Models to compare: the plant is as the second one says.
#[derive(Debug, Clone, Copy)]
pub struct Models<'a> {
    /// Before the diagnosis.
    pub old: &'a ActuatorModel,
    /// With what was found.
    pub amended: &'a ActuatorModel,
    /// The best rival with its name.
    pub runner_up: Option<(&'a str, &'a ActuatorModel)>,
}

/// Makes all cuts, `threads` side by side. `progress` hears finished ticks of all of them; folders go under `out`.
///
/// # Errors
/// A cut that failed while it ran, or results that cannot be written. A cut that a model refuses is told in its place.
pub fn control(
    scenario: &Scenario,
    models: Models,
    out: &Path,
    threads: usize,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Control, RunError> {
    let mut beliefs = vec![("old", models.old), ("amended", models.amended)];
    beliefs.extend(models.runner_up);
    let with_feedback = scenario.controller.feedback.is_some();
    let kinds: &[bool] = if with_feedback { &[true, false] } else { &[false] };
    let work: Vec<(usize, (&str, &ActuatorModel, bool))> = kinds
        .iter()
        .flat_map(|&feedback| beliefs.iter().map(move |&(name, belief)| (name, belief, feedback)))
        .enumerate()
        .collect();
    let cuts = parallel::map(
        threads,
        &work,
        |&(index, (name, belief, feedback))| -> Result<Cut, RunError> {
            let folder = folder_of(index, feedback);
            let own = variant(scenario, &folder, models.amended, belief, feedback);
            let mut cut = Cut {
                believes: name.to_owned(),
                feedback,
                error_rms_m: None,
                error_max_m: None,
                ratio: None,
                refused: None,
                course: Vec::new(),
            };
            match own {
                Ok(mut own) => {
                    own.recording.on = is_recorded(&cut, with_feedback);
                    let summary = run(&own, &out.join(folder), progress)?;
                    cut.course = summary.verdict.error_course;
                    cut.error_rms_m = Some(summary.verdict.error_rms_m);
                    cut.error_max_m = Some(summary.verdict.error_max_m);
                }
                Err(error) => cut.refused = Some(error.to_string()),
            }
            Ok(cut)
        },
    );
    let mut cuts = cuts.into_iter().collect::<Result<Vec<_>, RunError>>()?;
    compare(&mut cuts);
    let recorded = |cut: &Cut| is_recorded(cut, with_feedback) && cut.refused.is_none();
    let recording = cuts.iter().position(recorded);
    let effects = models.amended.effects.iter().map(|effect| effect.kind());
    Ok(Control {
        scenario: scenario.name.clone(),
        replaced: replaced(scenario, models.amended),
        compensation: effects.map(|kind| Compensation::of(kind).sentence(kind)).collect(),
        recording: recording.map(|index| out.join(folder_of(index, cuts[index].feedback))),
        cuts,
    })
}

/// Of the amended cuts the one that is made in earnest: with the feedback, where the scenario has any.
fn is_recorded(cut: &Cut, with_feedback: bool) -> bool {
    cfg!(feature = "recorder") && cut.believes == "amended" && cut.feedback == with_feedback
}

fn folder_of(index: usize, feedback: bool) -> String {
    format!("{}-{}", index + 1, if feedback { "feedback" } else { "feedforward" })
}

fn run(scenario: &Scenario, out: &Path, progress: &(dyn Fn(u64) + Sync)) -> Result<Summary, RunError> {
    let folder = prepare(scenario, Some(out))?;
    let mut last = 0;
    let reports = embedded(scenario, &folder, &mut |tick| {
        progress(tick - std::mem::replace(&mut last, tick));
    })?;
    Summary::written(scenario, &reports, &folder)
}

/// Every cut over the old model's with the same feedback, which is the first of its kind.
fn compare(cuts: &mut [Cut]) {
    for feedback in [true, false] {
        let old = cuts
            .iter()
            .find(|cut| cut.feedback == feedback)
            .and_then(|cut| cut.error_rms_m);
        for cut in cuts.iter_mut().filter(|cut| cut.feedback == feedback) {
            cut.ratio = cut.error_rms_m.zip(old).map(|(own, old)| own / old);
        }
    }
}

/// Ticks of all cuts, for a progress bar.
pub fn ticks(scenario: &Scenario, with_runner_up: bool) -> u64 {
    let beliefs = 2 + u64::from(with_runner_up);
    let kinds = 1 + u64::from(scenario.controller.feedback.is_some());
    scenario.ticks() * beliefs * kinds
}
