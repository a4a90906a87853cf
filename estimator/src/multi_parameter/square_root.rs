//! P = L Lᵀ;  a = Lᵀφ,  S = r + aᵀa,  K = L a/S,  L⁺ = L − K aᵀ/(1 + √(r/S)):  P⁺ = P − K φᵀP without ever forming P.
//!
//! P covariance of the m coordinates, φ derivatives of the output by them, r variance of the measurement (unit of the
//! output squared). A difference of nearly equal covariances could lose its sign; the square of a root cannot.
//! Source: Potter's update, in Bierman, Factorization Methods for Discrete Sequential Estimation (1977), chapter II.

use super::output::COUNT;

/// L, of which the first m rows and columns are used.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SquareRoot {
    count: usize,
    rows: [[f64; COUNT]; COUNT],
}

impl SquareRoot {
    /// Every deviation 1, no correlation.
    pub fn unit(count: usize) -> Self {
        let mut rows = [[0.0; COUNT]; COUNT];
        for (index, row) in rows.iter_mut().enumerate() {
            row[index] = 1.0;
        }
        Self { count, rows }
    }

    /// a = Lᵀφ.
    pub fn seen(&self, slopes: &[f64; COUNT]) -> [f64; COUNT] {
        let mut seen = [0.0; COUNT];
        for (row, slope) in self.rows[..self.count].iter().zip(slopes) {
            for (sum, entry) in seen[..self.count].iter_mut().zip(row) {
                *sum += entry * slope;
            }
        }
        seen
    }

    /// Takes one measurement in and returns the gain K.
    pub fn update(&mut self, seen: &[f64; COUNT], noise_variance: f64) -> [f64; COUNT] {
        let count = self.count;
        let expected = noise_variance + seen[..count].iter().map(|one| one * one).sum::<f64>();
        let part = 1.0 / (1.0 + (noise_variance / expected).sqrt());
        let mut gain = [0.0; COUNT];
        for (row, gain) in self.rows[..count].iter_mut().zip(&mut gain) {
            let product: f64 = row[..count].iter().zip(seen).map(|(entry, seen)| entry * seen).sum();
            *gain = product / expected;
            for (entry, seen) in row[..count].iter_mut().zip(seen) {
                *entry -= part * *gain * seen;
            }
        }
        gain
    }

    /// P_ij.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let (one, other) = (&self.rows[i][..self.count], &self.rows[j][..self.count]);
        one.iter().zip(other).map(|(one, other)| one * other).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    proptest! {
        // Guards the update against its definition: P⁻¹ grows by φφᵀ/r, and K = P⁺φ/r.
        #[test]
        fn information_adds_up(
            slopes in prop::collection::vec(prop::array::uniform5(-3.0..3.0_f64), 1..20), noise in 0.01..10.0_f64,
        ) {
            let mut root = SquareRoot::unit(COUNT);
            let mut information = SMatrix::<f64, COUNT, COUNT>::identity();
            for slopes in slopes {
                let vector = SVector::from(slopes);
                information += vector * vector.transpose() / noise;
                let expected = information.try_inverse().unwrap();
                let gain = root.update(&root.seen(&slopes), noise);
                let expected_gain = expected * vector / noise;
                for i in 0..COUNT {
                    prop_assert!((gain[i] - expected_gain[i]).abs() < 1e-9);
                    for j in 0..COUNT {
                        prop_assert!((root.covariance(i, j) - expected[(i, j)]).abs() < 1e-9);
                    }
                }
            }
        }
    }

    // Guards a subset: what is not estimated is not touched.
    #[test]
    fn only_the_first_rows_are_used() {
        let mut root = SquareRoot::unit(2);
        let gain = root.update(&root.seen(&[1.0, 2.0, 5.0, 5.0, 5.0]), 4.0);
        assert_eq!(gain[2..], [0.0; 3]);
        assert!((root.covariance(0, 0) - (1.0 - 1.0 / 9.0)).abs() < 1e-15);
        assert!((root.covariance(0, 1) + 2.0 / 9.0).abs() < 1e-15);
    }
}
