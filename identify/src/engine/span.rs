//! Linear columns and what they can explain: an orthonormal basis Q of their span, L = Q R, on the rows that count.
//!
//! Taking QQᵀz out of z is the least-squares fit of z by L (variable projection, Golub and Pereyra 1973); the coefficients are
//! R⁻¹Qᵀz. Columns orthogonalised twice (Kahan), so that Q is orthonormal to rounding.

use std::ops::Range;

/// Less than this share of a column's square beside the others counts as nothing.
const RANK_TOLERANCE: f64 = 1e-10;

/// Inner product over some rows.
pub fn dot(rows: &[Range<usize>], a: &[f64], b: &[f64]) -> f64 {
    rows.iter()
        .map(|range| dot_all(&a[range.clone()], &b[range.clone()]))
        .sum()
}

/// Inner product in eight lanes, so that it runs at the speed of memory.
fn dot_all(a: &[f64], b: &[f64]) -> f64 {
    let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_chunks
        .remainder()
        .iter()
        .zip(b_chunks.remainder())
        .map(|(a, b)| a * b)
        .sum();
    let mut lanes = [0.0; 8];
    for (a, b) in a_chunks.zip(b_chunks) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// Columns made orthonormal on some rows, to take them out of others.
pub struct Span<'a> {
    rows: &'a [Range<usize>],
    basis: Vec<Vec<f64>>,
    /// Of each basis vector: the column it came from, and that column's shares along the basis up to it (a column of R).
    triangle: Vec<(usize, Vec<f64>)>,
    columns: usize,
}

impl<'a> Span<'a> {
    pub fn of(columns: &[Vec<f64>], rows: &'a [Range<usize>]) -> Self {
        let mut span = Span {
            rows,
            basis: Vec::new(),
            triangle: Vec::new(),
            columns: columns.len(),
        };
        for (index, column) in columns.iter().enumerate() {
            let before = dot(rows, column, column);
            let mut own = column.clone();
            let mut shares = span.take_out(&mut own);
            for (share, again) in shares.iter_mut().zip(span.take_out(&mut own)) {
                *share += again;
            }
            let square = dot(rows, &own, &own);
            if square > RANK_TOLERANCE * before && square > 0.0 {
                let size = square.sqrt();
                own.iter_mut().for_each(|value| *value /= size);
                shares.push(size);
                span.basis.push(own);
                span.triangle.push((index, shares));
            }
        }
        span
    }

    /// Shares of a vector along the basis.
    pub fn shares(&self, vector: &[f64]) -> Vec<f64> {
        self.basis.iter().map(|own| dot(self.rows, own, vector)).collect()
    }

    /// Takes out of all rows what fits on the span's; the shares along the basis.
    pub fn take_out(&self, vector: &mut [f64]) -> Vec<f64> {
        let mut shares = Vec::with_capacity(self.basis.len());
        for own in &self.basis {
            let share = dot(self.rows, own, vector);
            for (value, own) in vector.iter_mut().zip(own) {
                *value -= share * own;
            }
            shares.push(share);
        }
        shares
    }

    pub fn without(&self, mut vector: Vec<f64>) -> Vec<f64> {
        self.take_out(&mut vector);
        vector
    }

    /// Multiples of the columns that make up the shares; 0 for a column that the others make up.
    pub fn coefficients(&self, mut shares: Vec<f64>) -> Vec<f64> {
        let mut coefficients = vec![0.0; self.columns];
        for (place, (column, triangle)) in self.triangle.iter().enumerate().rev() {
            let coefficient = shares[place] / triangle[place];
            coefficients[*column] = coefficient;
            for (share, own) in shares.iter_mut().zip(triangle) {
                *share -= coefficient * own;
            }
        }
        coefficients
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards zeros of instruments: slanting columns are told apart, and one that repeats the others gets nothing.
    #[test]
    fn coefficients_are_those_of_the_columns() {
        let rows = [0..40, 50..100];
        let column = |f: fn(f64) -> f64| (0..100).map(|k| f(f64::from(k))).collect::<Vec<f64>>();
        let columns = [
            column(|_| 1.0),
            column(|k| k),
            column(|k| 3.0 + 2.0 * k),
            column(|k| k * k),
        ];
        let span = Span::of(&columns, &rows);
        let mut vector = column(|k| 5.0 - 0.5 * k + 0.01 * k * k);
        let coefficients = span.coefficients(span.shares(&vector));
        for (found, expected) in coefficients.iter().zip([5.0, -0.5, 0.0, 0.01]) {
            assert!((found - expected).abs() < 1e-9, "{coefficients:?}");
        }
        span.take_out(&mut vector);
        assert!(vector.iter().all(|left| left.abs() < 1e-10));
    }
}
