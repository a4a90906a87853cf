//! e^A = (e^{A/2^j})^{2^j}: scaling and squaring with a Taylor series, for small dense matrices at start-up.
//!
//! Own loops in a fixed order: the result has the same bits on every processor, which a library that picks kernels by
//! processor does not promise. ‖A/2^j‖ ≤ 1/2, 18 terms: truncation below 1e-21 of the scaled matrix.

const TERMS: u32 = 18;

/// Exponential of the `size`×`size` matrix stored by rows.
pub(super) fn exponential(matrix: &[f64], size: usize) -> Vec<f64> {
    let mut norm = 0.0_f64;
    for row in matrix.chunks(size) {
        let sum: f64 = row.iter().map(|entry| entry.abs()).sum();
        norm = norm.max(sum);
    }
    let mut halvings = 0;
    let mut scale = 1.0;
    while norm * scale > 0.5 && halvings < 200 {
        scale *= 0.5;
        halvings += 1;
    }
    let scaled: Vec<f64> = matrix.iter().map(|entry| entry * scale).collect();
    // Summed as e^A − 1, so that small entries survive the squarings: (1+X)² − 1 = 2X + X².
    let mut term = scaled.clone();
    let mut excess = scaled.clone();
    for index in 2..=TERMS {
        term = product(&term, &scaled, size);
        for (entry, sum) in term.iter_mut().zip(&mut excess) {
            *entry /= f64::from(index);
            *sum += *entry;
        }
    }
    for _ in 0..halvings {
        let square = product(&excess, &excess, size);
        for (entry, square) in excess.iter_mut().zip(square) {
            *entry = 2.0 * *entry + square;
        }
    }
    for index in 0..size {
        excess[index * size + index] += 1.0;
    }
    excess
}

fn product(left: &[f64], right: &[f64], size: usize) -> Vec<f64> {
    let mut result = vec![0.0; size * size];
    for row in 0..size {
        for inner in 0..size {
            let factor = left[row * size + inner];
            if factor == 0.0 {
                continue;
            }
            for column in 0..size {
                result[row * size + column] += factor * right[inner * size + column];
            }
        }
    }
    result
}
