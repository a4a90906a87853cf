//! How well the data fix what was fitted: standard deviations, correlations, condition.
//!
//! cov = A⁻¹ (Σ_l s_l² τ_l J_lᵀJ_l · n/(n − p) + P) A⁻¹,  A = JᵀJ + P: J derivative of the n weighted residuals by p numbers, J_l
//! its rows of block l, s_l² variance of the residuals there, τ_l = 1 + 2Σρ_k their correlation length in samples (sum over lags
//! until ρ_k ≤ 0), P = 1/(prior deviation)² on the diagonal.
//! Assumptions: errors are stationary along a block and know nothing of the parameters; the model is right and linear
//! within the standard deviation. Where the residual is the model's own error, the result says how far an error of this
//! size and length moves the parameters, not how far they are from the truth.
//! Source: sandwich form of least squares; τ as in Sokal's integrated autocorrelation time.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::span::dot;

/// Directions weaker than this share of the strongest count as not seen by the data.
const RANK_TOLERANCE: f64 = 1e-10;

/// What the data say about some numbers.
#[derive(Clone, Debug)]
pub struct Covariance {
    matrix: DMatrix<f64>,
    /// Numbers of which data and priors say nothing.
    silent: Vec<bool>,
    /// Of the derivatives by all numbers, each scaled to unit length.
    pub condition_number: f64,
    /// τ_l, samples.
    pub correlation_lengths_samples: Vec<f64>,
}

impl Covariance {
    /// From the derivatives of all rows by each number, their priors' standard deviations (missing ones: none), the residual, and
    /// the rows that belong together.
    pub fn of(
        columns: &[Vec<f64>],
        prior_deviations: &[Option<f64>],
        residual: &[f64],
        blocks: &[Range<usize>],
    ) -> Self {
        let numbers = columns.len();
        let rows: usize = blocks.iter().map(ExactSizeIterator::len).sum();
        let freedom = rows as f64 / rows.saturating_sub(numbers).max(1) as f64;
        let prior = DMatrix::from_fn(numbers, numbers, |i, j| match prior_deviations.get(i) {
            Some(Some(deviation)) if i == j => 1.0 / (deviation * deviation),
            _ => 0.0,
        });
        let (mut normal, mut noisy) = (prior.clone(), prior);
        let mut correlation_lengths_samples = Vec::new();
        for block in blocks {
            let own = &residual[block.clone()];
            let variance = own.iter().map(|r| r * r).sum::<f64>() / own.len().max(1) as f64;
            let length = correlation_length_samples(own);
            let one = std::slice::from_ref(block);
            let part = DMatrix::from_fn(numbers, numbers, |i, j| {
                dot(one, &columns[i.min(j)], &columns[i.max(j)])
            });
            noisy += &part * (variance * length * freedom);
            normal += part;
            correlation_lengths_samples.push(length);
        }
        let silent = (0..numbers).map(|index| normal[(index, index)] <= 0.0).collect();
        let (inverse, condition_number) = inverse(&normal);
        Covariance {
            matrix: &inverse * noisy * &inverse,
            silent,
            condition_number,
            correlation_lengths_samples,
        }
    }

    /// Infinite where nothing is known.
    pub fn standard_deviation(&self, index: usize) -> f64 {
        if self.silent[index] {
            f64::INFINITY
        } else {
            self.matrix[(index, index)].max(0.0).sqrt()
        }
    }

    pub fn correlation(&self, one: usize, other: usize) -> f64 {
        self.matrix[(one, other)] / (self.standard_deviation(one) * self.standard_deviation(other))
    }

    /// Of a sum of the first numbers, each times its weight.
    pub fn standard_deviation_along(&self, weights: &[f64]) -> f64 {
        let weights = DVector::from_fn(self.matrix.nrows(), |index, _| {
            weights.get(index).copied().unwrap_or(0.0)
        });
        weights.dot(&(&self.matrix * &weights)).max(0.0).sqrt()
    }
}

/// A⁻¹ and the condition of what it is the square of, with columns of unit length.
fn inverse(normal: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let size = normal.nrows();
    if size == 0 {
        return (normal.clone(), 1.0);
    }
    let norms: Vec<f64> = (0..size).map(|j| normal[(j, j)].max(0.0).sqrt()).collect();
    let over = |value: f64, i: usize, j: usize| {
        let scale = norms[i] * norms[j];
        if scale > 0.0 { value / scale } else { 0.0 }
    };
    let scaled = DMatrix::from_fn(size, size, |i, j| over(normal[(i, j)], i, j));
    let eigen = scaled.symmetric_eigen();
    let (largest, smallest) = (eigen.eigenvalues.max(), eigen.eigenvalues.min());
    let floor = largest * RANK_TOLERANCE * RANK_TOLERANCE;
    let inverse_values = eigen.eigenvalues.map(|value| 1.0 / value.max(floor));
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse_values) * eigen.eigenvectors.transpose();
    let unscaled = DMatrix::from_fn(size, size, |i, j| over(inverse[(i, j)], i, j));
    (unscaled, (largest / smallest.max(floor)).sqrt())
}

/// τ = 1 + 2Σρ_k over the lags before the autocorrelation first falls to zero; at least 1.
pub fn correlation_length_samples(residuals: &[f64]) -> f64 {
    let mean = residuals.iter().sum::<f64>() / residuals.len() as f64;
    let product = |lag: usize| -> f64 {
        residuals
            .iter()
            .zip(&residuals[lag..])
            .map(|(first, second)| (first - mean) * (second - mean))
            .sum()
    };
    let variance = product(0);
    if variance == 0.0 {
        return 1.0;
    }
    let lags = (1..residuals.len()).map(|lag| product(lag) / variance);
    1.0 + 2.0 * lags.take_while(|correlation| *correlation > 0.0).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the one formula of uncertainty: of a mean of n numbers with noise σ it is σ/√n, a prior alone stays what it was,
    /// and a number that nothing depends on is not known.
    #[test]
    fn known_cases_come_out() {
        let residual: Vec<f64> = (0..1000).map(|k| if k % 2 == 0 { 0.3 } else { -0.3 }).collect();
        let columns = [vec![1.0; 1000], vec![0.0; 1000], vec![0.0; 1000]];
        let rows = std::slice::from_ref(&(0..1000));
        let found = Covariance::of(&columns, &[None, Some(0.7), None], &residual, rows);
        assert!((found.standard_deviation(0) / (0.3 / 1000.0_f64.sqrt()) - 1.0).abs() < 2e-3);
        assert!((found.standard_deviation(1) - 0.7).abs() < 1e-12);
        assert!(found.standard_deviation(2).is_infinite());
        assert!((found.standard_deviation_along(&[2.0, 0.0]) - 2.0 * found.standard_deviation(0)).abs() < 1e-12);
    }
}
