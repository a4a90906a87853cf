//! L(x) = min { Σ w_j f_j : Σ w_j x_j = x, Σ w_j = 1, w_j ≥ 0 }: the lower convex envelope of points (x_j, f_j), x in m
//! dimensions.
//!
//! The largest convex function with L(x_j) ≤ f_j; the upper (concave) one is −L of −f. A linear program in m + 1 rows:
//! its primal solution says which members x is a mixture of, its dual one is a plane φᵀx + φ₀ with
//!   φᵀx_j + φ₀ ≤ f_j for every j and = L(x) at x,
//! so φ is a slope of the envelope at x: L(z) ≥ L(x) + φᵀ(z − x) on the whole hull, which is all that the law needs.
//! Solved by the revised simplex method with the inverse of the basis at hand (6×6 at most, no allocation). From one
//! tick to the next values and x move little, so the last basis is where it starts if x still lies in it, else a
//! simplex of corners around x is. The most negative reduced cost enters; after a step of length 0 it is Bland's rule
//! (least index in, least index out), until a step has a length: that cannot cycle.
//! Rounding, or an end at the limit of steps, could leave a plane that is above some point: it is lowered until it is
//! below all of them, so the answer always supports the points, and is the envelope but for what it was lowered.
//! x without unit, f and φ in the unit of f. Source: Dantzig, Linear Programming and Extensions (1963); Bland (1977).

use super::members::{CORNERS, Members, Window};
use super::output::COUNT;

/// More steps than this are not taken; some 5 to 15 are from a cold start.
const MOST_STEPS: u32 = 200;
/// Weights and steps below this are rounding: coordinates are of the order of 1.
const LEAST_WEIGHT: f64 = 1e-11;
/// Smaller pivots would spoil the inverse.
const LEAST_PIVOT: f64 = 1e-9;
/// Reduced costs above minus this share of the largest value are rounding.
const LEAST_GAIN: f64 = 1e-14;

/// Which envelope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Side {
    /// Convex, below the points.
    Lower,
    /// Concave, above them.
    Upper,
}

/// The envelope at one x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EnvelopePoint {
    pub value: f64,
    /// φ, of which the first m entries are used.
    pub slope: [f64; COUNT],
    /// How often the basis was changed.
    pub steps: u32,
}

/// One envelope with the basis of its last answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Envelope {
    /// +1 for the lower one, −1 for the upper one.
    sign: f64,
    warm: bool,
    members: [usize; CORNERS],
}

/// A basis with its inverse and the weights of x in it.
struct Basis {
    size: usize,
    members: [usize; CORNERS],
    inverse: [[f64; CORNERS]; CORNERS],
    weights: [f64; CORNERS],
}

impl Envelope {
    pub fn new(side: Side) -> Self {
        Self {
            sign: if side == Side::Lower { 1.0 } else { -1.0 },
            warm: false,
            members: [0; CORNERS],
        }
    }

    /// The envelope at x of the members `seen`, which are those of `window`; x in the window.
    pub fn at(
        &mut self,
        members: &Members,
        seen: &[usize],
        window: &Window,
        values: &[f64],
        x: &[f64; COUNT],
    ) -> EnvelopePoint {
        let size = members.axes() + 1;
        let inside = self.warm
            && self.members[..size]
                .iter()
                .all(|member| seen.binary_search(member).is_ok());
        let last = if inside {
            Basis::around(members, self.members, x)
        } else {
            None
        };
        let cold = || Basis::around(members, members.simplex(x, window).members, x);
        let Some(mut basis) = last.or_else(cold) else {
            // Cannot happen with a window of positive width: a flat plane below all points still supports them.
            let lowest = seen
                .iter()
                .fold(f64::INFINITY, |low, &member| low.min(self.sign * values[member]));
            return EnvelopePoint {
                value: self.sign * lowest,
                slope: [0.0; COUNT],
                steps: 0,
            };
        };
        let scale = seen
            .iter()
            .fold(0.0_f64, |most, &member| most.max(values[member].abs()));
        let (mut bland, mut steps) = (false, 0);
        let (plane, lowering) = loop {
            let plane = basis.plane(values, self.sign);
            let (entering, cost) = self.entering(members, seen, values, &plane, bland, LEAST_GAIN * scale);
            let Some(entering) = entering.filter(|_| steps < MOST_STEPS) else {
                break (plane, cost.min(0.0));
            };
            let Some(length) = basis.exchange(members, entering) else {
                break (plane, cost.min(0.0));
            };
            bland = length <= LEAST_WEIGHT;
            steps += 1;
        };
        self.members = basis.members;
        self.warm = true;
        let axes = members.axes();
        let mut value = plane[axes] + lowering;
        let mut slope = [0.0; COUNT];
        for axis in 0..axes {
            value += plane[axis] * x[axis];
            slope[axis] = self.sign * plane[axis];
        }
        EnvelopePoint {
            value: self.sign * value,
            slope,
            steps,
        }
    }

