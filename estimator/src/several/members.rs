//! The points x_j of a bank over a box of m parameters, and what can be said between them.
//!
//! x_i = (θ_i − middle_i)/half_i ∈ [−1, 1].
//! m ≤ 3: full factorial of n ≥ 3 equidistant levels on each axis, n^m points; spacing h = 2/(n − 1).
//! m = 4, 5: the 2^m corners, the centre and the 2m centres of faces (25 and 43 points, where 3^m would be
//! 81 and 243); h = 2.
//!
//! **Between the points** linear interpolation in the simplices of Kuhn (in a cell: corners from low to high, axis
//! after axis in the order of how far x has gone along them) misses a function f with second derivatives f_ik by
//! at most
//!   δ = ⅛ Σ_i Σ_k max|f_ik| h_i h_k,
//! because its error is ½ Σ w_v (v − x)ᵀH(v − x), and the corners v of a cell weighted with w have covariances of at
//! most h_i h_k/4. The products f_ik h_i h_k are second differences of the members' values, so δ is measured, not
//! known: it holds where the second derivatives between members are not larger than at them.
//! Source of the triangulation: Kuhn, Some combinatorial lemmas in topology, IBM J. Res. Dev. 4 (1960).

use super::output::COUNT;

/// A simplex in m dimensions has at most this many corners.
pub(super) const CORNERS: usize = COUNT + 1;

/// First and last level of each axis.
pub(super) type Window = [(usize, usize); COUNT];

/// A simplex of members around a point, with the point's weights in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Simplex {
    pub members: [usize; CORNERS],
    pub weights: [f64; CORNERS],
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Design {
    Factorial,
    CornersAndFaces,
}

/// The members' places in the box.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Members {
    axes: usize,
    /// Levels that corners are counted in: n, or 2 where there are only corners and faces.
    levels: usize,
    design: Design,
    /// From a member to its neighbour on an axis.
    strides: [usize; COUNT],
    points: Vec<[f64; COUNT]>,
    /// A factorial's members by their levels.
    places: Vec<[usize; COUNT]>,
}

impl Members {
    /// The points for `axes` parameters; `levels` counts where there are at most three.
    pub fn new(axes: usize, levels: usize) -> Self {
        let (design, levels) = if axes <= 3 {
            (Design::Factorial, levels)
        } else {
            (Design::CornersAndFaces, 2)
        };
        let mut strides = [1; COUNT];
        for axis in 1..axes {
            strides[axis] = strides[axis - 1] * levels;
        }
        let place = |member: usize| -> [usize; COUNT] {
            std::array::from_fn(|axis| {
                if axis < axes {
                    member / strides[axis] % levels
                } else {
                    0
                }
            })
        };
        let places: Vec<[usize; COUNT]> = (0..levels.pow(axes as u32)).map(place).collect();
        let mut members = Self {
            axes,
            levels,
            design,
            strides,
            points: Vec::new(),
            places,
        };
        members.points = members.places.iter().map(|place| members.point(place)).collect();
        if design == Design::CornersAndFaces {
            members.points.push([0.0; COUNT]);
            for axis in 0..axes {
                for side in [-1.0, 1.0] {
                    let mut face = [0.0; COUNT];
                    face[axis] = side;
                    members.points.push(face);
                }
            }
        }
        members
    }

    pub fn axes(&self) -> usize {
        self.axes
    }

    pub fn points(&self) -> &[[f64; COUNT]] {
        &self.points
    }

    fn coordinate(&self, level: usize) -> f64 {
        -1.0 + 2.0 * level as f64 / (self.levels - 1) as f64
    }

    fn point(&self, place: &[usize; COUNT]) -> [f64; COUNT] {
        std::array::from_fn(|axis| {
            if axis < self.axes {
                self.coordinate(place[axis])
            } else {
                0.0
            }
        })
    }

    /// The levels that enclose everything within `reach` of x on each axis, as far as the box goes; all of them where
    /// there is no reach.
    pub fn window(&self, x: &[f64; COUNT], reach: &[Option<f64>; COUNT]) -> Window {
        let last = self.levels - 1;
        let mut window = [(0, last); COUNT];
        for ((levels, x), reach) in window[..self.axes].iter_mut().zip(x).zip(reach) {
            if let Some(reach) = reach {
                *levels = (self.gap(x - reach), (self.gap(x + reach) + 1).min(last));
            }
        }
        window
    }

    /// The level below a coordinate, within the box and below its last one.
    fn gap(&self, coordinate: f64) -> usize {
        let level = 0.5 * (coordinate + 1.0) * (self.levels - 1) as f64;
        // The cast takes a negative or missing number to 0.
        (level as usize).min(self.levels - 2)
    }

