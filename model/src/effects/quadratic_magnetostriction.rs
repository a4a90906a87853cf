//! λ = λ(M) + q λ′ M²/Ms: the strain has a quadratic part that the nominal law leaves out.
//!
//! λ free strain, λ′ the nominal law's slope (m/A; see [`reference_slope`]), Ms saturation, M magnetization (A/m), q no unit.
//! For the law linearised about the bias Ms/2, λ = λ′M, q = 1 is the full quadratic law, λ′(M + M²/Ms).
//! Assumption: constant stress. Source: the paper's (8), (9), with the square of (M + Ms/2) expanded correctly.

use super::description::{Description, Stage};
use crate::Material;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Strain,
    needs_time: false,
    summary: "the strain has a part in M²",
    signature: "even harmonics and a mean that grows with the square of the amplitude; rate-free, magnetization clean",
    source: "the paper's (8) and (9)",
    confused_with: &["bias_shift", "stiffening", "sensor_drift"],
    parameters: &[ParameterSpec::size("quadratic_fraction", "", [-2.0, 2.0], 5e-4)],
    ..Description::USUAL
};

/// λ′ in m/A: the law's slope at M = 0, or at Ms/2 for an even law. The rod's gain w belongs to it.
pub(crate) fn reference_slope(material: &Material) -> f64 {
    let at_zero = material.strain_per_magnetization();
    if at_zero != 0.0 {
        return at_zero;
    }
    let saturation = material.hysteresis.saturation_magnetization_a_per_m;
    material.magnetostriction.slope(0.5 * saturation, saturation)
}

/// What joins the coefficient of M² in the strain law, m²/A².
pub(crate) fn square_term(values: &[f64], material: &Material) -> f64 {
    values[0] * reference_slope(material) / material.hysteresis.saturation_magnetization_a_per_m
}
