//! How well the data fix the parameters: standard deviations, correlations, condition.
//!
//! cov = A⁻¹ (Σ_l s_l² τ_l J_lᵀJ_l) A⁻¹,  A = JᵀJ: J derivative of the weighted residuals, J_l its rows of loop l,
//! s_l² variance of those residuals, τ_l = 1 + 2Σρ_k their correlation length in samples (sum over lags until ρ_k ≤ 0).
//! Assumptions: errors are stationary along the loop and know nothing of the parameters; the model is right and linear
//! within the standard deviation. Where the residual is the model's own error, the result says how far an error of this
//! size and length moves the parameters, not how far they are from the truth.
//! Source: sandwich form of least squares; τ as in Sokal's integrated autocorrelation time.

use anhyst_model::Hysteresis;
use nalgebra::{DMatrix, DVector};

use crate::observed::Nuisance;
use crate::parameters::Parameter;
use crate::residuals::{Observation, central_differences};

/// Step of the differences, as a share of each parameter's scale.
const DIFFERENCE_STEP: f64 = 3e-4;
/// Directions weaker than this share of the strongest count as not seen by the data.
const RANK_TOLERANCE: f64 = 1e-10;

/// What the data say about the free parameters.
#[derive(Clone, Debug)]
pub(crate) struct Uncertainty {
    pub free: Vec<Parameter>,
    /// One per free parameter, in its unit.
    pub standard_deviations: Vec<f64>,
    pub correlation: Vec<Vec<f64>>,
    pub effective_shape_standard_deviation_a_per_m: f64,
    /// Of the sensitivities to all unknowns, each scaled to unit length.
    pub condition_number: f64,
    /// τ_l, samples.
    pub correlation_length_samples: Vec<f64>,
}

impl Uncertainty {
    pub fn of(observation: &Observation, hysteresis: &Hysteresis, nuisance: &Nuisance, free: Vec<Parameter>) -> Self {
        let centre = observation.residuals(hysteresis, nuisance);
        let jacobian = sensitivities(observation, hysteresis, nuisance, &free, &centre);
        let blocks = blocks(observation, &centre);
        let unknowns = jacobian.ncols();
        let freedom = centre.len() as f64 / (centre.len().saturating_sub(unknowns)).max(1) as f64;
        let mut weighted = DMatrix::zeros(unknowns, unknowns);
        for block in &blocks {
            let rows = jacobian.rows(block.first, block.count);
            weighted += rows.transpose() * rows * (block.variance * block.length_samples * freedom);
        }
        let (inverse, condition_number) = inverse_normal(&jacobian);
        let covariance = &inverse * weighted * &inverse;
        let scales: Vec<f64> = free.iter().map(|parameter| scale(*parameter, hysteresis)).collect();
        let deviation = |index: usize| covariance[(index, index)].max(0.0).sqrt();
        let correlation = (0..free.len())
            .map(|i| {
                (0..free.len())
                    .map(|j| covariance[(i, j)] / (deviation(i) * deviation(j)))
                    .collect()
            })
            .collect();
        // a_eff = a − αMs·s, in the scaled unknowns of the covariance.
        let slope = hysteresis.anhysteretic.initial_slope();
        let gradient = DVector::from_fn(unknowns, |index, _| match free.get(index) {
            Some(Parameter::SaturationMagnetization) => -hysteresis.coupling * slope * scales[index],
            Some(Parameter::Shape) => scales[index],
            Some(Parameter::Coupling) => -hysteresis.saturation_magnetization_a_per_m * slope * scales[index],
            _ => 0.0,
        });
        let effective_variance = gradient.dot(&(&covariance * &gradient));
        Uncertainty {
            standard_deviations: scales
                .iter()
                .enumerate()
                .map(|(index, scale)| scale * deviation(index))
                .collect(),
            correlation,
            effective_shape_standard_deviation_a_per_m: effective_variance.max(0.0).sqrt(),
            condition_number,
            correlation_length_samples: blocks.iter().map(|block| block.length_samples).collect(),
            free,
        }
    }
}

