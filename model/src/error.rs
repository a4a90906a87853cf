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
    /// k − α(Man − Mirr) all but reaches zero on the major loop.
    #[error(
        "on the major loop Man - Mirr reaches {distance_a_per_m:.0} A/m, which times the coupling {coupling} is {product_a_per_m:.1} A/m, \
         but it must stay below 0.99 of the pinning {pinning_a_per_m} A/m: at the pinning the denominator of dMirr/dH vanishes and the slope is infinite, \
         and just below it no step of finite length follows"
    )]
    PinningOvercome {
        coupling: f64,
        pinning_a_per_m: f64,
        distance_a_per_m: f64,
        product_a_per_m: f64,
    },
    /// 3b₃M² joins α until the anhysteretic curve folds.
    #[error(
        "the prestress term b3 of {cubic_coupling_m2_per_a2} m^2/A^2 makes (alpha + 3 b3 M^2) times the anhysteretic susceptibility \
         {product:.4} somewhere below saturation, but it must stay below 1: at 1 the slope dM/dH becomes infinite and then negative"
    )]
    PrestressFolds {
        cubic_coupling_m2_per_a2: f64,
        product: f64,
    },
    /// A material of which only the magnetization is known was to move something.
    #[error(
        "the strain law is not known (magnetostriction: Unmeasured): the material says how it magnetises, not how it moves. Give it a strain \
         law, or compare it with a measured magnetization or flux density alone"
    )]
    NoStrainLaw,
    /// A value of an effect is outside its bounds or not a number.
    #[error("{parameter} of {effect} is {value} {unit}, but must be between {lower} and {upper} {unit}")]
    EffectOutOfBounds {
        effect: &'static str,
        parameter: &'static str,
        value: f64,
        unit: &'static str,
        lower: f64,
        upper: f64,
    },
    /// Another number of values than the effect has parameters.
    #[error("{effect} has {needed} parameters, but {given} values were given")]
    EffectValues {
        effect: &'static str,
        needed: usize,
        given: usize,
    },
    /// No parameter of that name.
    #[error("{effect} has no parameter {parameter}")]
    EffectParameterUnknown { effect: &'static str, parameter: String },
    /// A tolerance for what is no constant of the model.
    #[error("the tolerances name {name:?}, which is no constant of the model; they can be for {known}")]
    ToleranceUnknown { name: String, known: String },
    /// The same effect twice.
    #[error("{effect} stands twice among the effects; one of a kind is the most, because two cannot be told apart")]
    EffectRepeated { effect: &'static str },
    /// The model has no rod for the effect to act on.
    #[error("the effect {effect} acts inside the domain wall law, and the material has another law")]
    EffectNeedsDomainWall { effect: &'static str },
    #[error("{effect} acts on the moving rod, but the model has no rod")]
    EffectNeedsRod { effect: &'static str },
    /// The rod has more than the two poles that the effect is written for.
    #[error("{effect} is written for a rod of two poles, but this one has finite elements")]
    EffectNeedsTwoPoles { effect: &'static str },
    /// A sweep without time cannot have the effect.
    #[error("{effect} needs time, but a quasi-static sweep has none")]
    EffectNeedsTime { effect: &'static str },
    /// Two columns of a run differ in length.
    #[error("{given} samples of {quantity} were given for {needed} samples of the drive; they must be as many")]
    LengthsDiffer {
        quantity: &'static str,
        needed: usize,
        given: usize,
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
