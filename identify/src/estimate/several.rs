//! Any constants of the nominal chain at once, from a whole run: the engine's least squares on the whole actuator.
//!
//! min over θ, z of |(y − y(θ) − z)/σ|² + Σ ((θ_i − θ0_i)/s_i)²: y measured output, y(θ) the actuator run freely along the drive,
//! σ noise, z the instrument's zero (of strain and magnetization), θ0 the model's values and s their priors (the table of
//! parameters). The model's effects are simulated with it. It never ends worse than it began.

use anhyst_measured::Quantity;
use anhyst_model::{ActuatorModel, NominalParameter};

use super::observed::Observed;
use crate::engine::{Coordinate, Problem, Stop};
use crate::error::IdentifyError;
use crate::parallel;
use crate::warnings::CORRELATION_LIMIT;

/// The noise of a series that shows none, as a share of its range.
const MIN_NOISE: f64 = 1e-6;

/// A standard deviation above this share of the prior's has learnt next to nothing from the run.
const UNLEARNT: f64 = 0.5;

/// What a run says of some constants.
#[derive(Clone, Debug, PartialEq)]
pub struct SeveralFound {
    /// Each with its value and standard deviation, in the order asked for.
    pub parameters: Vec<(NominalParameter, f64, f64)>,
    /// The model with these values.
    pub model: ActuatorModel,
    /// Zero of the measured output, in its unit.
    pub offset: f64,
    /// What the data cannot tell, in sentences.
    pub warnings: Vec<String>,
}

/// Estimates constants of a model.
///
/// # Errors
/// A constant of a part that the model lacks, or a model that cannot be run on this data.
pub fn several(
    observed: &Observed,
    model: &ActuatorModel,
    parameters: &[NominalParameter],
) -> Result<SeveralFound, IdentifyError> {
    let coordinate = |parameter: &NominalParameter| {
        let missing = || IdentifyError::NoSuchPart {
            model: model.name.clone(),
            parameter: parameter.symbol(),
        };
        parameter
            .spec(model)
            .map(|spec| Coordinate::of(&spec))
            .ok_or_else(missing)
    };
    let coordinates = parameters.iter().map(coordinate).collect::<Result<Vec<_>, _>>()?;
    observed.simulate(model)?;
    let (low, high) = anhyst_measured::sweep::extremes(&observed.measured);
    let noise = observed
        .noise
        .max(MIN_NOISE * (high - low))
        .max(f64::MIN_POSITIVE.sqrt());
    let with = |values: &[f64]| {
        let mut changed = model.clone();
        for (parameter, value) in parameters.iter().zip(values) {
            parameter.set(&mut changed, *value);
        }
        changed
    };
    let simulator = |values: &[f64]| {
        let [output, _] = observed.simulate(&with(values)).ok()?;
        let series: Vec<f64> = output.iter().map(|value| value / noise).collect();
        series.iter().all(|value| value.is_finite()).then_some(series)
    };
    let measured: Vec<f64> = observed.measured.iter().map(|value| value / noise).collect();
    let compared = observed.run.settling_rows..measured.len();
    let rows = std::slice::from_ref(&compared);
    let mut linear = Vec::new();
    if observed.output != Quantity::Displacement {
        linear.push(vec![1.0 / noise; measured.len()]);
    }
    let problem = Problem {
        measured: &measured,
        training: rows,
        linear: &linear,
        coordinates: &coordinates,
        simulator: &simulator,
        stop: Stop {
            share: 1e-7,
            ..Stop::CHANCE
        },
        threads: parallel::available(),
    };
    let start: Vec<f64> = parameters.iter().filter_map(|parameter| parameter.of(model)).collect();
    let unusable = || IdentifyError::NotSimulated {
        model: model.name.clone(),
    };
    let solution = problem.solve(&start).ok_or_else(unusable)?;
    let covariance = solution.covariance(&coordinates, rows);
    let mut warnings = Vec::new();
    for (index, one) in parameters.iter().enumerate() {
        for (before, other) in parameters[..index].iter().enumerate() {
            let correlation = covariance.correlation(before, index);
            if correlation.abs() > CORRELATION_LIMIT {
                warnings.push(format!(
                    "{} and {} cannot be told apart by this run: their correlation is {correlation:.4}, the limit {CORRELATION_LIMIT}",
                    other.symbol(),
                    one.symbol()
                ));
            }
        }
        let (value, own) = (solution.values[index], &coordinates[index]);
        let deviation = covariance.standard_deviation(index);
        if let Some((_, before)) = own.prior.filter(|(_, before)| deviation > UNLEARNT * before) {
            warnings.push(format!(
                "the data say next to nothing about {}: its standard deviation is {deviation:.3e} after {before:.3e} before them",
                one.symbol()
            ));
        }
        if value <= own.lower || value >= own.upper {
            warnings.push(format!(
                "{} ended at the edge of its range, {value:.6e}: its standard deviation means nothing",
                one.symbol()
            ));
        }
    }
    let found = parameters.iter().zip(&solution.values).enumerate();
    Ok(SeveralFound {
        parameters: found
            .map(|(index, (parameter, value))| (*parameter, *value, covariance.standard_deviation(index)))
            .collect(),
        model: with(&solution.values),
        offset: solution.coefficients.first().copied().unwrap_or_default(),
        warnings,
    })
}
