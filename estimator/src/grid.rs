//! The bank's shape parameters: a_j = lower + j·(upper − lower)/(N − 1), j = 0 … N−1, and interpolation between them.
//!
//! a_j shape parameter of member j (A/m); Θ = [lower, upper] the range that the estimate may not leave (A/m).
//! Linear interpolation is what the covers and the proof of the folded law speak about; the magnetization handed to the
//! inverse is interpolated smoothly ([`Grid::smooth`]), because linear interpolation of it costs about 1 A/m, as much as
//! everything else together.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A uniform grid over Θ. One member is allowed: then the range is that point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    shapes_a_per_m: Vec<f64>,
    members_per_a_per_m: f64,
}

impl Grid {
    /// `members` points from `lower_a_per_m` to `upper_a_per_m`, both included.
    pub fn new(lower_a_per_m: f64, upper_a_per_m: f64, members: usize) -> Self {
        let gaps = members.saturating_sub(1);
        let spacing = (upper_a_per_m - lower_a_per_m) / gaps.max(1) as f64;
        let mut shapes_a_per_m: Vec<f64> = (0..=gaps).map(|j| lower_a_per_m + j as f64 * spacing).collect();
        // The edges must be the range itself, not the range up to rounding: the estimate is projected onto them.
        if gaps > 0 {
            shapes_a_per_m[gaps] = upper_a_per_m;
        }
        let members_per_a_per_m = if spacing > 0.0 { 1.0 / spacing } else { 0.0 };
        Self {
            shapes_a_per_m,
            members_per_a_per_m,
        }
    }

    /// The shape parameters, ascending, A/m.
    pub fn shapes_a_per_m(&self) -> &[f64] {
        &self.shapes_a_per_m
    }

    /// Lower edge of Θ, A/m.
    pub fn lower_a_per_m(&self) -> f64 {
        self.shapes_a_per_m[0]
    }

    /// Upper edge of Θ, A/m.
    pub fn upper_a_per_m(&self) -> f64 {
        self.shapes_a_per_m[self.shapes_a_per_m.len() - 1]
    }

    /// The nearest point of Θ, A/m.
    pub fn project(&self, shape_a_per_m: f64) -> f64 {
        shape_a_per_m.max(self.lower_a_per_m()).min(self.upper_a_per_m())
    }

    /// Whether an estimate stands at an edge of Θ.
    pub fn is_edge(&self, shape_a_per_m: f64) -> bool {
        shape_a_per_m <= self.lower_a_per_m() || shape_a_per_m >= self.upper_a_per_m()
    }

    /// One over the width of a gap, m/A.
    pub(crate) fn members_per_a_per_m(&self) -> f64 {
        self.members_per_a_per_m
    }

    /// The gap j with a_j ≤ a ≤ a_j+1; the first or the last one outside Θ.
    pub(crate) fn gap(&self, shape_a_per_m: f64) -> usize {
        let last = self.shapes_a_per_m.len().saturating_sub(2);
        let guess = (shape_a_per_m - self.lower_a_per_m()) * self.members_per_a_per_m;
        // The cast takes a negative or missing number to 0; 32 bits are cheaper to cast to and more than any bank has.
        (guess as u32 as usize).min(last)
    }

    /// The members that enclose everything within `window_a_per_m` of a shape, as far as Θ goes.
    pub fn members_around(&self, shape_a_per_m: f64, window_a_per_m: f64) -> Range<usize> {
        let last = self.gap(shape_a_per_m + window_a_per_m) + 1;
        self.gap(shape_a_per_m - window_a_per_m)..(last + 1).min(self.shapes_a_per_m.len())
    }

    /// The same, or all of them without a window.
    pub(crate) fn members_seen(&self, shape_a_per_m: f64, window_a_per_m: Option<f64>) -> Range<usize> {
        match window_a_per_m {
            Some(window) => self.members_around(shape_a_per_m, window),
            None => 0..self.shapes_a_per_m.len(),
        }
    }

    /// Piecewise linear interpolation of `values`, one per member.
    pub fn linear(&self, values: &[f64], shape_a_per_m: f64) -> f64 {
        let [only] = values else {
            let j = self.gap(shape_a_per_m);
            let (left, right) = (self.shapes_a_per_m[j], self.shapes_a_per_m[j + 1]);
            return values[j] + (values[j + 1] - values[j]) * ((shape_a_per_m - left) / (right - left));
        };
        *only
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    // Guards the edges: the estimate lives on them for long stretches when the range is chosen too narrow.
    #[test]
    fn the_edges_are_exactly_the_range() {
        let grid = Grid::new(6300.1, 7300.3, 33);
        assert_eq!((grid.lower_a_per_m(), grid.upper_a_per_m()), (6300.1, 7300.3));
        assert_eq!(grid.shapes_a_per_m().len(), 33);
        let values: Vec<f64> = grid.shapes_a_per_m().iter().map(|a| 3.0 * a).collect();
        assert_eq!(grid.linear(&values, 7300.3), 3.0 * 7300.3);
    }

    #[test]
    fn one_member_is_its_own_interpolation() {
        let grid = Grid::new(7012.0, 7012.0, 1);
        assert_eq!(grid.linear(&[5.0], 7012.0), 5.0);
        assert_eq!(grid.project(9000.0), 7012.0);
    }

    // Guards the window of the covers: it never leaves out what it promises, and never leaves Θ.
    #[test]
    fn windows_enclose_what_they_promise() {
        let grid = Grid::new(6300.0, 7300.0, 11);
        assert_eq!(grid.members_around(6800.0, 1e9), 0..11);
        assert_eq!(grid.members_around(6850.0, 60.0), 4..8);
        assert_eq!(grid.members_around(6300.0, 50.0), 0..2);
        assert_eq!(grid.members_around(7300.0, 50.0), 9..11);
    }

    proptest! {
        #[test]
        fn a_line_is_reproduced(a in 6300.0..7300.0_f64, c in prop::array::uniform2(-1.0..1.0_f64), members in 2..40_usize) {
            let grid = Grid::new(6300.0, 7300.0, members);
            let line = |a: f64| c[0] + c[1] * (a - 6800.0) / 500.0;
            let lines: Vec<f64> = grid.shapes_a_per_m().iter().map(|&a| line(a)).collect();
            prop_assert!((grid.linear(&lines, a) - line(a)).abs() < 1e-13);
        }
    }
}
