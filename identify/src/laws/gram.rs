//! Sums over samples of everything that a least squares needs: products of regressors and output.

use nalgebra::{DMatrix, DVector};

use super::nnls::nnls;

/// Which weights are neighbours, and how much their differences cost.
#[derive(Clone, Debug, Default)]
pub(super) struct Smoothness {
    /// Regressors, two by two.
    pub neighbours: Vec<(usize, usize)>,
    /// Of the mean power of the regressors.
    pub strength: f64,
}

impl Smoothness {
    fn penalise(&self, gram: &mut DMatrix<f64>) {
        let price = self.strength * gram.trace() / gram.nrows() as f64;
        for (one, other) in &self.neighbours {
            gram[(*one, *one)] += price;
            gram[(*other, *other)] += price;
            gram[(*one, *other)] -= price;
            gram[(*other, *one)] -= price;
        }
    }
}

/// Σ z zᵀ over samples, z = (1, regressors, output).
#[derive(Clone, Debug)]
pub(super) struct Gram {
    sums: DMatrix<f64>,
}

impl Gram {
    pub fn new(regressors: usize) -> Self {
        Gram {
            sums: DMatrix::zeros(regressors + 2, regressors + 2),
        }
    }

    /// One sample, `z` as above; only the lower triangle is kept.
    pub fn add(&mut self, z: &[f64], weight: f64) {
        let size = z.len();
        let sums = self.sums.as_mut_slice();
        for (column, value) in z.iter().enumerate() {
            let factor = weight * value;
            if factor == 0.0 {
                continue;
            }
            let own = &mut sums[column * size + column..(column + 1) * size];
            for (sum, other) in own.iter_mut().zip(&z[column..]) {
                *sum += factor * other;
            }
        }
    }

    pub fn plus(&self, other: &Gram) -> Gram {
        Gram {
            sums: &self.sums + &other.sums,
        }
    }

    fn at(&self, one: usize, other: usize) -> f64 {
        self.sums[(one.max(other), one.min(other))]
    }

    /// Sum of the samples' weights.
    pub fn weight(&self) -> f64 {
        self.at(0, 0)
    }

    /// Offset, then the weights of the regressors, not negative and as alike as `smooth` asks.
    pub fn fitted(&self, smooth: &Smoothness) -> DVector<f64> {
        let last = self.sums.nrows() - 1;
        let all = self.weight();
        let about_mean = |i: usize, j: usize| self.at(i, j) - self.at(0, i) * self.at(0, j) / all;
        let mut gram = DMatrix::from_fn(last - 1, last - 1, |i, j| about_mean(i + 1, j + 1));
        smooth.penalise(&mut gram);
        let moment = DVector::from_fn(last - 1, |i, _| about_mean(i + 1, last));
        let mean_squares = DVector::from_fn(last - 1, |i, _| self.at(0, i + 1).powi(2) / all);
        let weights = nnls(&gram, &moment, &mean_squares);
        let of_weights: f64 = (0..last - 1).map(|i| weights[i] * self.at(0, i + 1)).sum();
        let offset = (self.at(0, last) - of_weights) / all;
        DVector::from_iterator(last, std::iter::once(offset).chain(weights.iter().copied()))
    }

    /// Σ (output − weightsᵀ z)², not below 0 by rounding.
    pub fn squares(&self, weights: &DVector<f64>) -> f64 {
        let last = self.sums.nrows() - 1;
        // −1 for the output: one quadratic form.
        let of = |i: usize| if i == last { -1.0 } else { weights[i] };
        let mut sum = 0.0;
        for i in 0..=last {
            let mut row = 0.0;
            for j in 0..=last {
                row += self.at(i, j) * of(j);
            }
            sum += of(i) * row;
        }
        sum.max(0.0)
    }
}
