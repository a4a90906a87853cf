//! The workflow: set up, search, decide, and the series behind the pictures.

use anhyst_model::ActuatorModel;

use crate::diagnosis::{DataSource, Diagnosed, RunSeries, Verdict};
use crate::error::DiagnosisError;
use crate::observation::Observation;
use crate::setup::DiagnoseOptions;
use crate::term::Term;
use crate::workbench::Workbench;
use crate::{decide, plant, remainder, search, setup};
use anhyst_identify::parallel;
use anhyst_measured::MeasuredRun;
use anhyst_measured::Quantity;

/// How the source of a model begins whose numbers were fitted to measurements; `anhyst fit` writes it so.
const FITTED: &str = "fitted to";

/// Compares a model with runs and says what is missing; `progress` hears what is being done and how far it has come (0 to 1).
///
/// # Errors
/// Runs that hold nothing the model could be compared with, or a model that cannot be simulated on them.
pub fn diagnose(
    model: &ActuatorModel,
    runs: &[MeasuredRun],
    options: &DiagnoseOptions,
    progress: &mut dyn FnMut(&'static str, f64),
) -> Result<Diagnosed, DiagnosisError> {
    let fitted_model = options.fitted_model || model.source.starts_with(FITTED);
    let setup = setup::setup(model, runs, fitted_model, options)?;
    let observation = Observation::new(setup.plant.channels.clone(), setup.measured);
    let bench = Workbench {
        system: &setup.plant,
        model: &setup.plant.model,
        observation: &observation,
        linear: observation.zeros(),
        lattice: setup.lattice,
        threads: if options.threads == 0 {
            parallel::available()
        } else {
            options.threads
        },
    };
    let no_simulation = || DiagnosisError::NoDiagnosis {
        sentence: format!("the model \"{}\" cannot be simulated on these runs", model.name),
    };
    let found = search::search(&bench, progress).ok_or_else(no_simulation)?;
    progress("weighing the evidence", 0.92);
    let unit = if setup.output == Quantity::Strain { "" } else { "m" };
    let mut decided = decide::decide(&bench, &setup.plant, &found, unit);
    if decided.diagnosis.verdict == Verdict::Unknown
        && fitted_model
        && let Some(remainder) = remainder::remainder(&bench, &setup.plant, &found)
    {
        decided.name_beside_error(&bench, &found, remainder);
    }
    decided.diagnosis.data = runs
        .iter()
        .map(|run| DataSource {
            source: run.source.clone(),
            data_hash: run.data_hash.clone(),
            rows: run.len(),
        })
        .collect();
    // What was fitted, with the creep's time constants for these runs; a creep that was not found goes again.
    let mut amended = plant::amended(&setup.plant.model, &decided.settings).unwrap_or_else(|_| model.clone());
    amended.effects.retain(|effect| {
        let term = Term::Effect(effect.kind());
        model.effect(effect.kind()).is_some() || decided.settings.iter().any(|own| own.term == term)
    });
    if !decided.settings.is_empty() {
        let files: Vec<String> = runs
            .iter()
            .map(|run| format!("{}, XXH3 {}", run.source, run.data_hash))
            .collect();
        amended.source = format!("{}; amended by anhyst diagnose from {}", model.source, files.join("; "));
    }
    let runner_up = (!decided.runner_up.is_empty())
        .then(|| plant::amended(model, &decided.runner_up).ok())
        .flatten();
    let series = series(&bench, runs, setup.output, &found, &decided).ok_or_else(no_simulation)?;
    progress("done", 1.0);
    Ok(Diagnosed {
        diagnosis: decided.diagnosis,
        amended,
        runner_up,
        runs: series,
    })
}

/// Measured output and both models, on the instrument's own zero.
fn series(
    bench: &Workbench,
    runs: &[MeasuredRun],
    output: Quantity,
    found: &search::Found,
    decided: &decide::Decided,
) -> Option<Vec<RunSeries>> {
    let before = &found.nominal.signals;
    let after = bench.system.signals(&decided.settings)?;
    let term = decided.diagnosis.unknown_term.as_ref();
    let series = runs.iter().zip(before).zip(after).map(|((run, before), after)| {
        let measured = run.series(output).unwrap_or_default().to_vec();
        let added = term.map(|term| term.along(&after)).unwrap_or_default();
        let mut modelled = after.output;
        for (value, own) in modelled.iter_mut().zip(added) {
            *value += own;
        }
        let zero = |model: &[f64]| {
            let free = bench.observation.channels.iter().any(|channel| channel.free_zero);
            let mean = measured.iter().zip(model).map(|(y, m)| y - m).sum::<f64>() / measured.len().max(1) as f64;
            if free { mean } else { 0.0 }
        };
        let shifted = |model: &[f64]| {
            let zero = zero(model);
            model.iter().map(|value| value + zero).collect::<Vec<f64>>()
        };
        RunSeries {
            source: run.source.clone(),
            tick_s: run.tick_s,
            before: shifted(&before.output),
            after: shifted(&modelled),
            field_a_per_m: before.field.clone(),
            measured,
        }
    });
    Some(series.collect())
}
