//! λ = λ(M) + ε ΔT,  dΔT/dt = r (H/H₀)² − ΔT/τ: the rod lengthens as it warms.
//!
//! ε expansion (1/K), ΔT rise of the rod (K), r heating (K/s) at H₀ = 10 kA/m, H coil field (A/m), τ loss time (s).
//! With a measured temperature ΔT is taken from it; then r and τ do nothing and ε is the size.
//! Only the product rε shows in a displacement. Assumption: uniform temperature, no thermal stress but the load's.
//! Source: 11-12 ppm/K of Terfenol-D: 1.4 μm/K on 0.115 m.

use serde::{Deserialize, Serialize};

use super::description::{CoilNeed, Description, Stage};
use super::warming::{Warming, heating};
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Strain,
    coil: CoilNeed::UnlessTemperatureIsMeasured,
    summary: "the rod lengthens with its temperature",
    signature: "one sign, follows the integral of the field's square and not the field; relaxes at rest",
    source: "12 ppm a kelvin of Terfenol-D",
    confused_with: &["sensor_drift", "after_effect", "thermal_drift"],
    parameters: &[
        heating(0.02),
        // Free, it would be a creep.
        ParameterSpec::fixed("loss_time_s", "s", [0.1, 1e4], 20.0).by_ratio(),
        ParameterSpec::fixed("expansion_per_k", "1/K", [-1e-4, 1e-4], 12e-6),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ThermalExpansion {
    pub warming: Warming,
    pub expansion_per_k: f64,
}

impl ThermalExpansion {
    pub fn new(values: &[f64], tick_s: f64) -> Self {
        ThermalExpansion {
            warming: Warming::new(values[0], values[1], tick_s),
            expansion_per_k: values[2],
        }
    }
}
