//! I = Σ φφᵀ/σ²,  φ = ∂y/∂θ:  no unbiased estimate has a covariance below I⁻¹ (Cramér and Rao).
//!
//! y output and σ its rms noise (same unit), θ the parameters of the hysteresis. White Gaussian noise, everything else
//! known.

use super::output::{COUNT, MeasuredOutput, OutputStage, SensitiveOutput};
use crate::EstimatorError;
use anhyst_model::{Hysteresis, HysteresisParameter, SensitiveState};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Fisher information of all five parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Information {
    sums: [[f64; COUNT]; COUNT],
}

/// What information allows at best.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CramerRao {
    /// In the order asked for, each in its parameter's unit.
    pub deviations: Vec<f64>,
    /// Correlations of the estimates.
    pub correlation: Vec<Vec<f64>>,
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

    /// The information of a whole run with a known material: `fields` in A/m, one per tick, the first at tick 0.
    ///
    /// # Errors
    /// A material or an output that cannot be used.
    pub fn of_run(
        hysteresis: &Hysteresis,
        measured: MeasuredOutput,
        tick_s: f64,
        noise: f64,
        fields: impl IntoIterator<Item = f64>,
    ) -> Result<Self, EstimatorError> {
        hysteresis.validate()?;
        let mut stage = OutputStage::new(measured, tick_s)?;
        let mut state = SensitiveState::default();
        let mut information = Information::default();
        for field in fields {
            state = hysteresis.advance_with_sensitivities(state, field);
            information.add(&stage.advance(&state), noise);
        }
        Ok(information)
    }

    /// I_ij, per product of the two parameters' units.
    pub fn about(&self, one: HysteresisParameter, other: HysteresisParameter) -> f64 {
        self.sums[one.index()][other.index()]
    }

    /// The bound for estimating these parameters together, all others being known; none where some combination of them
    /// leaves no trace in the output at all.
    pub fn bound(&self, parameters: &[HysteresisParameter]) -> Option<CramerRao> {
        let count = parameters.len();
        let lengths: Vec<f64> = parameters.iter().map(|one| self.about(*one, *one).sqrt()).collect();
        // Scaled to a diagonal of ones: the parameters' units differ by eight orders of magnitude.
        let scaled = DMatrix::from_fn(count, count, |i, j| {
            self.about(parameters[i], parameters[j]) / (lengths[i] * lengths[j])
        });
        let covariance = scaled.cholesky()?.inverse();
        let deviation = |i: usize| covariance[(i, i)].sqrt();
        let correlation = |i: usize, j: usize| covariance[(i, j)] / (deviation(i) * deviation(j));
        Some(CramerRao {
            deviations: (0..count).map(|i| deviation(i) / lengths[i]).collect(),
            correlation: (0..count)
                .map(|i| (0..count).map(|j| correlation(i, j)).collect())
                .collect(),
        })
    }
}
