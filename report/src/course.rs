//! A series as letters: what a terminal shows of its course, in Braille's dots, two across and four down a letter.
//!
//! A column of dots reaches from the smallest to the largest value that falls on it, so that a fast signal shows as a band.

/// Dots of a letter, top to bottom, left and right.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
/// A letter without dots.
const BLANK: u32 = 0x2800;

/// So many letters wide and lines high. A value that is not finite leaves its place empty.
pub fn course(values: &[f64], width: usize, height: usize) -> Vec<String> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (
        finite().fold(f64::INFINITY, f64::min),
        finite().fold(f64::NEG_INFINITY, f64::max),
    );
    let (columns, rows) = (2 * width, 4 * height);
    let mut letters = vec![vec![BLANK; width]; height];
    let row_of = |value: f64| {
        let share = if high > low { (high - value) / (high - low) } else { 0.5 };
        ((share * rows as f64) as usize).min(rows - 1)
    };
    let bound = |column: usize| column * values.len() / columns;
    let mut last: Option<usize> = None;
    for column in 0..columns {
        // Where there are fewer values than columns, each is drawn where it stands.
        let (begin, end) = (bound(column), bound(column + 1).max(bound(column) + 1));
        let own = values.get(begin..end.min(values.len())).unwrap_or_default();
        let rows: Vec<usize> = own
            .iter()
            .copied()
            .filter(|value| value.is_finite())
            .map(row_of)
            .collect();
        let (Some(top), Some(bottom)) = (rows.iter().min(), rows.iter().max()) else {
            last = None;
            continue;
        };
        // Steep pieces hang together.
        let (top, bottom) = match last {
            Some(before) if before + 1 < *top => (before + 1, *bottom),
            Some(before) if before > *bottom + 1 => (*top, before - 1),
            _ => (*top, *bottom),
        };
        for row in top..=bottom {
            letters[row / 4][column / 2] |= DOTS[row % 4][column % 2];
        }
        last = rows.last().copied();
    }
    let line = |line: Vec<u32>| line.into_iter().filter_map(char::from_u32).collect();
    letters.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the picture: high is up, a fast signal is a band, a hole is a hole.
    #[test]
    fn a_course_is_drawn_as_it_runs() {
        assert_eq!(course(&[0.0, 1.0, 2.0, 3.0], 2, 1), ["⡠⠊"]);
        assert_eq!(course(&[3.0, f64::NAN, 0.0, 0.0], 2, 1), ["⠁⣀"]);
        let fast: Vec<f64> = (0..1000).map(|index| f64::from(index % 7)).collect();
        assert_eq!(course(&fast, 3, 2), ["⣿⣿⣿", "⣿⣿⣿"]);
        assert_eq!(course(&[5.0; 8], 2, 1), ["⠤⠤"]);
        assert_eq!(course(&[], 2, 1), ["⠀⠀"]);
    }
}