    /// The members in a window, in ascending order.
    pub fn seen(&self, window: &Window, seen: &mut Vec<usize>) {
        seen.clear();
        if self.design == Design::CornersAndFaces {
            seen.extend(0..self.points.len());
            return;
        }
        seen.extend((0..self.places.len()).filter(|&member| {
            let levels = self.places[member][..self.axes].iter().zip(window);
            levels
                .into_iter()
                .all(|(level, (from, to))| from <= level && level <= to)
        }));
    }

    /// The simplex of the window's corners that holds x (or its nearest point in the window).
    pub fn simplex(&self, x: &[f64; COUNT], window: &Window) -> Simplex {
        let mut parts = [0.0; COUNT];
        let mut steps = [0; COUNT];
        let mut member = 0;
        for axis in 0..self.axes {
            let (from, to) = window[axis];
            let (low, high) = (self.coordinate(from), self.coordinate(to));
            parts[axis] = ((x[axis] - low) / (high - low)).clamp(0.0, 1.0);
            member += from * self.strides[axis];
            steps[axis] = (to - from) * self.strides[axis];
        }
        let mut order = [0, 1, 2, 3, 4];
        order[..self.axes].sort_unstable_by(|&one, &other| parts[other].total_cmp(&parts[one]).then(one.cmp(&other)));
        let mut simplex = Simplex {
            members: [member; CORNERS],
            weights: [0.0; CORNERS],
        };
        let mut above = 1.0;
        for (corner, &axis) in order[..self.axes].iter().enumerate() {
            simplex.weights[corner] = above - parts[axis];
            above = parts[axis];
            member += steps[axis];
            simplex.members[corner + 1] = member;
        }
        simplex.weights[self.axes] = above;
        simplex
    }

    /// Linear interpolation of the members' values in the cell of x.
    pub fn interpolate(&self, values: &[f64], x: &[f64; COUNT]) -> f64 {
        let cell = self.window(x, &[Some(0.0); COUNT]);
        let simplex = self.simplex(x, &cell);
        let corners = simplex.members.iter().zip(simplex.weights).take(self.axes + 1);
        corners.map(|(&member, weight)| weight * values[member]).sum()
    }

    /// δ of the file's head for the cells of a window, whose members are `seen`.
    pub fn interpolation_error(&self, values: &[f64], seen: &[usize], window: &Window) -> f64 {
        let mut sum = 0.0;
        for axis in 0..self.axes {
            sum += match self.design {
                Design::Factorial => self.bend_of_levels(values, seen, axis),
                Design::CornersAndFaces => self.bend_of_faces(values, axis),
            };
            for other in axis + 1..self.axes {
                sum += 2.0 * self.twist(values, seen, window, axis, other);
            }
        }
        0.125 * sum
    }

    /// Largest |f_ii| h_i² at the seen members; at an edge of the box the nearest inner member stands in.
    fn bend_of_levels(&self, values: &[f64], seen: &[usize], axis: usize) -> f64 {
        let stride = self.strides[axis];
        let bends = seen.iter().map(|&member| {
            let level = self.places[member][axis];
            let middle = member - level * stride + level.clamp(1, self.levels - 2) * stride;
            (values[middle + stride] - 2.0 * values[middle] + values[middle - stride]).abs()
        });
        bends.fold(0.0, f64::max)
    }

    /// |f_ii| h_i², four times the second difference: the cell is twice as wide as the step from the centre to a face.
    fn bend_of_faces(&self, values: &[f64], axis: usize) -> f64 {
        let centre = self.places.len();
        let face = centre + 1 + 2 * axis;
        4.0 * (values[face] - 2.0 * values[centre] + values[face + 1]).abs()
    }

