//! min ½ wᵀ A w − bᵀ w over w ≥ 0: least squares with weights that are not negative, from the Gram matrix.
//!
//! Block principal pivoting: Portugal, Júdice and Vicente, Math. Comp. 63 (1994) 625; Kim and Park, SIAM J. Sci. Comput. 33 (2011) 3261.

use nalgebra::{DMatrix, DVector};

/// Of a column's power: keeps columns that look alike from cancelling, and weights from noise. A third as much and three times as much predict as
/// well on the open data together (`anhyst benchmark`); without it Terfenol-D and an inner loop of a ferrite are predicted 1.2 times worse.
const RIDGE: f64 = 3e-5;
/// Of the largest gradient: what is as small is zero.
const TOLERANCE: f64 = 1e-10;
/// Of a column's mean square: one that hardly moves gets its weight from noise, and shows it where it does move.
const STILL: f64 = 1e-8;
/// Exchanges of whole blocks that may get nowhere.
const PATIENCE: u32 = 4;
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
    let used: Vec<bool> = scale.iter().map(|scale| *scale > 0.0).collect();
    let mut free = vec![false; count];
    let (mut weights, mut gradient) = (DVector::zeros(count), -&wanted);
    let (mut fewest, mut patience) = (count + 1, PATIENCE);
    for _ in 0..100 * count {
        let wrong = |i: &usize| {
            used[*i]
                && if free[*i] {
                    weights[*i] < 0.0
                } else {
                    gradient[*i] < -level
                }
        };
        let wrong: Vec<usize> = (0..count).filter(wrong).collect();
        let Some(last) = wrong.last() else { break };
        if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
        } else {
            patience = patience.saturating_sub(1);
        }
        // Whole blocks as long as that gets on; else the last one alone, which comes to an end.
        let exchanged = if patience > 0 {
            &wrong[..]
        } else {
            std::slice::from_ref(last)
        };
        exchanged.iter().for_each(|i| free[*i] = !free[*i]);
        let set: Vec<usize> = (0..count).filter(|i| free[*i]).collect();
        let Some(solved) = solved(&scaled, &wanted, &set) else {
            break;
        };
        weights.fill(0.0);
        set.iter().zip(&solved).for_each(|(i, weight)| weights[*i] = *weight);
        gradient = &scaled * &weights - &wanted;
    }
    weights.map(|weight: f64| weight.max(0.0)).component_mul(&scale)
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

    /// Two columns that point apart: the one whose weight would be negative stays out, and the other is as if alone: moment / (power (1 + ridge)).
    #[test]
    fn a_weight_that_would_be_negative_is_zero() {
        let gram = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 1.0]);
        let moment = DVector::from_row_slice(&[2.0, 0.5]);
        let weights = nnls(&gram, &moment, &DVector::zeros(2));
        assert_eq!(weights[1], 0.0);
        assert!((weights[0] * (1.0 + RIDGE) - 1.0).abs() < 1e-12);
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
