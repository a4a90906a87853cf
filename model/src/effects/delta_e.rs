//! ü + k̂ u̇ + s(M) (ĉ u − w M) = f F,  s = 1 + e (M/Ms)²: the material's stiffness depends on its magnetization.
//!
//! u displacement (m), M magnetization, Ms saturation (A/m), F force (N), e relative growth of the stiffness at saturation.
//! The free strain stays: s multiplies what pulls the rod towards it, so the static gain is the nominal one and the
//! resonance moves with √s. Assumption: the whole stiffness is the material's, and even in M.
//! Source: ΔE effect, ±20-40 % within a working loop of Terfenol-D.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Rod,
    summary: "stiffness depends on the magnetization",
    signature: "resonance moves with bias and amplitude while the gain at low frequency stays",
    source: "ΔE effect of Terfenol-D, ±20-40 % in a working loop",
    confused_with: &["load_change", "second_mode", "stiffening"],
    parameters: &[ParameterSpec::size("relative_growth", "", [-0.9, 5.0], 0.2)],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DeltaE {
    growth_per_square: f64,
}

impl DeltaE {
    pub fn new(values: &[f64], saturation_magnetization_a_per_m: f64) -> Self {
        let saturation = saturation_magnetization_a_per_m;
        DeltaE {
            growth_per_square: values[0] / (saturation * saturation),
        }
    }

    /// s − 1.
    #[inline]
    pub fn growth(&self, magnetization_a_per_m: f64) -> f64 {
        self.growth_per_square * magnetization_a_per_m * magnetization_a_per_m
    }
}
