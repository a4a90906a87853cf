//! Sums whose order does not wait for every addition.

/// Σ a b in four running sums: the same bits everywhere, and four times as quick.
#[inline]
pub(super) fn sum_of_products(first: &[f64], second: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (first_four, first_rest) = first.as_chunks::<4>();
    let (second_four, second_rest) = second.as_chunks::<4>();
    for (a, b) in first_four.iter().zip(second_four) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = first_rest.iter().zip(second_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Σ a in four running sums.
#[inline]
pub(super) fn sum(of: impl Iterator<Item = f64>) -> f64 {
    let mut sums = [0.0; 4];
    for (place, a) in of.enumerate() {
        sums[place % 4] += a;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}
