//! Geometry and material of the rod and what it pushes against.

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require_not_negative, require_positive};

/// Constants of the rod, SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodConstants {
    /// E, Pa.
    pub youngs_modulus_pa: f64,
    /// ρ, kg/m³.
    pub density_kg_per_m3: f64,
    /// L, m.
    pub length_m: f64,
    pub diameter_m: f64,
    /// c_D, N·s/m².
    pub internal_damping_n_s_per_m2: f64,
    /// k_L, N/m.
    pub end_stiffness_n_per_m: f64,
    /// c_L, N·s/m.
    pub end_damping_n_s_per_m: f64,
    /// M_L, kg.
    pub end_mass_kg: f64,
}

impl RodConstants {
    /// The constants behind the paper's (13). It does not print them; these reproduce its poles and gain to all printed digits.
    pub fn paper() -> Self {
        RodConstants {
            youngs_modulus_pa: 3.0e10,
            density_kg_per_m3: 9250.0,
            length_m: 0.115,
            diameter_m: 0.0127,
            internal_damping_n_s_per_m2: 3e6,
            end_stiffness_n_per_m: 2e6,
            end_damping_n_s_per_m: 1e3,
            end_mass_kg: 0.5,
        }
    }

    /// Cross section A, m².
    pub fn area_m2(&self) -> f64 {
        0.25 * std::f64::consts::PI * self.diameter_m * self.diameter_m
    }

    /// EA, N: a uniform free strain λ acts like the tip force EA·λ.
    pub fn force_per_strain_n(&self) -> f64 {
        self.youngs_modulus_pa * self.area_m2()
    }

    /// Static tip displacement per tip force, m/N: 1/(EA/L + k_L).
    pub fn static_compliance_m_per_n(&self) -> f64 {
        1.0 / (self.force_per_strain_n() / self.length_m + self.end_stiffness_n_per_m)
    }

    pub fn validate(&self) -> Result<(), ModelError> {
        require_positive(self.youngs_modulus_pa, "Young's modulus", "Pa")?;
        require_positive(self.density_kg_per_m3, "density", "kg/m^3")?;
        require_positive(self.length_m, "rod length", "m")?;
        require_positive(self.diameter_m, "rod diameter", "m")?;
        require_not_negative(self.internal_damping_n_s_per_m2, "internal damping", "N s/m^2")?;
        require_not_negative(self.end_stiffness_n_per_m, "end stiffness", "N/m")?;
        require_not_negative(self.end_damping_n_s_per_m, "end damping", "N s/m")?;
        require_not_negative(self.end_mass_kg, "end mass", "kg")
    }
}
