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

/// A column of row-major values.
pub(crate) struct Column<'a> {
    values: &'a mut [f64],
    next: usize,
    width: usize,
}

impl<'a> Column<'a> {
    /// That with number `column` of `width`.
    pub fn new(values: &'a mut [f64], column: usize, width: usize) -> Self {
        Self {
            values,
            next: column,
            width,
        }
    }

    fn put(&mut self, value: f64) {
        self.values[self.next] = value;
        self.next += self.width;
    }
}

/// Thins what `value` gives of rows by `n`, into as many values as [`kept_rows`] has. Not-a-number is passed over where a stretch has
/// numbers.
#[inline(always)]
pub(crate) fn thin<T>(rows: &[T], n: usize, value: impl Fn(&T) -> f64, into: &mut Column) {
    if n <= 2 {
        rows.iter().for_each(|row| into.put(value(row)));
        return;
    }
    for stretch in rows.chunks(n) {
        if let [row] = stretch {
            into.put(value(row));
            continue;
        }
        // Nothing compares with what is no number: it neither takes a place nor gives one up.
        let first = value(&stretch[0]);
        let (mut smallest, mut largest) = ((0, first), (0, first));
        for (at, row) in stretch.iter().enumerate().skip(1) {
            let value = value(row);
            if value < smallest.1 {
                smallest = (at, value);
            }
            if value > largest.1 {
                largest = (at, value);
            }
        }
        if first.is_nan() {
            (smallest, largest) = extremes(stretch.iter().map(&value));
        }
        let (early, late) = if smallest.0 <= largest.0 {
            (smallest.1, largest.1)
        } else {
            (largest.1, smallest.1)
        };
        into.put(early);
        into.put(late);
    }
}

/// Places and values of the smallest and the largest, where numbers may be missing.
#[cold]
fn extremes(column: impl Iterator<Item = f64>) -> ((usize, f64), (usize, f64)) {
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
    (smallest, largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thinned<const WIDTH: usize>(rows: &[[f64; WIDTH]], n: usize) -> Vec<f64> {
        let mut values = vec![0.0; kept_rows(rows.len(), n).count() * WIDTH];
        for column in 0..WIDTH {
            thin(rows, n, |row| row[column], &mut Column::new(&mut values, column, WIDTH));
        }
        values
    }

    /// Guards: a single spike survives, and each column keeps its own order.
    #[test]
    fn extremes_survive_in_their_order() {
        let rows = [[0.0, 9.0], [1.0, 2.0], [50.0, 3.0], [2.0, 1.0], [4.0, 4.0]];
        assert_eq!(thinned(&rows, 4), [0.0, 9.0, 50.0, 1.0, 4.0, 4.0]);
        assert!(kept_rows(5, 4).eq([0, 2, 4]));
    }

    /// Guards: there is a value for each time, for every length and every n.
    #[test]
    fn rows_and_times_agree() {
        for rows in 1..40 {
            for n in 1..12 {
                let n = if n <= 2 { 1 } else { n };
                let values = thinned(&vec![[1.0; 3]; rows], n);
                assert!(values.iter().all(|value| *value == 1.0), "{rows} {n}");
            }
        }
    }

    /// Guards: a missing value does not hide its neighbours.
    #[test]
    fn not_a_number_is_passed_over() {
        let nan = f64::NAN;
        assert_eq!(thinned(&[[nan], [3.0], [nan], [1.0]], 4), [3.0, 1.0]);
        assert_eq!(thinned(&[[2.0], [nan], [3.0], [nan]], 4), [2.0, 3.0]);
        assert!(thinned(&[[nan], [nan], [nan]], 4).iter().all(|value| value.is_nan()));
    }
}
