//! Several parameters at once, by recursive Gauss-Newton with exact sensitivities; two passes over the data.

use super::data::Output;
use super::one::{abscissa, refuse_worse, residual_rms, unexplained};
use super::report::{EstimateReport, EstimatedParameter};
use super::{Choices, Estimated, Observed};
use anhyst_estimator::{
    MeasuredOutput, MultiParameterGaussNewton, MultiParameterReport, MultiParameterSettings, StrainLaw,
    estimate_parameters,
};
use anhyst_launch::error::RunError;
use anhyst_measured::MeasuredRun;
use anhyst_model::{ActuatorModel, ActuatorOutputs, HysteresisParameter, Stage, TwoPole};
use std::time::Instant;

/// Known beforehand to this share.
const KNOWN: f64 = 0.1;
/// The noise of a series that shows none, as a share of its range.
const LEAST_NOISE: f64 = 1e-6;
/// Passes over the data: what is learnt early in a pass is learnt with the tangents of a poor estimate.
const PASSES: u32 = 4;
/// Passes in which the instrument's zero settles.
const OFFSET_PASSES: usize = 6;

/// Estimates a subset of [Ms, a, k, α, c].
///
/// # Errors
/// A law that cannot do it, a model with effects that this law does not know, data that cannot be used.
pub fn several_parameters(
    run: &MeasuredRun,
    model: &ActuatorModel,
    choices: &Choices,
    parameters: &[HysteresisParameter],
    progress: impl Fn(u64),
) -> Result<Estimated, RunError> {
    check(model, choices)?;
    let observed = Observed::of(run, model, choices.settle_s)?;
    let began = Instant::now();
    let fields = Fields::of(&observed, model)?;
    let measured_output = measured_output(&observed, model)?;
    let nominal = model.material.hysteresis;
    let mut settings = MultiParameterSettings::around(parameters, &nominal, KNOWN, noise(&observed));
    settings.passes = PASSES;
    let refuse = |error: anhyst_estimator::EstimatorError| RunError::Setup(error.to_string());
    let estimate = |offset: f64| -> Result<MultiParameterReport, RunError> {
        let outputs = fields.outputs(&observed, offset);
        estimate_parameters(
            &settings,
            nominal,
            measured_output,
            observed.tick_s,
            &fields.field_a_per_m,
            &outputs,
        )
        .map_err(refuse)
    };
    let mut found = estimate(0.0)?;
    let mut offset = 0.0;
    let mut predicted = predict(&observed, model, &found)?;
    for _ in 0..if observed.output == Output::Displacement {
        0
    } else {
        OFFSET_PASSES
    } {
        let compared = observed.measured.iter().zip(&predicted).skip(observed.settled);
        let left = compared.map(|(measured, predicted)| measured - predicted);
        offset = left.sum::<f64>() / (observed.len() - observed.settled).max(1) as f64;
        found = estimate(offset)?;
        predicted = predict(&observed, model, &found)?;
    }
    let mut law =
        MultiParameterGaussNewton::new(&settings, nominal, measured_output, observed.tick_s).map_err(refuse)?;
    let outputs = fields.outputs(&observed, offset);
    let mut courses = vec![Vec::with_capacity(observed.len()); parameters.len()];
    for (row, (field, output)) in fields.field_a_per_m.iter().zip(&outputs).enumerate() {
        let now = law.step(*field, *output).hysteresis;
        if row >= fields.approach {
            for (course, parameter) in courses.iter_mut().zip(parameters) {
                course.push([parameter.of(&now), 0.0]);
            }
            progress(1);
        }
    }
    let seconds = began.elapsed().as_secs_f64();
    finish(run, model, (&observed, offset), (found, courses, predicted), seconds)
}

fn check(model: &ActuatorModel, choices: &Choices) -> Result<(), RunError> {
    if choices.law != "gauss-newton" {
        return Err(RunError::Setup(format!(
            "--law {}: several parameters are estimated by gauss-newton",
            choices.law
        )));
    }
    let unknown = model
        .effects
        .iter()
        .find(|effect| effect.kind().stage() != Stage::Amplifier);
    match unknown {
        Some(effect) => Err(RunError::Setup(format!(
            "several parameters are estimated with exact sensitivities, which the effect {} of the model has none of; estimate `a` alone",
            effect.kind().name()
        ))),
        None => Ok(()),
    }
}

/// What drives the models, with the way to a sweep's first field in front.
struct Fields {
    field_a_per_m: Vec<f64>,
    /// Samples in front that were never measured.
    approach: usize,
}

