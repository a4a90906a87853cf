//! a = a₀ (1 + n ΔT/T₀),  dΔT/dt = r (H/H₀)² − ΔT/τ: as the rod warms, the anhysteretic curve flattens.
//!
//! a shape (A/m), a₀ at ambient T₀ (K), ΔT rise of the rod (K), n relative slope (1 for Langevin's a = k_B T/(μ₀m), which is
//! a₀·T/T₀), r heating (K/s) at H₀ = 10 kA/m, τ loss time (s).
//! With a measured temperature ΔT is taken from it; then r and τ do nothing and n is the size.
//! Of what is reversible in M a share f follows `a` at once: all of it by M = c Man + (1 − c) Mirr with walls that stay (paper eq. (5)), none where the law is
//! integrated by the field alone (paper eq. (6)), as it is here unless told.
//! Assumption: uniform temperature; `a` is held above a tenth of a₀. Source: the Boltzmann statistics behind the paper's (1).

use serde::{Deserialize, Serialize};

use super::description::{CoilNeed, Description, Stage};
use super::warming::{WARMED, Warming, heating};
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Hysteresis,
    coil: CoilNeed::UnlessTemperatureIsMeasured,
    summary: "the shape `a` grows with the rod's temperature",
    signature: "refitted in windows only `a` moves, and with the integral of the field's square; the loop shears, no offset",
    source: "Langevin's a = kT/(μ0 m): +0.34 % a kelvin at 293 K",
    confused_with: &["coil_heating", "thermal_expansion", "parameter_a"],
    parameters: &[
        heating(0.3),
        ParameterSpec::fixed("loss_time_s", "s", [0.1, 1e4], 20.0)
            .by_ratio()
            .believed(0.7),
        ParameterSpec::fixed("relative_slope", "", [-5.0, 5.0], 1.0),
        WARMED,
        ParameterSpec::fixed("follows", "", [0.0, 1.0], 0.0).believed(0.5),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ThermalDrift {
    pub warming: Warming,
    relative_slope: f64,
    pub follows: f64,
    ambient_temperature_k: f64,
}

impl ThermalDrift {
    pub fn new(values: &[f64], tick_s: f64, ambient_temperature_k: f64) -> Self {
        ThermalDrift {
            warming: Warming::of([values[0], values[1], values[3]], tick_s),
            relative_slope: values[2],
            follows: values[4],
            ambient_temperature_k,
        }
    }

    /// a/a₀ at a rise of the temperature.
    #[inline]
    pub fn shape_factor(&self, rise_k: f64) -> f64 {
        let factor = 1.0 + self.relative_slope * rise_k / self.ambient_temperature_k;
        if factor > 0.1 { factor } else { 0.1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the law: a is proportional to the absolute temperature.
    #[test]
    fn shape_follows_the_absolute_temperature() {
        let drift = ThermalDrift::new(&[1.0, 20.0, 1.0, 0.0, 0.0], 1e-4, 293.0);
        assert_eq!(drift.shape_factor(0.0), 1.0);
        assert!((drift.shape_factor(12.0) - 305.0 / 293.0).abs() < 1e-15);
        assert_eq!(drift.shape_factor(-1e6), 0.1);
        // The paper's Θ = [6300, 7300] A/m is about 263 K to 305 K.
        assert!((7012.0 * drift.shape_factor(263.2 - 293.0) - 6300.0).abs() < 2.0);
        assert!((7012.0 * drift.shape_factor(305.0 - 293.0) - 7300.0).abs() < 2.0);
    }
}
