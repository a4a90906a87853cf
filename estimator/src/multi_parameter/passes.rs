//! Recorded data gone over several times: each pass starts from the last estimate with the first covariance.
//!
//! What a pass learns from early samples it learns with the tangents of a poor estimate; the next pass has better ones.

use super::gauss_newton::MultiParameterGaussNewton;
use super::output::{MeasuredOutput, OutputStage};
use super::settings::MultiParameterSettings;
use super::uncertainty::MultiParameterUncertainty;
use crate::EstimatorError;
use anhyst_ipc::Invalid;
use anhyst_model::{Hysteresis, SensitiveState};
use serde::{Deserialize, Serialize};

/// What one pass reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassReport {
    /// The material at the estimate.
    pub hysteresis: Hysteresis,
    /// What the estimate is worth.
    pub uncertainty: MultiParameterUncertainty,
    /// Rms of measured minus modelled output of a whole run with this material held, in the output's unit.
    pub residual_rms: f64,
}

/// All passes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultiParameterReport {
    /// In order; never empty.
    pub passes: Vec<PassReport>,
}

/// Estimates from recorded fields (A/m) and outputs, one each per tick, the first at tick 0 in a demagnetised material
/// and a rod at rest. Outputs that are not numbers are left out.
///
/// # Errors
/// A setting, a material or an output that cannot be used, or lists of different lengths.
pub fn estimate_parameters(
    settings: &MultiParameterSettings,
    nominal: Hysteresis,
    measured: MeasuredOutput,
    tick_s: f64,
    fields_a_per_m: &[f64],
    outputs: &[f64],
) -> Result<MultiParameterReport, EstimatorError> {
    if fields_a_per_m.len() != outputs.len() {
        let (fields, outputs) = (fields_a_per_m.len(), outputs.len());
        return Err(Invalid::new(
            "outputs",
            format!("{outputs} outputs do not fit {fields} fields: each tick needs one of both"),
        )
        .into());
    }
    let mut start = nominal;
    let mut passes = Vec::new();
    for _ in 0..settings.passes {
        let mut law = MultiParameterGaussNewton::starting_at(settings, nominal, start, measured, tick_s)?;
        for (field, output) in fields_a_per_m.iter().zip(outputs) {
            law.step(*field, *output);
        }
        start = law.estimate().hysteresis;
        let stage = OutputStage::new(measured, tick_s)?;
        passes.push(PassReport {
            hysteresis: start,
            uncertainty: law.uncertainty(),
            residual_rms: residual_rms(&start, stage, fields_a_per_m, outputs),
        });
    }
    Ok(MultiParameterReport { passes })
}

fn residual_rms(hysteresis: &Hysteresis, mut stage: OutputStage, fields: &[f64], outputs: &[f64]) -> f64 {
    let mut state = SensitiveState::default();
    let (mut squares, mut samples) = (0.0, 0.0);
    for (field, output) in fields.iter().zip(outputs) {
        state = hysteresis.advance_with_sensitivities(state, *field);
        let residual = output - stage.advance(&state).value;
        if stage.is_credible(*output) {
            squares += residual * residual;
            samples += 1.0;
        }
    }
    (squares / samples).sqrt()
}
