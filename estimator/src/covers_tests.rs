//! Guards the covers: the brute-force definition, what the laws' proofs use of them, banks of every size, degenerate
//! functions, and their cost.

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

/// Functions of every kind that a bank has shown or might: smooth ones that bend one way or both ways, straight,
/// constant, with steps and with repeated values, and random ones.
fn any_function(members: usize) -> impl Strategy<Value = Vec<f64>> {
    let at = move |j: usize| j as f64 / (members.max(2) - 1) as f64;
    let smooth = (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64).prop_map(move |(a, b, c, d)| {
        let value = |x: f64| a + x * (b + x * (c + x * d));
        (0..members).map(|j| value(at(j))).collect::<Vec<f64>>()
    });
    let nearly_straight =
        (-1.0..1.0_f64, -1.0..1.0_f64, -18.0..-4.0_f64, any::<bool>()).prop_map(move |(a, b, exponent, concave)| {
            let bend = libm::pow(10.0, exponent) * if concave { -1.0 } else { 1.0 };
            (0..members).map(|j| a + at(j) * (b + bend * at(j))).collect()
        });
    let straight = (-1.0..1.0_f64, -1.0..1.0_f64).prop_map(move |(a, b)| (0..members).map(|j| a + b * at(j)).collect());
    let constant = (-1.0..1.0_f64).prop_map(move |a| vec![a; members]);
    let repeated = prop::collection::vec((-2..=2_i32).prop_map(f64::from), members);
    let random = prop::collection::vec(-1.0..1.0_f64, members);
    prop_oneof![4 => smooth, 2 => nearly_straight, 1 => straight, 1 => constant, 2 => repeated, 2 => random]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    // Guards the short way: whatever f, whatever part of the bank is seen, at any shape and exactly at members and
    // edges, it gives the bits that the hulls give.
    #[test]
    fn the_short_way_gives_the_bits_of_the_hulls(
        (members, values) in prop_oneof![Just(1_usize), Just(2), Just(3), Just(33), Just(512), 4..64_usize]
            .prop_flat_map(|members| (Just(members), any_function(members))),
        (from, to, part) in (0.0..1.0_f64, 0.0..1.0_f64, 0.0..=1.0_f64),
    ) {
        let grid = Grid::new(6300.0, 7300.0, members);
        let ends = [from, to].map(|end| (end * members as f64) as usize);
        let seen = [0..members, ends[0].min(ends[1])..ends[0].max(ends[1]) + 1];
        for seen in seen {
            let (shapes, seen_values) = (&grid.shapes_a_per_m()[seen.clone()], &values[seen.clone()]);
            let (first, last) = (shapes[0], shapes[shapes.len() - 1]);
            let mut short = Covers::with_members(members);
            let hulls = built(shapes, seen_values);
            let between = (first + part * (last - first)).min(last);
            for theta in shapes.iter().copied().chain([between]) {
                let expected = [hulls.lower_at(shapes, seen_values, theta), hulls.upper_at(shapes, seen_values, theta)];
                let (lower, upper) = short.around(&grid, seen.clone(), &values, theta);
                for (found, expected) in [lower, upper].iter().zip(&expected) {
                    prop_assert_eq!(found.value.to_bits(), expected.value.to_bits(), "{:?} at {}", seen, theta);
                    prop_assert_eq!(found.slope.to_bits(), expected.slope.to_bits(), "{:?} at {}", seen, theta);
                }
            }
        }
    }

    // Guards O(N): the chain compares at most 2N − 3 times, for the largest bank too.
    #[test]
    fn the_hulls_cost_no_more_than_two_comparisons_a_point(
        values in prop_oneof![Just(2_usize), Just(3), Just(33), Just(512)].prop_flat_map(any_function),
    ) {
        let (thetas, most) = (thetas(values.len()), 2 * values.len() - 3);
        for side in [1.0, -1.0] {
            let comparisons = Hull::with_members(values.len(), side).update(&thetas, &values);
            prop_assert!(comparisons <= most, "{comparisons} of {most}");
        }
    }

    // Guards the definition for banks of every size and degenerate functions: both covers touch f at both edges, lie on
    // their sides of f, and are one line where f is one.
    #[test]
    fn banks_of_every_size_and_flat_functions(
        values in prop_oneof![Just(2_usize), Just(3), Just(512)].prop_flat_map(any_function), straight in any::<bool>(),
    ) {
        let thetas = thetas(values.len());
        let values = if straight { thetas.iter().map(|theta| 3.0 * theta - 7.0).collect() } else { values };
        let covers = built(&thetas, &values);
        let last = values.len() - 1;
        let size = values.iter().fold(1.0, |most: f64, value| most.max(value.abs()));
        for (&theta, &value) in thetas.iter().zip(&values) {
            let (lower, upper) = (covers.lower_at(&thetas, &values, theta), covers.upper_at(&thetas, &values, theta));
            prop_assert!(lower.value <= value + 1e-12 * size && upper.value >= value - 1e-12 * size);
            let one_line = (upper.value - lower.value).abs() <= 1e-12 * size && (lower.slope - 3.0).abs() < 1e-9;
            prop_assert!(!straight || one_line);
            if theta == thetas[0] || theta == thetas[last] {
                prop_assert!((lower.value - value).abs() <= 1e-12 * size && (upper.value - value).abs() <= 1e-12 * size);
            }
            // At an edge too the slopes support their covers on all of Θ.
            for (&other, &there) in thetas.iter().zip(&values) {
                prop_assert!(lower.value + lower.slope * (other - theta) <= there + 1e-11 * size);
                prop_assert!(upper.value + upper.slope * (other - theta) >= there - 1e-11 * size);
            }
        }
    }
}

// Guards what the short way must leave to the hulls: numbers that are none, and a bend too small to be sure of.
#[test]
fn the_short_way_refuses_what_it_cannot_judge() {
    let sine: Vec<f64> = (0..9).map(|j| libm::sin(f64::from(j))).collect();
    assert!(bend(&sine) == Bend::Unknown);
    assert!(bend(&[0.0, f64::NAN, 1.0]) == Bend::Unknown);
    assert!(bend(&[1.0, 2.0, 3.0, 4.0]) == Bend::Unknown);
    assert!(bend(&[1.0]) == Bend::Unknown);
    assert!(bend(&[1.0, 0.0, 1.0]) == Bend::Convex && bend(&[0.0, 1.0, 0.0]) == Bend::Concave);
}
