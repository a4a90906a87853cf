//! Fewer rows for the eye: every stretch of `n` rows becomes two, which hold each column's smallest and largest value in
//! the order in which they came. No peak is lost, and a line through the rows has the envelope of the full curve.

/// Indices of the rows whose times the thinned rows take, for `rows` rows thinned by `n`.
pub(crate) fn kept_rows(rows: usize, n: usize) -> impl Iterator<Item = usize> {
    let n = n.max(1);
    (0..rows).step_by(n).flat_map(move |start| {
        let length = n.min(rows - start);
        let second = (length > 1).then_some(start + length / 2);
        std::iter::once(start).chain(second)
    })
}

/// Thins row-major `values` of `width` columns by `n`. Not-a-number is passed over where a stretch has numbers.
pub(crate) fn thin(values: &[f64], width: usize, n: usize) -> Vec<f64> {
    if n <= 2 {
        return values.to_vec();
    }
    let mut thinned = Vec::with_capacity(2 * values.len() / n + 2 * width);
    for stretch in values.chunks(n * width) {
        if stretch.len() == width {
            thinned.extend_from_slice(stretch);
            continue;
        }
        let first = thinned.len();
        thinned.resize(first + 2 * width, f64::NAN);
        for column in 0..width {
            let (early, late) = extremes(stretch.iter().skip(column).step_by(width).copied());
            thinned[first + column] = early;
            thinned[first + width + column] = late;
        }
    }
    thinned
}

/// Smallest and largest value, the earlier one first.
fn extremes(column: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut smallest = (0, f64::NAN);
    let mut largest = (0, f64::NAN);
    for (at, value) in column.enumerate().filter(|(_, value)| !value.is_nan()) {
        if smallest.1.is_nan() || value < smallest.1 {
            smallest = (at, value);
        }
        if largest.1.is_nan() || value > largest.1 {
            largest = (at, value);
        }
    }
    if smallest.0 <= largest.0 {
        (smallest.1, largest.1)
    } else {
        (largest.1, smallest.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards: a single spike survives, and each column keeps its own order.
    #[test]
    fn extremes_survive_in_their_order() {
        let columns = [[0.0, 9.0], [1.0, 2.0], [50.0, 3.0], [2.0, 1.0], [4.0, 4.0]];
        let thinned = thin(columns.as_flattened(), 2, 4);
        assert_eq!(thinned, [0.0, 9.0, 50.0, 1.0, 4.0, 4.0]);
        assert!(kept_rows(5, 4).eq([0, 2, 4]));
    }

    /// Guards: times and values stay of equal number for every length and every n.
    #[test]
    fn rows_and_times_agree() {
        for rows in 1..40 {
            for n in 1..12 {
                let n = if n <= 2 { 1 } else { n };
                assert_eq!(
                    thin(&vec![0.0; 3 * rows], 3, n).len(),
                    3 * kept_rows(rows, n).count(),
                    "{rows} {n}"
                );
            }
        }
    }

    /// Guards: a missing value does not hide its neighbours.
    #[test]
    fn not_a_number_is_passed_over() {
        let thinned = thin(&[f64::NAN, 3.0, f64::NAN, 1.0], 1, 4);
        assert_eq!(thinned, [3.0, 1.0]);
    }
}