/// Natural size of a parameter: itself, except where it may be zero.
fn scale(parameter: Parameter, hysteresis: &Hysteresis) -> f64 {
    match parameter {
        Parameter::Coupling => 1.0 / hysteresis.initial_susceptibility(),
        Parameter::Reversibility => 1.0,
        other => other.of(hysteresis),
    }
}

/// J by the scaled parameters, then by the instrument's unknowns (fractions of each loop's range).
fn sensitivities(
    observation: &Observation,
    hysteresis: &Hysteresis,
    nuisance: &Nuisance,
    free: &[Parameter],
    centre: &DVector<f64>,
) -> DMatrix<f64> {
    let scales: Vec<f64> = free.iter().map(|parameter| scale(*parameter, hysteresis)).collect();
    let count = free.len() + observation.nuisance_count();
    let at = vec![0.0; count];
    let known = |column: usize| observation.known_column(column.checked_sub(free.len())?);
    central_differences(&at, &vec![DIFFERENCE_STEP; count], centre, known, |moves| {
        let (material, instrument) = moves.split_at(free.len());
        let mut moved = *hysteresis;
        for ((parameter, scale), by) in free.iter().zip(&scales).zip(material) {
            parameter.set(&mut moved, parameter.of(hysteresis) + scale * by);
        }
        moved.validate().ok()?;
        let mut instrument = observation.nuisance(instrument);
        let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        add(&mut instrument.offset, &nuisance.offset);
        add(&mut instrument.first, &nuisance.first);
        Some(observation.residuals(&moved, &instrument))
    })
}

/// (JᵀJ)⁻¹ and the condition of J with columns of unit length.
fn inverse_normal(jacobian: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let unknowns = jacobian.ncols();
    let norms: Vec<f64> = (0..unknowns)
        .map(|j| jacobian.column(j).norm().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(jacobian.nrows(), unknowns, |i, j| jacobian[(i, j)] / norms[j]);
    let eigen = (scaled.transpose() * scaled).symmetric_eigen();
    let (largest, smallest) = (eigen.eigenvalues.max(), eigen.eigenvalues.min());
    let floor = largest * RANK_TOLERANCE * RANK_TOLERANCE;
    let inverse_values = eigen.eigenvalues.map(|value| 1.0 / value.max(floor));
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse_values) * eigen.eigenvectors.transpose();
    let unscaled = DMatrix::from_fn(unknowns, unknowns, |i, j| inverse[(i, j)] / (norms[i] * norms[j]));
    (unscaled, (largest / smallest.max(floor)).sqrt())
}

/// Rows of one loop's magnetization (or strain) with the variance and correlation of their residuals.
struct Block {
    first: usize,
    count: usize,
    variance: f64,
    length_samples: f64,
}

fn blocks(observation: &Observation, residuals: &DVector<f64>) -> Vec<Block> {
    let magnetization = observation.loops.iter();
    let strain = observation.loops.iter().filter(|measured| measured.strain.is_some());
    let mut first = 0;
    let mut blocks = Vec::new();
    for measured in magnetization.chain(strain) {
        let count = measured.field_a_per_m.len();
        if first + count > residuals.len() {
            break;
        }
        let part = &residuals.as_slice()[first..first + count];
        let variance = part.iter().map(|r| r * r).sum::<f64>() / count as f64;
        blocks.push(Block {
            first,
            count,
            variance,
            length_samples: correlation_length_samples(part),
        });
        first += count;
    }
    blocks
}

/// τ = 1 + 2Σρ_k over the lags before the autocorrelation first falls to zero; at least 1.
pub(crate) fn correlation_length_samples(residuals: &[f64]) -> f64 {
    let mean = residuals.iter().sum::<f64>() / residuals.len() as f64;
    let product = |lag: usize| -> f64 {
        residuals
            .iter()
            .zip(&residuals[lag..])
            .map(|(first, second)| (first - mean) * (second - mean))
            .sum()
    };
    let variance = product(0);
    if variance == 0.0 {
        return 1.0;
    }
    let lags = (1..residuals.len()).map(|lag| product(lag) / variance);
    1.0 + 2.0 * lags.take_while(|correlation| *correlation > 0.0).sum::<f64>()
}
