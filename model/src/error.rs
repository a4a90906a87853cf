//! What can be wrong with the numbers that describe a material, a rod or a circuit.

use thiserror::Error;

/// One refusal: which quantity, its value, its limit, and why the limit exists.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    /// A number is outside its range or not a number.
    #[error("{quantity} is {value} {unit}, but must be {requirement}")]
    OutOfRange {
        quantity: &'static str,
        value: f64,
        unit: &'static str,
        requirement: &'static str,
    },
    /// α·Ms/3a ≥ 1: the anhysteretic curve folds back on itself.
    #[error(
        "coupling {coupling} with saturation {saturation_magnetization_a_per_m} A/m and shape {shape_a_per_m} A/m makes \
         coupling times anhysteretic susceptibility (Ms/3a) {product:.4}, but it must stay below 1: \
         at 1 the anhysteretic slope dM/dH becomes infinite and then negative"
    )]
    AnhystereticFolds {
        coupling: f64,
        saturation_magnetization_a_per_m: f64,
        shape_a_per_m: f64,
        product: f64,
    },
    /// k − α(Man − Mirr) reaches zero on the major loop.
    #[error(
        "on the major loop Man - Mirr reaches {distance_a_per_m:.0} A/m, which times the coupling {coupling} is {product_a_per_m:.1} A/m, \
         but it must stay below the pinning {pinning_a_per_m} A/m: there the denominator of dMirr/dH vanishes and the slope is infinite"
    )]
    PinningOvercome {
        coupling: f64,
        pinning_a_per_m: f64,
        distance_a_per_m: f64,
        product_a_per_m: f64,
    },
    /// A bank or a rod was asked for with nothing in it.
    #[error("{what} needs at least {least}, but {given} were given")]
    TooFew {
        what: &'static str,
        least: usize,
        given: usize,
    },
}

/// Refuses `value` unless `accepted`; a NaN is never accepted because every comparison with it is false.
pub(crate) fn require(
    accepted: bool,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    requirement: &'static str,
) -> Result<(), ModelError> {
    if accepted && value.is_finite() {
        Ok(())
    } else {
        Err(ModelError::OutOfRange {
            quantity,
            value,
            unit,
            requirement,
        })
    }
}

pub(crate) fn require_positive(value: f64, quantity: &'static str, unit: &'static str) -> Result<(), ModelError> {
    require(value > 0.0, quantity, value, unit, "finite and above 0")
}

pub(crate) fn require_not_negative(value: f64, quantity: &'static str, unit: &'static str) -> Result<(), ModelError> {
    require(value >= 0.0, quantity, value, unit, "finite and not below 0")
}