    /// The member that enters the basis, if any, and the least reduced cost of all.
    fn entering(
        &self,
        members: &Members,
        seen: &[usize],
        values: &[f64],
        plane: &[f64; CORNERS],
        bland: bool,
        tolerance: f64,
    ) -> (Option<usize>, f64) {
        let (axes, points) = (members.axes(), members.points());
        let (mut least, mut entering, mut first) = (0.0, None, None);
        for &member in seen {
            let mut cost = self.sign * values[member] - plane[axes];
            for (slope, coordinate) in plane[..axes].iter().zip(&points[member]) {
                cost -= slope * coordinate;
            }
            if cost < least {
                least = cost;
                if cost < -tolerance {
                    entering = Some(member);
                }
            }
            if cost < -tolerance && first.is_none() {
                first = Some(member);
            }
        }
        (if bland { first } else { entering }, least)
    }
}

impl Basis {
    /// The basis of these members, if they span and hold x.
    fn around(members: &Members, chosen: [usize; CORNERS], x: &[f64; COUNT]) -> Option<Self> {
        let size = members.axes() + 1;
        let mut matrix = [[0.0; CORNERS]; CORNERS];
        for (column, &member) in chosen[..size].iter().enumerate() {
            for (row, coordinate) in members.points()[member][..size - 1].iter().enumerate() {
                matrix[row][column] = *coordinate;
            }
            matrix[size - 1][column] = 1.0;
        }
        let inverse = inverse(matrix, size)?;
        let mut weights = [0.0; CORNERS];
        for (weight, row) in weights[..size].iter_mut().zip(&inverse) {
            *weight = row[size - 1];
            for (entry, coordinate) in row[..size - 1].iter().zip(x) {
                *weight += entry * coordinate;
            }
            if *weight < -LEAST_WEIGHT {
                return None;
            }
        }
        Some(Self {
            size,
            members: chosen,
            inverse,
            weights,
        })
    }

    /// φ and, after it, φ₀ of the plane through the basis' points, with the values times `sign`.
    fn plane(&self, values: &[f64], sign: f64) -> [f64; CORNERS] {
        let mut plane = [0.0; CORNERS];
        for (&member, row) in self.members[..self.size].iter().zip(&self.inverse) {
            for (entry, inverse) in plane[..self.size].iter_mut().zip(row) {
                *entry += sign * values[member] * inverse;
            }
        }
        plane
    }

    /// Brings a member in; the length of the step, or nothing where no member leaves (x is then no mixture at all:
    /// rounding).
    fn exchange(&mut self, members: &Members, entering: usize) -> Option<f64> {
        let size = self.size;
        let point = &members.points()[entering];
        let mut column = [0.0; CORNERS];
        for (entry, row) in column[..size].iter_mut().zip(&self.inverse) {
            *entry = row[size - 1];
            for (inverse, coordinate) in row[..size - 1].iter().zip(point) {
                *entry += inverse * coordinate;
            }
        }
        let mut leaving: Option<(usize, f64)> = None;
        for (row, (weight, fall)) in self.weights[..size].iter().zip(&column).enumerate() {
            if *fall <= LEAST_PIVOT {
                continue;
            }
            let length = weight.max(0.0) / fall;
            let sooner = leaving.is_none_or(|(other, shortest)| {
                // Equal lengths: the least index leaves, as Bland's rule asks.
                length < shortest || (length == shortest && self.members[row] < self.members[other])
            });
            if sooner {
                leaving = Some((row, length));
            }
        }
        let (leaving, length) = leaving?;
        let pivot = self.inverse[leaving].map(|entry| entry / column[leaving]);
        for (row, fall) in column[..size].iter().enumerate().filter(|(row, _)| *row != leaving) {
            self.weights[row] = (self.weights[row] - length * fall).max(0.0);
            for (entry, pivot) in self.inverse[row].iter_mut().zip(&pivot) {
                *entry -= fall * pivot;
            }
        }
        self.inverse[leaving] = pivot;
        self.weights[leaving] = length;
        self.members[leaving] = entering;
        Some(length)
    }
}

/// The inverse of the first `size` rows and columns by Gauss and Jordan with row pivots; none where there is none.
fn inverse(mut matrix: [[f64; CORNERS]; CORNERS], size: usize) -> Option<[[f64; CORNERS]; CORNERS]> {
    let mut inverse = [[0.0; CORNERS]; CORNERS];
    for (index, row) in inverse.iter_mut().enumerate() {
        row[index] = 1.0;
    }
    for column in 0..size {
        let mut largest = column;
        for row in column + 1..size {
            if matrix[row][column].abs() > matrix[largest][column].abs() {
                largest = row;
            }
        }
        let pivot = matrix[largest][column];
        if pivot.abs() < LEAST_PIVOT {
            return None;
        }
        matrix.swap(column, largest);
        inverse.swap(column, largest);
        for entry in 0..size {
            matrix[column][entry] /= pivot;
            inverse[column][entry] /= pivot;
        }
        for row in (0..size).filter(|row| *row != column) {
            let factor = matrix[row][column];
            for entry in 0..size {
                matrix[row][entry] -= factor * matrix[column][entry];
                inverse[row][entry] -= factor * inverse[column][entry];
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
#[path = "envelope_tests.rs"]
mod tests;
