//! Y(θ) between the members with a continuous derivative: cubic Hermite pieces with slopes from five members.
//!
//! On the gap [θ_j, θ_j+1] of width h, with s = (θ − θ_j)/h and nodal slopes m_j (per h):
//! Y = y_j + s(m_j + s(3d − 2m_j − m_j+1 + s(m_j + m_j+1 − 2d))),  d = y_j+1 − y_j.
//! The nodal slopes are the derivatives of the polynomial through the five nearest members, exact for a quartic; with
//! fewer than five members they are divided differences. Value and slope are continuous in θ, the curvature jumps at the members.
//! θ shape parameter (A/m), Y in the unit of the values. Lagrange pieces would be as accurate, but their slope
//! jumps at every member, and a law that steps along the slope would see those jumps as noise.

use crate::Grid;

/// The weights of five equidistant values in the derivative at the first, second, … of them.
const WEIGHTS: [[f64; 5]; 5] = [
    twelfths([-25.0, 48.0, -36.0, 16.0, -3.0]),
    twelfths([-3.0, -10.0, 18.0, -6.0, 1.0]),
    twelfths([1.0, -8.0, 0.0, 8.0, -1.0]),
    twelfths([-1.0, 6.0, -18.0, 10.0, 3.0]),
    twelfths([3.0, -16.0, 36.0, -48.0, 25.0]),
];

const fn twelfths([a, b, c, d, e]: [f64; 5]) -> [f64; 5] {
    [a / 12.0, b / 12.0, c / 12.0, d / 12.0, e / 12.0]
}

/// A function of the shape parameter at one shape, in the unit of its values and A/m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SmoothPoint {
    /// Y.
    pub value: f64,
    /// dY/dθ.
    pub slope: f64,
    /// d²Y/dθ².
    pub curvature: f64,
}

/// Change of Y per gap at member `j`.
fn nodal_slope(values: &[f64], j: usize) -> f64 {
    let last = values.len() - 1;
    if values.len() < 5 {
        let (from, to) = (j.saturating_sub(1), (j + 1).min(last));
        return (values[to] - values[from]) / (to - from) as f64;
    }
    let first = j.saturating_sub(2).min(last - 4);
    let products = WEIGHTS[j - first]
        .iter()
        .zip(&values[first..first + 5])
        .map(|(weight, value)| weight * value);
    products.sum::<f64>()
}

impl Grid {
    /// Value, slope and curvature of the smooth function through `values`, one per member. One member: a constant.
    pub fn smooth(&self, values: &[f64], shape_a_per_m: f64) -> SmoothPoint {
        if let [value] = *values {
            return SmoothPoint {
                value,
                ..SmoothPoint::default()
            };
        }
        let j = self.gap(shape_a_per_m);
        // Per width and not over it: the laws wait for s and for the slope, and a division takes as long as four
        // products.
        let per_width = self.members_per_a_per_m();
        let s = (shape_a_per_m - self.shapes_a_per_m()[j]) * per_width;
        let (from, to) = (nodal_slope(values, j), nodal_slope(values, j + 1));
        let rise = values[j + 1] - values[j];
        let (square, cube) = (3.0 * rise - 2.0 * from - to, from + to - 2.0 * rise);
        SmoothPoint {
            value: values[j] + s * (from + s * (square + s * cube)),
            slope: (from + s * (2.0 * square + 3.0 * s * cube)) * per_width,
            curvature: (2.0 * square + 6.0 * s * cube) * (per_width * per_width),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sampled(grid: &Grid, function: impl Fn(f64) -> f64) -> Vec<f64> {
        grid.shapes_a_per_m().iter().map(|&a| function(a)).collect()
    }

    proptest! {
        // Guards the weights: a cubic, its slope and its curvature come back, at the edges too.
        #[test]
        fn cubics_are_reproduced(a in 6300.0..=7300.0_f64, c in prop::array::uniform4(-1.0..1.0_f64), members in 5..40_usize) {
            let grid = Grid::new(6300.0, 7300.0, members);
            let x = |a: f64| (a - 6800.0) / 500.0;
            let values = sampled(&grid, |a| c[0] + x(a) * (c[1] + x(a) * (c[2] + x(a) * c[3])));
            let found = grid.smooth(&values, a);
            let slope = c[1] + x(a) * (2.0 * c[2] + 3.0 * x(a) * c[3]);
            prop_assert!((found.value - (c[0] + x(a) * (c[1] + x(a) * (c[2] + x(a) * c[3])))).abs() < 1e-12);
            prop_assert!((found.slope * 500.0 - slope).abs() < 1e-10);
            prop_assert!((found.curvature * 250_000.0 - (2.0 * c[2] + 6.0 * x(a) * c[3])).abs() < 1e-8);
        }

        // Guards continuity, for any values: value and slope agree from both sides of a member.
        #[test]
        fn the_slope_is_continuous(values in prop::collection::vec(-1.0..1.0_f64, 2..12), part in 0.0..1.0_f64) {
            let grid = Grid::new(6300.0, 7300.0, values.len());
            let member = grid.shapes_a_per_m()[(part * values.len() as f64) as usize];
            let [below, above] = [member - 1e-6, member + 1e-6].map(|a| grid.smooth(&values, grid.project(a)));
            prop_assert!((below.value - above.value).abs() < 1e-6);
            prop_assert!((below.slope - above.slope).abs() < 1e-6);
        }
    }

    #[test]
    fn few_members_are_enough() {
        let one = Grid::new(7012.0, 7012.0, 1).smooth(&[5.0], 7012.0);
        assert_eq!((one.value, one.slope, one.curvature), (5.0, 0.0, 0.0));
        let line = Grid::new(6300.0, 7300.0, 2).smooth(&[1.0, 3.0], 6550.0);
        assert_eq!((line.value, line.slope, line.curvature), (1.5, 0.002, 0.0));
    }
}
