//! J = Σ w (φ − φ̄)(φ − φ̄)ᵀ/σ²,  J v_i = λ_i v_i: direction v_i of the parameters is told where λ_i ≥ 1/d²; Π = Σ v_i v_iᵀ over those.
//!
//! φ derivatives of the predicted displacement by the scaled parameters q (m), σ noise of the sensor (m), w = exp(−age/T), d worst
//! deviation as a share of the first one. 1/√λ_i is the Cramér-Rao bound along v_i from the recent motion alone, an unknown
//! zero of the displacement taken off. The directions are found anew every [`BLOCK`] ticks.
//! Source: the excitation monitor of `excitation.rs` for one parameter, in every direction.

use super::coordinates::COUNT;
use nalgebra::{SMatrix, SymmetricEigen};
use serde::{Deserialize, Serialize};

/// Ticks between two looks at the directions.
pub(super) const BLOCK: u32 = 64;

type Square = [[f64; COUNT]; COUNT];

/// What the recent motion tells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Directions {
    keep: f64,
    least: f64,
    noise_variance_m2: f64,
    weight: f64,
    mean: [f64; COUNT],
    /// Σ w (φ − φ̄)(φ − φ̄)ᵀ, m².
    sums: Square,
    /// Π.
    told: Square,
    count: u32,
}

impl Directions {
    pub fn new(memory_s: f64, noise_m: f64, worst_deviation: f64, tick_s: f64) -> Self {
        Self {
            keep: libm::exp(-tick_s / memory_s),
            least: 1.0 / (worst_deviation * worst_deviation),
            noise_variance_m2: noise_m * noise_m,
            weight: 0.0,
            mean: [0.0; COUNT],
            sums: [[0.0; COUNT]; COUNT],
            told: [[0.0; COUNT]; COUNT],
            count: 0,
        }
    }

    /// Takes one tick in; one without a usable measurement only fades what was before.
    pub fn observe(&mut self, slopes: &[f64; COUNT], measured: bool) {
        self.weight = self.weight * self.keep + f64::from(u8::from(measured));
        let part = if measured { 1.0 / self.weight } else { 0.0 };
        let away: [f64; COUNT] = std::array::from_fn(|index| slopes[index] - self.mean[index]);
        let share = if measured { 1.0 - part } else { 0.0 };
        for (row, one) in self.sums.iter_mut().zip(&away) {
            for (sum, other) in row.iter_mut().zip(&away) {
                *sum = *sum * self.keep + share * one * other;
            }
        }
        for (mean, away) in self.mean.iter_mut().zip(&away) {
            *mean += part * away;
        }
    }

    /// Finds the directions anew.
    pub fn look(&mut self) {
        let sums = SMatrix::<f64, COUNT, COUNT>::from_fn(|i, j| self.sums[i][j] / self.noise_variance_m2);
        self.told = [[0.0; COUNT]; COUNT];
        self.count = 0;
        // Bounded, so that a step is: what has not been found by then is found in the next block.
        let Some(eigen) = SymmetricEigen::try_new(sums, f64::EPSILON, 100) else {
            return;
        };
        for (own, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *own < self.least {
                continue;
            }
            self.count += 1;
            for (row, one) in self.told.iter_mut().zip(direction.iter()) {
                for (entry, other) in row.iter_mut().zip(direction.iter()) {
                    *entry += one * other;
                }
            }
        }
    }

    /// The part along the directions that are told.
    pub fn along(&self, vector: &[f64; COUNT]) -> [f64; COUNT] {
        std::array::from_fn(|row| self.told[row].iter().zip(vector).map(|(one, other)| one * other).sum())
    }

    /// How many directions are told.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// J_ii.
    pub fn information(&self, index: usize) -> f64 {
        self.sums[index][index] / self.noise_variance_m2
    }
}
