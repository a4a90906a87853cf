//! Several constants of the nominal chain at once: the estimation engine on the whole run.

use super::one::{abscissa, notes, residual_rms, unexplained};
use super::report::{EstimateReport, EstimatedParameter};
use super::{Choices, Estimated, refused};
use anhyst_identify::estimate::{Observed, several};
use anhyst_launch::error::RunError;
use anhyst_measured::MeasuredRun;
use anhyst_model::{ActuatorModel, NominalParameter};
use std::time::Instant;

/// Estimates constants of a model.
///
/// # Errors
/// A law that cannot do it, a constant that the model has not, data that cannot be used.
pub fn several_parameters(
    run: &MeasuredRun,
    model: &ActuatorModel,
    choices: &Choices,
    parameters: &[NominalParameter],
) -> Result<Estimated, RunError> {
    if choices.law != "gauss-newton" {
        return Err(RunError::Setup(format!(
            "--law {}: several parameters are estimated by gauss-newton",
            choices.law
        )));
    }
    let observed = Observed::of(run, model, choices.settle_s).map_err(refused)?;
    let began = Instant::now();
    let found = several(&observed, model, parameters).map_err(refused)?;
    let [given, _] = observed.simulate(model).map_err(refused)?;
    let before = residual_rms(&observed, &given);
    let [predicted, _] = observed.simulate(&found.model).map_err(refused)?;
    let after = residual_rms(&observed, &predicted);
    let mut warnings = found.warnings;
    let informed = warnings.is_empty();
    unexplained(&observed, after, true, &mut warnings);
    let estimated = found.parameters.iter().map(|(parameter, value, deviation)| {
        let own = EstimatedParameter {
            value: *value,
            standard_deviation: *deviation,
        };
        (parameter.symbol().to_owned(), own)
    });
    Ok(Estimated {
        report: EstimateReport {
            parameters: estimated.collect(),
            informed,
            law: choices.law.clone(),
            standard_deviation_of_law: true,
            samples: observed.len(),
            samples_per_s: observed.len() as f64 / began.elapsed().as_secs_f64().max(1e-9),
            output: observed.output.name().into(),
            noise_rms: observed.noise,
            residual_rms_before: before,
            residual_rms_after: after,
            data: run.source.clone(),
            data_hash: run.data_hash.clone(),
            notes: notes(&observed, found.offset),
            warnings,
        },
        abscissa: abscissa(&observed),
        courses: Vec::new(),
        predicted,
    })
}