    /// Largest |f_ik| h_i h_k of the window's cells.
    fn twist(&self, values: &[f64], seen: &[usize], window: &Window, axis: usize, other: usize) -> f64 {
        let (one, two) = (self.strides[axis], self.strides[other]);
        let corners = seen.iter().filter(|&&member| member < self.places.len());
        let lowest = corners.filter(|&&member| {
            let place = &self.places[member];
            place[axis] < window[axis].1 && place[other] < window[other].1
        });
        let twists = lowest.map(|&member| {
            (values[member + one + two] - values[member + one] - values[member + two] + values[member]).abs()
        });
        twists.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WHOLE: [Option<f64>; COUNT] = [None; COUNT];

    /// A quadratic with second derivatives `bend[i][k]` (symmetric part of it).
    fn quadratic(bend: &[[f64; COUNT]; COUNT], axes: usize, x: &[f64; COUNT]) -> f64 {
        let mut sum = 0.3;
        for (i, (one, row)) in x[..axes].iter().zip(bend).enumerate() {
            sum += (i as f64 - 1.5) * one;
            for (other, bend) in x[..axes].iter().zip(row) {
                sum += 0.5 * bend * one * other;
            }
        }
        sum
    }

    fn bound(members: &Members, values: &[f64], window: &Window) -> f64 {
        let mut seen = Vec::new();
        members.seen(window, &mut seen);
        members.interpolation_error(values, &seen, window)
    }

    fn any_point() -> impl Strategy<Value = [f64; COUNT]> {
        prop::array::uniform5(prop_oneof![4 => -1.0..=1.0_f64, 1 => Just(-1.0), 1 => Just(1.0), 1 => Just(0.0)])
    }

    #[test]
    fn as_many_members_as_said() {
        let counts = [1, 2, 3, 4, 5].map(|axes| Members::new(axes, 3).points().len());
        assert_eq!(counts, [3, 9, 27, 25, 43]);
        assert_eq!(Members::new(2, 9).points().len(), 81);
        for axes in 1..=5 {
            let members = Members::new(axes, 3);
            let mut points: Vec<String> = members.points().iter().map(|point| format!("{point:?}")).collect();
            points.sort();
            points.dedup();
            assert_eq!(points.len(), members.points().len());
        }
    }

    proptest! {
        // Guards the simplex: weights of a mixture that gives back the point, in any window.
        #[test]
        fn simplices_hold_their_points(axes in 1..=5_usize, levels in 3..7_usize, x in any_point(), reach in 0.0..2.0_f64) {
            let members = Members::new(axes, levels);
            let reach = if axes <= 3 { [Some(reach); COUNT] } else { WHOLE };
            let window = members.window(&x, &reach);
            let simplex = members.simplex(&x, &window);
            let mut seen = Vec::new();
            members.seen(&window, &mut seen);
            let weights = &simplex.weights[..=axes];
            prop_assert!(weights.iter().all(|weight| *weight >= 0.0));
            prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            for (axis, coordinate) in x[..axes].iter().enumerate() {
                let mixed: f64 = (0..=axes).map(|k| weights[k] * members.points()[simplex.members[k]][axis]).sum();
                prop_assert!((mixed - coordinate).abs() < 1e-12);
            }
            prop_assert!(simplex.members[..=axes].iter().all(|member| seen.contains(member)));
        }

        // Guards δ: of a quadratic, whose second differences are exact, linear interpolation misses no more than that,
        // in any window.
        #[test]
        fn the_interpolation_error_is_bounded(
            axes in 1..=5_usize, levels in 3..7_usize, x in any_point(), reach in 0.0..2.0_f64,
            bend in prop::array::uniform5(prop::array::uniform5(-1.0..1.0_f64)),
        ) {
            let members = Members::new(axes, levels);
            let values: Vec<f64> = members.points().iter().map(|point| quadratic(&bend, axes, point)).collect();
            let reach = if axes <= 3 { [Some(reach); COUNT] } else { WHOLE };
            let bound = bound(&members, &values, &members.window(&x, &reach));
            let missed = (members.interpolate(&values, &x) - quadratic(&bend, axes, &x)).abs();
            prop_assert!(missed <= bound + 1e-12, "{} {}", missed, bound);
        }
    }

    // Guards the bound from being idle: on one axis and in the middle of a cell it is reached.
    #[test]
    fn the_bound_is_reached() {
        let members = Members::new(1, 5);
        let values: Vec<f64> = members.points().iter().map(|point| point[0] * point[0]).collect();
        let x = [0.25, 0.0, 0.0, 0.0, 0.0];
        let bound = bound(&members, &values, &members.window(&x, &WHOLE));
        assert!((members.interpolate(&values, &x) - 0.0625 - bound).abs() < 1e-15 && bound > 0.06);
    }

    // Guards windows by hand.
    #[test]
    fn windows_enclose_what_they_promise() {
        let members = Members::new(2, 5);
        let mut seen = Vec::new();
        let window = members.window(&[0.1, -1.0, 0.0, 0.0, 0.0], &[Some(0.1), Some(0.5), None, None, None]);
        assert_eq!(window[..2], [(2, 3), (0, 2)]);
        members.seen(&window, &mut seen);
        assert_eq!(seen, [2, 3, 7, 8, 12, 13]);
        let edge = members.window(&[1.0, 1.0, 0.0, 0.0, 0.0], &[Some(0.1), None, None, None, None]);
        assert_eq!(edge[..2], [(3, 4), (0, 4)]);
    }
}
