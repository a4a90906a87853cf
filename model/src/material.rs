//! A material: its hysteresis, its magnetostriction, and where the numbers come from.

use serde::{Deserialize, Serialize};

use crate::{Hysteresis, Magnetostriction, ModelError};

/// Everything that describes a magnetostrictive material at one temperature and stress.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    pub name: String,
    /// Publication, data sheet or measured file that the numbers come from.
    pub source: String,
    pub hysteresis: Hysteresis,
    pub magnetostriction: Magnetostriction,
}

impl Material {
    /// The paper's Terfenol-D, biased at Ms/2, λs = 1.005e-3.
    pub fn terfenol_d() -> Self {
        Material {
            name: String::from("Terfenol-D"),
            source: String::from("Nealis and Smith, section 5"),
            hysteresis: Hysteresis::terfenol_d(),
            magnetostriction: Magnetostriction::Linearised {
                saturation_magnetostriction: 1.005e-3,
                bias_fraction: 0.5,
            },
        }
    }

    /// Checks the hysteresis and the magnetostriction.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.hysteresis.validate()?;
        self.magnetostriction.validate()
    }

    /// dλ/dM at M = 0 (m/A): what a linear rod is built on. Zero for the even laws.
    pub fn strain_per_magnetization(&self) -> f64 {
        self.magnetostriction
            .slope(0.0, self.hysteresis.saturation_magnetization_a_per_m)
    }
}
