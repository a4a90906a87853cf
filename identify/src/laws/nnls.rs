//! min ½ wᵀ A w − bᵀ w over w ≥ 0: least squares with weights that are not negative, from the Gram matrix.
//!
//! The active set of Lawson and Hanson in the form of Bro and de Jong, J. Chemometrics 11 (1997) 393.

use nalgebra::{DMatrix, DVector};

/// Of a column's power: keeps columns that look alike from cancelling.
const RIDGE: f64 = 1e-6;
/// Of the largest gradient: what is as small is zero.
const TOLERANCE: f64 = 1e-10;
/// Of a column's mean square: one that hardly moves gets its weight from noise, and shows it where it does move.
const STILL: f64 = 1e-8;
/// Columns of less power than this share of the largest are no columns.
const NOTHING: f64 = 1e-14;

/// The weights; A is symmetric and not negative, `mean_squares` are those of the columns before their means were taken off.
pub(super) fn nnls(gram: &DMatrix<f64>, moment: &DVector<f64>, mean_squares: &DVector<f64>) -> DVector<f64> {
    let count = moment.len();
    let largest = (0..count).map(|i| gram[(i, i)]).fold(0.0, f64::max);
    let scale = DVector::from_fn(count, |i, _| {
        let power = gram[(i, i)];
        if power > NOTHING * largest {
            1.0 / power.sqrt()
        } else {
            0.0
        }
    });
    let scaled = DMatrix::from_fn(count, count, |i, j| {
        let ridge = RIDGE + STILL * mean_squares[i] * scale[i] * scale[i];
        gram[(i, j)] * scale[i] * scale[j] + if i == j { ridge } else { 0.0 }
    });
    let wanted = moment.component_mul(&scale);
    let level = TOLERANCE * wanted.amax();
    let mut weights = DVector::zeros(count);
    let mut free: Vec<usize> = Vec::new();
    for _ in 0..10 * count {
        let gradient = &wanted - &scaled * &weights;
        let candidates = (0..count).filter(|i| scale[*i] > 0.0 && !free.contains(i));
        let Some(next) = candidates.max_by(|i, j| gradient[*i].total_cmp(&gradient[*j])) else {
            break;
        };
        if gradient[next] <= level {
            break;
        }
        free.push(next);
        // Until all that are free are above 0.
        while let Some(solved) = solved(&scaled, &wanted, &free) {
            if solved.iter().all(|weight| *weight > 0.0) {
                weights.fill(0.0);
                free.iter().zip(&solved).for_each(|(i, weight)| weights[*i] = *weight);
                break;
            }
            let mut share: f64 = 1.0;
            for (i, to) in free.iter().zip(&solved) {
                if *to <= 0.0 {
                    share = share.min(weights[*i] / (weights[*i] - to));
                }
            }
            for (i, to) in free.iter().zip(&solved) {
                weights[*i] += share * (to - weights[*i]);
            }
            // The one that stopped it is 0 but for rounding.
            let before = free.len();
            free.retain(|i| weights[*i] > 1e-15);
            if free.len() == before {
                break;
            }
            (0..count)
                .filter(|i| !free.contains(i))
                .collect::<Vec<_>>()
                .iter()
                .for_each(|i| weights[*i] = 0.0);
        }
    }
    weights.component_mul(&scale)
}

fn solved(gram: &DMatrix<f64>, moment: &DVector<f64>, free: &[usize]) -> Option<Vec<f64>> {
    let own = DMatrix::from_fn(free.len(), free.len(), |i, j| gram[(free[i], free[j])]);
    let wanted = DVector::from_fn(free.len(), |i, _| moment[free[i]]);
    own.cholesky()
        .map(|factor| factor.solve(&wanted).iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns that point apart: the one whose weight would be negative stays out, and the other is as if alone.
    #[test]
    fn a_weight_that_would_be_negative_is_zero() {
        let gram = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 1.0]);
        let moment = DVector::from_row_slice(&[2.0, 0.5]);
        let weights = nnls(&gram, &moment, &DVector::zeros(2));
        assert_eq!(weights[1], 0.0);
        assert!((weights[0] - 1.0).abs() < 1e-5);
    }

    /// Where no bound is met it is the solution of the normal equations, to the ridge.
    #[test]
    fn without_bounds_it_solves() {
        let gram = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0]);
        let truth = DVector::from_row_slice(&[1.0, 0.3, 2.0]);
        let found = nnls(&gram, &(&gram * &truth), &DVector::zeros(3));
        assert!((found - truth).amax() < 1e-4);
    }
}
