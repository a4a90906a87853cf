//! Convex cover L and concave cover U of f on Θ: the lower and the upper convex hull of the bank's points (θ_j, f_j).
//!
//! L is the largest convex function with L ≤ f, U the smallest concave one with U ≥ f; f is piecewise linear between its
//! points, so hulls of the points are the covers of the function. φ at θ̂ is the slope of the cover there: at a knot that
//! of the chord to its right, at the upper edge of Θ that of the last chord; both satisfy L(θ) ≥ L(θ̂) + φ(θ − θ̂) on Θ,
//! which is all that the laws need.
//! θ shape parameter (A/m), f predicted output (m), φ (m per A/m).
//! Source: the paper's (16)-(17); built in O(N) by Andrew's monotone chain, since the points are sorted by θ already.

use serde::{Deserialize, Serialize};

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

    /// The convex and the concave cover of the points at `theta`.
    pub fn around(&mut self, thetas: &[f64], values: &[f64], theta: f64) -> (CoverPoint, CoverPoint) {
        self.update(thetas, values);
        (
            self.lower_at(thetas, values, theta),
            self.upper_at(thetas, values, theta),
        )
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

    fn update(&mut self, thetas: &[f64], values: &[f64]) {
        self.count = 0;
        for new in 0..thetas.len().min(values.len()).min(self.corners.len()) {
            while self.count >= 2 {
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
        let slope = (values[to] - values[from]) / (thetas[to] - thetas[from]);
        CoverPoint {
            value: values[from] + slope * (theta - thetas[from]),
            slope,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn thetas(members: usize) -> Vec<f64> {
        (0..members)
            .map(|j| 6300.0 + 1000.0 * j as f64 / (members - 1) as f64)
            .collect()
    }

    fn built(thetas: &[f64], values: &[f64]) -> Covers {
        let mut covers = Covers::with_members(thetas.len());
        covers.update(thetas, values);
        covers
    }

    /// The largest convex function below the points: the least chord over all pairs around θ.
    fn least_chord(thetas: &[f64], values: &[f64], theta: f64) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..thetas.len() {
            for j in i..thetas.len() {
                if thetas[i] <= theta && theta <= thetas[j] {
                    let part = if i == j {
                        0.0
                    } else {
                        (theta - thetas[i]) / (thetas[j] - thetas[i])
                    };
                    least = least.min(values[i] + part * (values[j] - values[i]));
                }
            }
        }
        least
    }

    proptest! {
        // Guards the definition: the hull is the brute-force minimum over all chords, above and below alike.
        #[test]
        fn covers_equal_all_chords(values in prop::collection::vec(-1.0..1.0_f64, 2..40), part in 0.0..=1.0_f64) {
            let thetas = thetas(values.len());
            let covers = built(&thetas, &values);
            let negative: Vec<f64> = values.iter().map(|v| -v).collect();
            for theta in thetas.iter().copied().chain([6300.0 + 1000.0 * part]) {
                let lower = covers.lower_at(&thetas, &values, theta).value;
                let upper = covers.upper_at(&thetas, &values, theta).value;
                prop_assert!((lower - least_chord(&thetas, &values, theta)).abs() < 1e-12);
                prop_assert!((upper + least_chord(&thetas, &negative, theta)).abs() < 1e-12);
            }
        }

        // Guards what the proof of the law uses: L ≤ f ≤ U everywhere, and φ supports its cover from θ̂ on all of Θ.
        #[test]
        fn slopes_support_their_covers(values in prop::collection::vec(-1.0..1.0_f64, 2..40), part in 0.0..=1.0_f64) {
            let thetas = thetas(values.len());
            let covers = built(&thetas, &values);
            for at in thetas.iter().copied().chain([6300.0 + 1000.0 * part]) {
                let lower = covers.lower_at(&thetas, &values, at);
                let upper = covers.upper_at(&thetas, &values, at);
                for (&theta, &value) in thetas.iter().zip(&values) {
                    prop_assert!(lower.value + lower.slope * (theta - at) <= value + 1e-12);
                    prop_assert!(upper.value + upper.slope * (theta - at) >= value - 1e-12);
                }
            }
        }

        // Guards convexity: slopes of the lower cover never fall, those of the upper never rise.
        #[test]
        fn slopes_are_monotone(values in prop::collection::vec(-1.0..1.0_f64, 2..40)) {
            let thetas = thetas(values.len());
            let covers = built(&thetas, &values);
            for pair in thetas.windows(2) {
                let lower = [0, 1].map(|i| covers.lower_at(&thetas, &values, pair[i]).slope);
                let upper = [0, 1].map(|i| covers.upper_at(&thetas, &values, pair[i]).slope);
                prop_assert!(lower[1] >= lower[0] - 1e-15 && upper[1] <= upper[0] + 1e-15);
            }
        }

        // Guards tightness: a cover touches the points at its corners, bit for bit.
        #[test]
        fn corners_touch_the_points(values in prop::collection::vec(-1.0..1.0_f64, 2..40)) {
            let thetas = thetas(values.len());
            let covers = built(&thetas, &values);
            let last = values.len() - 1;
            for &corner in covers.lower.corners[..covers.lower.count].iter().filter(|&&corner| corner < last) {
                prop_assert_eq!(covers.lower_at(&thetas, &values, thetas[corner]).value, values[corner]);
            }
            prop_assert_eq!(covers.lower.corners[0], 0);
            prop_assert_eq!(covers.lower.corners[covers.lower.count - 1], last);
        }
    }

    // Guards the special cases by hand: a straight line, a knot, both edges, one point.
    #[test]
    fn lines_knots_and_edges() {
        let thetas = [0.0, 1.0, 2.0, 3.0, 4.0];
        let line = [1.0, 3.0, 5.0, 7.0, 9.0];
        let covers = built(&thetas, &line);
        assert_eq!((covers.lower.count, covers.upper.count), (2, 2));
        for theta in [0.0, 0.3, 2.0, 4.0] {
            let both = [
                covers.lower_at(&thetas, &line, theta),
                covers.upper_at(&thetas, &line, theta),
            ];
            assert!(
                both.iter()
                    .all(|c| c.slope == 2.0 && (c.value - (1.0 + 2.0 * theta)).abs() < 1e-15)
            );
        }
        let valley = [2.0, 1.0, 0.0, 1.0, 2.0];
        let covers = built(&thetas, &valley);
        assert_eq!(
            covers.lower_at(&thetas, &valley, 2.0),
            CoverPoint { value: 0.0, slope: 1.0 }
        );
        assert_eq!(
            covers.lower_at(&thetas, &valley, 0.0),
            CoverPoint {
                value: 2.0,
                slope: -1.0
            }
        );
        assert_eq!(
            covers.lower_at(&thetas, &valley, 4.0),
            CoverPoint { value: 2.0, slope: 1.0 }
        );
        assert_eq!(
            covers.upper_at(&thetas, &valley, 2.0),
            CoverPoint { value: 2.0, slope: 0.0 }
        );
        let one = built(&[5.0], &[7.0]);
        assert_eq!(one.upper_at(&[5.0], &[7.0], 5.0), CoverPoint { value: 7.0, slope: 0.0 });
    }
}
