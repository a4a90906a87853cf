//! Convex cover L and concave cover U of f on Θ: the lower and the upper convex hull of the bank's points (θ_j, f_j).
//!
//! L is the largest convex function with L ≤ f, U the smallest concave one with U ≥ f; f is piecewise linear between
//! its points, so hulls of the points are the covers of the function. φ at θ̂ is the slope of the cover there: at a
//! knot that of the chord to its right, at the upper edge of Θ that of the last chord; both satisfy
//! L(θ) ≥ L(θ̂) + φ(θ − θ̂) on Θ, which is all that the laws need.
//! θ shape parameter (A/m), f predicted output (m), φ (m per A/m).
//! Source: the paper's (16)-(17); built in O(N) by Andrew's monotone chain, since the points are sorted by θ already:
//! every point is put in once and taken out at most once. On a uniform grid and where f bends one way the covers at θ̂
//! need no hull ([`Covers::around`]).

use crate::Grid;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// One cover at one θ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct CoverPoint {
    /// The cover's value, in the unit of f.
    pub value: f64,
    /// A slope of the cover, in the unit of f per A/m.
    pub slope: f64,
}

/// Both covers of one set of points. The buffers have the bank's size: updating them does not allocate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Covers {
    lower: Hull,
    upper: Hull,
}

impl Covers {
    /// Room for `members` points.
    pub fn with_members(members: usize) -> Self {
        Self {
            lower: Hull::with_members(members, 1.0),
            upper: Hull::with_members(members, -1.0),
        }
    }

    /// Builds the covers of the points (`thetas` strictly ascending, `values` one each).
    pub fn update(&mut self, thetas: &[f64], values: &[f64]) {
        self.lower.update(thetas, values);
        self.upper.update(thetas, values);
    }

    /// The convex and the concave cover at `theta` of the `seen` members' values on a grid; the same bits as
    /// [`Self::update`] and a look at both hulls.
    ///
    /// Where all second differences have one sign, and on a smooth f they have, no hull is needed: one cover is f
    /// itself, the other the chord from end to end. Signs count only beyond [`CERTAIN`], so that rounding cannot decide
    /// otherwise in the hulls.
    #[inline]
    pub fn around(&mut self, grid: &Grid, seen: Range<usize>, values: &[f64], theta: f64) -> (CoverPoint, CoverPoint) {
        let thetas = &grid.shapes_a_per_m()[seen.clone()];
        let values = &values[seen.clone()];
        let bend = bend(values);
        if bend == Bend::Unknown {
            self.update(thetas, values);
            return (
                self.lower_at(thetas, values, theta),
                self.upper_at(thetas, values, theta),
            );
        }
        let left = left_of(thetas, grid.gap(theta).saturating_sub(seen.start), theta);
        let own = chord(thetas, values, (left, left + 1), theta);
        let whole = chord(thetas, values, (0, thetas.len() - 1), theta);
        if bend == Bend::Convex {
            (own, whole)
        } else {
            (whole, own)
        }
    }

    /// The convex cover at `theta`, for the points of the last update.
    pub fn lower_at(&self, thetas: &[f64], values: &[f64], theta: f64) -> CoverPoint {
        self.lower.at(thetas, values, theta)
    }

    /// The concave cover at `theta`, for the points of the last update.
    pub fn upper_at(&self, thetas: &[f64], values: &[f64], theta: f64) -> CoverPoint {
        self.upper.at(thetas, values, theta)
    }
}

/// One hull: indices of its corners, ascending.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Hull {
    corners: Vec<usize>,
    count: usize,
    /// +1: lower hull; −1: upper hull.
    side: f64,
}

impl Hull {
    fn with_members(members: usize, side: f64) -> Self {
        Self {
            corners: vec![0; members.max(1)],
            count: 0,
            side,
        }
    }

    /// How many times three points were compared: once for each that stays out and each that is taken out, so at most
    /// 2N − 3 times.
    fn update(&mut self, thetas: &[f64], values: &[f64]) -> usize {
        self.count = 0;
        let mut comparisons = 0;
        for new in 0..thetas.len().min(values.len()).min(self.corners.len()) {
            while self.count >= 2 {
                comparisons += 1;
                let (before, last) = (self.corners[self.count - 2], self.corners[self.count - 1]);
                let rise_last = (values[last] - values[before]) * (thetas[new] - thetas[before]);
                let rise_new = (values[new] - values[before]) * (thetas[last] - thetas[before]);
                // The last corner stays only strictly below the new chord: three points on a line leave two corners.
                if (rise_last - rise_new) * self.side < 0.0 {
                    break;
                }
                self.count -= 1;
            }
            self.corners[self.count] = new;
            self.count += 1;
        }
        comparisons
    }

    fn at(&self, thetas: &[f64], values: &[f64], theta: f64) -> CoverPoint {
        let corners = &self.corners[..self.count];
        let right = corners.partition_point(|&corner| thetas[corner] <= theta);
        let (from, to) = match corners {
            [] => return CoverPoint::default(),
            [only] => {
                return CoverPoint {
                    value: values[*only],
                    slope: 0.0,
                };
            }
            _ => {
                let right = right.clamp(1, corners.len() - 1);
                (corners[right - 1], corners[right])
            }
        };
        chord(thetas, values, (from, to), theta)
    }
}

/// The line through two points, at `theta`.
fn chord(thetas: &[f64], values: &[f64], (from, to): (usize, usize), theta: f64) -> CoverPoint {
    let slope = (values[to] - values[from]) / (thetas[to] - thetas[from]);
    CoverPoint {
        value: values[from] + slope * (theta - thetas[from]),
        slope,
    }
}

/// Second differences below this share of the values are left to the hulls. Rounding, of values and of the grid,
/// reaches some 1e-13.
const CERTAIN: f64 = 1e-11;

/// What the second differences of equidistant values say.
#[derive(Clone, Copy, PartialEq)]
enum Bend {
    Convex,
    Concave,
    Unknown,
}

/// One point is left to the hulls, and so is anything that is not a number.
fn bend(values: &[f64]) -> Bend {
    let &[first, second, ..] = values else {
        return Bend::Unknown;
    };
    // Differences that only rise or only fall are largest at an end, and so are the values of f up to their number.
    let last = values[values.len() - 1] - values[values.len() - 2];
    let size = first.abs() + values.len() as f64 * (second - first).abs().max(last.abs());
    let margin = CERTAIN * size;
    let difference = |triple: &[f64]| (triple[2] - triple[1]) - (triple[1] - triple[0]);
    let triples = values.windows(3);
    // Two points are a chord, which is either.
    if triples.clone().next().is_none_or(|first| difference(first) > 0.0) {
        let convex = triples.fold(true, |all, triple| all & (difference(triple) > margin));
        if convex { Bend::Convex } else { Bend::Unknown }
    } else {
        let concave = triples.fold(true, |all, triple| all & (difference(triple) < -margin));
        if concave { Bend::Concave } else { Bend::Unknown }
    }
}

/// The gap whose left end is the last at or before `theta`, from a guess that rounding may have put one off.
fn left_of(thetas: &[f64], guess: usize, theta: f64) -> usize {
    let last = thetas.len() - 2;
    let mut left = guess.min(last);
    while left > 0 && theta < thetas[left] {
        left -= 1;
    }
    while left < last && theta >= thetas[left + 1] {
        left += 1;
    }
    left
}

#[cfg(test)]
#[path = "covers_tests.rs"]
mod tests;
