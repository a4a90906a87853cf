//! I = Σ φφᵀ/σ²,  φ = ∂y/∂θ:  no unbiased estimate has a covariance below I⁻¹ (Cramér and Rao).
//!
//! y output and σ its rms noise (same unit), θ the parameters of the hysteresis. White Gaussian noise, everything else
//! known.

use super::output::{COUNT, SensitiveOutput};
use anhyst_model::HysteresisParameter;
use serde::{Deserialize, Serialize};

/// Fisher information of all five parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Information {
    sums: [[f64; COUNT]; COUNT],
}

impl Information {
    /// Takes one sample in, measured with `noise` rms.
    pub fn add(&mut self, output: &SensitiveOutput, noise: f64) {
        let scaled = output.derivatives.map(|derivative| derivative / noise);
        for (row, one) in self.sums.iter_mut().zip(&scaled) {
            for (sum, other) in row.iter_mut().zip(&scaled) {
                *sum += one * other;
            }
        }
    }

    /// I_ij, per product of the two parameters' units.
    pub fn about(&self, one: HysteresisParameter, other: HysteresisParameter) -> f64 {
        self.sums[one.index()][other.index()]
    }
}
