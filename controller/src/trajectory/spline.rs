//! The curve through (tᵢ, xᵢ) that minimises ∫(d³x/dt³)²dt with x' = x'' = 0 at both ends: a quintic between every two
//! points, with x to x⁗ continuous inside and x to x″ at the ends, beyond which it stands still.
//!
//! Unknown are the slopes vᵢ and curvatures aᵢ of the points. With uₗ, uᵣ the steps (s) to the left and right of a point and
//! Δ the differences of x over them, the continuity of jerk and snap is
//!   −24v₋/uₗ² − 3a₋/uₗ + 36v(1/uᵣ² − 1/uₗ²) + 9a(1/uₗ + 1/uᵣ) + 24v₊/uᵣ² − 3a₊/uᵣ = 60Δᵣ/uᵣ³ − 60Δₗ/uₗ³,
//!   168v₋/uₗ³ + 24a₋/uₗ² + 192v(1/uₗ³ + 1/uᵣ³) + 36a(1/uᵣ² − 1/uₗ²) + 168v₊/uᵣ³ − 24a₊/uᵣ² = 360(Δᵣ/uᵣ⁴ + Δₗ/uₗ⁴).
//! They are the gradient of a convex function, so their matrix is symmetric and positive definite, and elimination by blocks
//! of two needs no pivoting. Time is counted in mean steps, so that the entries have comparable size.

use super::jet::Jet;
use serde::{Deserialize, Serialize};

type Pair = [f64; 2];
type Block = [[f64; 2]; 2];

/// The spline: n points, n − 1 quintics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Spline {
    times_s: Vec<f64>,
    /// Coefficients of 1, u, … u⁵ with u from 0 to 1 over the piece.
    pieces: Vec<[f64; 6]>,
}

impl Spline {
    /// Through at least two points with rising times.
    pub fn new(points: &[(f64, f64)]) -> Self {
        let mean_step_s = match (points.first(), points.last()) {
            (Some(first), Some(last)) if points.len() > 1 => (last.0 - first.0) / (points.len() - 1) as f64,
            _ => 1.0,
        };
        let scaled: Vec<_> = points.iter().map(|&(time_s, x)| (time_s / mean_step_s, x)).collect();
        let slopes = slopes_and_curvatures(&scaled);
        let pieces = scaled.windows(2).zip(slopes.windows(2)).map(|(points, slopes)| {
            piece(
                points[1].0 - points[0].0,
                points[1].1 - points[0].1,
                points[0].1,
                slopes[0],
                slopes[1],
            )
        });
        Self {
            pieces: pieces.collect(),
            times_s: points.iter().map(|point| point.0).collect(),
        }
    }

    /// Value and derivatives; beyond the ends it stands still.
    pub fn at(&self, time_s: f64) -> Jet {
        let next = self.times_s.partition_point(|&knot_s| knot_s <= time_s);
        let (Some(first), Some(last)) = (self.pieces.first(), self.pieces.last()) else {
            return Jet::default();
        };
        if next == 0 {
            return Jet::constant(first[0]);
        }
        if next == self.times_s.len() {
            return Jet::constant(last.iter().sum());
        }
        let (from_s, to_s) = (self.times_s[next - 1], self.times_s[next]);
        let u = (time_s - from_s) / (to_s - from_s);
        Jet::from_scaled(derivatives(&self.pieces[next - 1], u), to_s - from_s)
    }

    /// True if every coefficient is finite.
    pub fn is_finite(&self) -> bool {
        self.pieces.iter().flatten().all(|coefficient| coefficient.is_finite())
    }
}

/// The quintic with the given ends; slopes and curvatures per unit of the step's time.
fn piece(step: f64, difference: f64, start: f64, [v0, a0]: Pair, [v1, a1]: Pair) -> [f64; 6] {
    let (v0, v1, a0, a1) = (step * v0, step * v1, step * step * a0, step * step * a1);
    [
        start,
        v0,
        0.5 * a0,
        10.0 * difference - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * difference + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * difference - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1,
    ]
}

/// Value and four derivatives of a quintic by u.
fn derivatives(c: &[f64; 6], u: f64) -> [f64; 5] {
    [
        c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * (c[4] + u * c[5])))),
        c[1] + u * (2.0 * c[2] + u * (3.0 * c[3] + u * (4.0 * c[4] + u * 5.0 * c[5]))),
        2.0 * c[2] + u * (6.0 * c[3] + u * (12.0 * c[4] + u * 20.0 * c[5])),
        6.0 * c[3] + u * (24.0 * c[4] + u * 60.0 * c[5]),
        24.0 * c[4] + u * 120.0 * c[5],
    ]
}

/// Block elimination over the inner points: row i reads Lᵢ·y₋ + Dᵢ·y + Uᵢ·y₊ = bᵢ with y = (v, a), L the transpose of the U before.
fn slopes_and_curvatures(points: &[(f64, f64)]) -> Vec<Pair> {
    let mut solution = vec![[0.0; 2]; points.len()];
    // For every inner point: D⁻¹U and D⁻¹b after elimination of what is to the left.
    let mut eliminated: Vec<(Block, Pair)> = Vec::with_capacity(points.len());
    for window in points.windows(3) {
        let (l, r) = (window[1].0 - window[0].0, window[2].0 - window[1].0);
        let (dl, dr) = (window[1].1 - window[0].1, window[2].1 - window[1].1);
        let (l2, r2) = (l * l, r * r);
        let lower = [[168.0 / (l2 * l), 24.0 / l2], [-24.0 / l2, -3.0 / l]];
        let cross = 36.0 * (1.0 / r2 - 1.0 / l2);
        let mut diagonal = [
            [192.0 * (1.0 / (l2 * l) + 1.0 / (r2 * r)), cross],
            [cross, 9.0 * (1.0 / l + 1.0 / r)],
        ];
        let upper = [[168.0 / (r2 * r), -24.0 / r2], [24.0 / r2, -3.0 / r]];
        let mut right = [
            360.0 * (dr / (r2 * r2) + dl / (l2 * l2)),
            60.0 * (dr / (r2 * r) - dl / (l2 * l)),
        ];
        if let Some((factor, known)) = eliminated.last() {
            let product = multiply(&lower, factor);
            let moved = apply(&lower, known);
            for row in 0..2 {
                right[row] -= moved[row];
                for column in 0..2 {
                    diagonal[row][column] -= product[row][column];
                }
            }
        }
        let inverse = invert(&diagonal);
        eliminated.push((multiply(&inverse, &upper), apply(&inverse, &right)));
    }
    // The last point's slope and curvature are zero, like the first's.
    for (index, (factor, known)) in eliminated.iter().enumerate().rev() {
        let moved = apply(factor, &solution[index + 2]);
        solution[index + 1] = [known[0] - moved[0], known[1] - moved[1]];
    }
    solution
}

fn multiply(a: &Block, b: &Block) -> Block {
    let entry = |row: usize, column: usize| a[row][0] * b[0][column] + a[row][1] * b[1][column];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

fn apply(a: &Block, y: &Pair) -> Pair {
    [a[0][0] * y[0] + a[0][1] * y[1], a[1][0] * y[0] + a[1][1] * y[1]]
}

fn invert(a: &Block) -> Block {
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [
        [a[1][1] / determinant, -a[0][1] / determinant],
        [-a[1][0] / determinant, a[0][0] / determinant],
    ]
}
