//! How coil loss warms the rod, and what warmth does.
//!
//! C·dT/dt = P − (T − T_ambient)/R,  P = (H/κ)²·R_coil(1 + β(T − T₀)),  a(T) = a₀·T/T₀,  λ_T = ε(T − T₀).
//! T temperatures (K), C heat capacity (J/K), R thermal resistance (K/W), P loss (W), H field (A/m), κ field per current
//! (A/m per A), β copper's temperature coefficient (1/K), a shape (A/m), ε expansion (1/K).
//! Assumptions: one lumped temperature; Langevin's a = k_B·T/(μ₀m) with a constant moment m.
//! Source: the Boltzmann statistics behind the paper's (1); the paper itself gives no thermal model.

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require, require_not_negative, require_positive};

/// Beyond these no rod and no coil is meant, and products of two such numbers may no longer be numbers.
const MOST: f64 = 1e9;
const HOTTEST_K: f64 = 1e4;

fn believable(
    value: f64,
    most: f64,
    quantity: &'static str,
    unit: &'static str,
    requirement: &'static str,
) -> Result<(), ModelError> {
    require(value <= most, quantity, value, unit, requirement)
}

/// One lumped temperature between a heater and the surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalCircuit {
    pub ambient_k: f64,
    pub heat_capacity_j_per_k: f64,
    pub resistance_k_per_w: f64,
}

impl ThermalCircuit {
    /// Time constant R·C, s.
    pub fn time_constant_s(&self) -> f64 {
        self.resistance_k_per_w * self.heat_capacity_j_per_k
    }

    /// Temperature (K) after `tick_s` seconds of constant power: exact for any tick.
    pub fn advance(&self, temperature_k: f64, power_w: f64, tick_s: f64) -> f64 {
        let settled = self.ambient_k + power_w * self.resistance_k_per_w;
        settled + (temperature_k - settled) * libm::exp(-tick_s / self.time_constant_s())
    }

    pub fn validate(&self) -> Result<(), ModelError> {
        require_positive(self.ambient_k, "ambient temperature", "K")?;
        require_positive(self.heat_capacity_j_per_k, "heat capacity", "J/K")?;
        require_positive(self.resistance_k_per_w, "thermal resistance", "K/W")?;
        believable(
            self.ambient_k,
            HOTTEST_K,
            "ambient temperature",
            "K",
            "at most 10 000 K",
        )?;
        believable(
            self.heat_capacity_j_per_k,
            MOST,
            "heat capacity",
            "J/K",
            "at most 1e9 J/K",
        )?;
        believable(
            self.resistance_k_per_w,
            MOST,
            "thermal resistance",
            "K/W",
            "at most 1e9 K/W",
        )
    }
}

/// Ohmic loss of the coil.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoilLoss {
    /// At `reference_temperature_k`.
    pub resistance_ohm: f64,
    /// κ, A/m per A.
    pub field_per_ampere: f64,
    /// 0.0039 1/K for copper.
    pub copper_temperature_coefficient_per_k: f64,
    pub reference_temperature_k: f64,
}

impl CoilLoss {
    /// I²R in W at a field (A/m) and a coil temperature (K).
    pub fn power_w(&self, field_a_per_m: f64, temperature_k: f64) -> f64 {
        let current = field_a_per_m / self.field_per_ampere;
        let warmth = self.copper_temperature_coefficient_per_k * (temperature_k - self.reference_temperature_k);
        current * current * self.resistance_ohm * (1.0 + warmth)
    }

    pub fn validate(&self) -> Result<(), ModelError> {
        require_not_negative(self.resistance_ohm, "coil resistance", "ohm")?;
        require_positive(self.field_per_ampere, "field per ampere", "A/m per A")?;
        require_not_negative(
            self.copper_temperature_coefficient_per_k,
            "temperature coefficient of the coil",
            "1/K",
        )?;
        require_positive(self.reference_temperature_k, "coil reference temperature", "K")?;
        believable(self.resistance_ohm, MOST, "coil resistance", "ohm", "at most 1e9 ohm")?;
        let field_per_ampere = self.field_per_ampere;
        let range = "between 1e-3 and 1e9 A/m per A";
        require(
            (1e-3..=MOST).contains(&field_per_ampere),
            "field per ampere",
            field_per_ampere,
            "A/m per A",
            range,
        )?;
        let coefficient = self.copper_temperature_coefficient_per_k;
        believable(
            coefficient,
            1.0,
            "temperature coefficient of the coil",
            "1/K",
            "at most 1 1/K",
        )?;
        let reference_k = self.reference_temperature_k;
        believable(
            reference_k,
            HOTTEST_K,
            "coil reference temperature",
            "K",
            "at most 10 000 K",
        )
    }
}

/// Shape `a` (A/m) at a temperature (K), from its value at a reference temperature: proportional to the absolute temperature.
pub fn shape_at(shape_at_reference_a_per_m: f64, reference_temperature_k: f64, temperature_k: f64) -> f64 {
    shape_at_reference_a_per_m * temperature_k / reference_temperature_k
}

/// The rod's own expansion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalExpansion {
    /// 12e-6 1/K for Terfenol-D.
    pub coefficient_per_k: f64,
    pub reference_temperature_k: f64,
}

impl ThermalExpansion {
    /// Free strain (no unit) at a temperature (K); it adds to the magnetostriction.
    pub fn strain(&self, temperature_k: f64) -> f64 {
        self.coefficient_per_k * (temperature_k - self.reference_temperature_k)
    }

    pub fn validate(&self) -> Result<(), ModelError> {
        let coefficient = self.coefficient_per_k;
        require(
            coefficient.abs() <= 1.0,
            "thermal expansion",
            coefficient,
            "1/K",
            "between -1 and 1 1/K",
        )?;
        require_positive(self.reference_temperature_k, "expansion reference temperature", "K")
    }
}