impl Fields {
    fn of(observed: &Observed, model: &ActuatorModel) -> Result<Self, RunError> {
        let mut outputs = ActuatorOutputs::default();
        observed.simulate(model, &mut outputs)?;
        let mut field_a_per_m = observed.approach();
        let approach = field_a_per_m.len();
        field_a_per_m.append(&mut outputs.field_a_per_m);
        Ok(Self {
            field_a_per_m,
            approach,
        })
    }

    /// The measured outputs; those of the way there, and of the time to settle, are no numbers, which a law leaves out.
    fn outputs(&self, observed: &Observed, offset: f64) -> Vec<f64> {
        let left_out = self.approach + observed.settled;
        let measured = observed
            .measured
            .iter()
            .skip(observed.settled)
            .map(|measured| measured - offset);
        std::iter::repeat_n(f64::NAN, left_out).chain(measured).collect()
    }
}

fn measured_output(observed: &Observed, model: &ActuatorModel) -> Result<MeasuredOutput, RunError> {
    let strain = StrainLaw::of(&model.material);
    Ok(match observed.output {
        Output::Magnetization => MeasuredOutput::Magnetization,
        Output::Strain => MeasuredOutput::Strain(strain),
        Output::Displacement => {
            let rod = model
                .rod
                .ok_or_else(|| RunError::Setup("the model has no rod".into()))?;
            let per_strain = 1.0 / model.material.strain_per_magnetization();
            MeasuredOutput::Displacement {
                rod_per_strain: TwoPole {
                    gain: rod.gain * per_strain,
                    ..rod
                },
                strain,
            }
        }
    })
}

fn noise(observed: &Observed) -> f64 {
    let range = observed
        .measured
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
    observed
        .noise
        .max(LEAST_NOISE * (range.1 - range.0))
        .max(f64::MIN_POSITIVE.sqrt())
}

fn predict(observed: &Observed, model: &ActuatorModel, found: &MultiParameterReport) -> Result<Vec<f64>, RunError> {
    let mut amended = model.clone();
    if let Some(last) = found.passes.last() {
        amended.material.hysteresis = last.hysteresis;
    }
    let mut outputs = ActuatorOutputs::default();
    observed.simulate(&amended, &mut outputs)?;
    Ok(observed.output.of(&outputs).to_vec())
}

fn finish(
    run: &MeasuredRun,
    model: &ActuatorModel,
    (observed, offset): (&Observed, f64),
    (found, courses, predicted): (MultiParameterReport, Vec<Vec<[f64; 2]>>, Vec<f64>),
    seconds: f64,
) -> Result<Estimated, RunError> {
    let mut before = ActuatorOutputs::default();
    observed.simulate(model, &mut before)?;
    let residual_rms_before = residual_rms(observed, observed.output.of(&before));
    let after = residual_rms(observed, &predicted);
    refuse_worse(observed, residual_rms_before, after)?;
    let (mut parameters, mut warnings) = (std::collections::BTreeMap::new(), Vec::new());
    if let Some(last) = found.passes.last() {
        let uncertainty = &last.uncertainty;
        for (index, parameter) in uncertainty.parameters.iter().enumerate() {
            let (value, sd) = (uncertainty.estimates[index], uncertainty.deviations[index]);
            parameters.insert(parameter.symbol().to_owned(), EstimatedParameter { value, sd });
        }
        warnings.clone_from(&uncertainty.warnings);
    }
    let informed = warnings.is_empty();
    let parameters_named: Vec<String> = match found.passes.last() {
        Some(last) => last
            .uncertainty
            .parameters
            .iter()
            .map(|parameter| parameter.symbol().to_owned())
            .collect(),
        None => Vec::new(),
    };
    unexplained(observed, after, &mut warnings);
    let mut notes = observed.notes.clone();
    if observed.output != Output::Displacement {
        let (unit, name) = (observed.output.unit(), observed.output.name());
        notes.push(format!(
            "the zero of the measured {name} is off by {offset:.4e} {unit}; it was estimated too and taken off"
        ));
    }
    Ok(Estimated {
        report: EstimateReport {
            parameters,
            informed,
            law: "gauss-newton".into(),
            sd_of_law: true,
            samples: observed.len(),
            samples_per_s: observed.len() as f64 / seconds.max(1e-9),
            output: observed.output.name().into(),
            noise_rms: observed.noise,
            residual_rms_before,
            residual_rms_after: after,
            data: run.source.clone(),
            data_hash: run.data_hash.clone(),
            notes,
            warnings,
        },
        abscissa: abscissa(observed),
        courses: parameters_named.into_iter().zip(courses).collect(),
        predicted,
    })
}
