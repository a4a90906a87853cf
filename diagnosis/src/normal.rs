//! Normal equations of columns under the levels of their bands (`products.rs`).
//!
//! H = AᵀS⁻¹A + 1/σ², S the level of the band. Columns are scaled to unit length before they are solved for, so that
//! numbers of any unit stand side by side and none is held back by rounding.

use nalgebra::{DMatrix, DVector};

use crate::unknown::Unknown;

/// Below this share of a column's own square, what the others leave of it is rounding.
const RANK_TOLERANCE: f64 = 1e-11;

/// AᵀS⁻¹A and AᵀS⁻¹Z.
pub(crate) struct Normal {
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
}

impl Normal {
    /// Adds what is believed of the unknowns, the first columns, and gives their pull.
    pub fn believe(&mut self, unknowns: &[Unknown]) -> Vec<f64> {
        let mut pull = vec![0.0; self.right.len()];
        for (index, unknown) in unknowns.iter().enumerate() {
            let slope = unknown.surprise_slope();
            self.matrix[(index, index)] += slope * slope;
            pull[index] = -slope * unknown.surprise();
        }
        pull
    }

    /// Solution of (matrix) x = right + pull; a column that the others make up gets nothing.
    pub fn solve(&self, pull: &[f64]) -> Vec<f64> {
        self.damped(pull, 0.0, 0, &vec![false; pull.len()])
    }

    /// The same with Marquardt's damping on the first `damped` columns, some of all held at 0.
    pub fn damped(&self, pull: &[f64], damping: f64, damped: usize, held: &[bool]) -> Vec<f64> {
        let size = pull.len();
        let scale: Vec<f64> = (0..size)
            .map(|index| self.matrix[(index, index)].max(0.0).sqrt())
            .collect();
        let used = |index: usize| !held[index] && scale[index] > 0.0;
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            if row == column {
                1.0 + RANK_TOLERANCE + if row < damped { damping } else { 0.0 }
            } else if used(row) && used(column) {
                self.matrix[(row, column)] / (scale[row] * scale[column])
            } else {
                0.0
            }
        });
        let right = DVector::from_fn(size, |row, _| {
            if used(row) {
                (self.right[row] + pull[row]) / scale[row]
            } else {
                0.0
            }
        });
        let Some(factor) = scaled.cholesky() else {
            return vec![0.0; size];
        };
        let solution = factor.solve(&right);
        (0..size)
            .map(|row| if used(row) { solution[row] / scale[row] } else { 0.0 })
            .collect()
    }

    pub fn inverse(&self) -> DMatrix<f64> {
        let size = self.right.len();
        let scale: Vec<f64> = (0..size)
            .map(|index| self.matrix[(index, index)].max(0.0).sqrt())
            .collect();
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            let product = scale[row] * scale[column];
            let own = if product > 0.0 {
                self.matrix[(row, column)] / product
            } else {
                0.0
            };
            own + if row == column { RANK_TOLERANCE } else { 0.0 }
        });
        let inverse = scaled
            .cholesky()
            .map_or_else(|| DMatrix::zeros(size, size), |factor| factor.inverse());
        DMatrix::from_fn(size, size, |row, column| {
            let product = scale[row] * scale[column];
            if product > 0.0 {
                inverse[(row, column)] / product
            } else {
                0.0
            }
        })
    }
}
