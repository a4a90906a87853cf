//! Guards the envelopes: optimal by their own certificate, equal to brute force where that can be afforded, the same
//! from a warm basis as from a cold one, and safe where many answers tie.

use super::*;
use proptest::prelude::*;

fn whole(members: &Members) -> (Window, Vec<usize>) {
    let window = members.window(&[0.0; COUNT], &[None; COUNT]);
    let mut seen = Vec::new();
    members.seen(&window, &mut seen);
    (window, seen)
}

fn plane_at(point: &EnvelopePoint, from: &[f64; COUNT], to: &[f64; COUNT]) -> f64 {
    point.value
        + (0..COUNT)
            .map(|axis| point.slope[axis] * (to[axis] - from[axis]))
            .sum::<f64>()
}

fn any_x() -> impl Strategy<Value = [f64; COUNT]> {
    prop::array::uniform5(prop_oneof![4 => -1.0..=1.0_f64, 1 => Just(-1.0), 1 => Just(1.0), 1 => Just(0.0)])
}

/// Values that often tie: small whole numbers, planes, or anything.
fn any_values() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![
        prop::collection::vec(-1.0..1.0_f64, 81),
        prop::collection::vec((0..3_i32).prop_map(f64::from), 81),
        Just(vec![0.7; 81]),
    ]
}

/// Whether the envelope is as high as the basis says: the basis is a mixture of members that gives x and the value.
fn mixture(envelope: &Envelope, members: &Members, values: &[f64], x: &[f64; COUNT]) -> (f64, f64) {
    let basis = Basis::around(members, envelope.members, x).expect("the last basis holds x");
    let mixed = (0..basis.size)
        .map(|row| basis.weights[row] * values[basis.members[row]])
        .sum();
    let least = basis.weights[..basis.size]
        .iter()
        .fold(f64::INFINITY, |least, weight| least.min(*weight));
    (mixed, least)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    // Guards optimality by duality: a plane below (above) all members, that at x is as high (low) as a mixture of
    // members.
    #[test]
    fn the_plane_supports_and_the_mixture_reaches_it(axes in 1..=5_usize, values in any_values(), x in any_x()) {
        let members = Members::new(axes, 3);
        let (window, seen) = whole(&members);
        for side in [Side::Lower, Side::Upper] {
            let mut envelope = Envelope::new(side);
            let point = envelope.at(&members, &seen, &window, &values, &x);
            for (member, at) in members.points().iter().enumerate() {
                let over = envelope.sign * (plane_at(&point, &x, at) - values[member]);
                prop_assert!(over <= 1e-12, "member {} is on the wrong side by {:e}", member, over);
            }
            let (mixed, least) = mixture(&envelope, &members, &values, &x);
            prop_assert!((mixed - point.value).abs() < 1e-11 && least >= -1e-11, "{} {} {}", mixed, point.value, least);
            prop_assert!(point.steps < 60, "{} steps", point.steps);
        }
    }

    // Guards against brute force in the plane: the lowest triangle of members around x.
    #[test]
    fn two_axes_by_all_triangles(values in any_values(), x in any_x()) {
        let members = Members::new(2, 4);
        let (window, seen) = whole(&members);
        let found = Envelope::new(Side::Lower).at(&members, &seen, &window, &values, &x).value;
        let mut lowest = f64::INFINITY;
        for i in 0..16 {
            for j in i + 1..16 {
                for k in j + 1..16 {
                    let chosen = [i, j, k, 0, 0, 0];
                    if let Some(basis) = Basis::around(&members, chosen, &x) {
                        lowest = lowest.min((0..3).map(|row| basis.weights[row].max(0.0) * values[chosen[row]]).sum());
                    }
                }
            }
        }
        prop_assert!((found - lowest).abs() < 1e-10, "{} {}", found, lowest);
    }

    // Guards the warm start: values and place drift from step to step, sometimes jump, and the answer is always that of
    // a cold start.
    #[test]
    fn warm_and_cold_agree(
        axes in 1..=5_usize, first in any_values(), second in any_values(),
        places in prop::collection::vec((any_x(), 0.0..1.0_f64), 1..30),
    ) {
        let members = Members::new(axes, 3);
        let (window, seen) = whole(&members);
        let mut warm = Envelope::new(Side::Upper);
        let mut x = [0.0; COUNT];
        for (step, (place, part)) in places.iter().enumerate() {
            let near = if step % 5 == 0 { 1.0 } else { 0.02 };
            x = std::array::from_fn(|axis| x[axis] + near * (place[axis] - x[axis]));
            let values: Vec<f64> = first.iter().zip(&second).map(|(one, two)| one + part * (two - one)).collect();
            let found = warm.at(&members, &seen, &window, &values, &x);
            let cold = Envelope::new(Side::Upper).at(&members, &seen, &window, &values, &x);
            prop_assert!((found.value - cold.value).abs() < 1e-11, "{:?} {:?}", found, cold);
        }
    }

    // Guards windows: only what is seen counts, and bases from another window are not carried over.
    #[test]
    fn windows_are_envelopes_of_their_own(values in any_values(), places in prop::collection::vec(any_x(), 1..10), reach in 0.05..0.8_f64) {
        let members = Members::new(2, 9);
        let mut envelope = Envelope::new(Side::Lower);
        let mut seen = Vec::new();
        for x in places {
            let window = members.window(&x, &[Some(reach); COUNT]);
            members.seen(&window, &mut seen);
            let point = envelope.at(&members, &seen, &window, &values, &x);
            for &member in &seen {
                prop_assert!(plane_at(&point, &x, &members.points()[member]) <= values[member] + 1e-11);
            }
            let (mixed, _) = mixture(&envelope, &members, &values, &x);
            prop_assert!((mixed - point.value).abs() < 1e-11 && envelope.members[..3].iter().all(|member| seen.contains(member)));
        }
    }
}

// Guards agreement with the hulls of one parameter: the same covers, at members too, where the slopes may differ but
// support.
#[test]
fn one_axis_is_the_hull() {
    let members = Members::new(1, 9);
    let (window, seen) = whole(&members);
    let values = [0.4, 0.1, 0.5, -0.3, 0.2, 0.9, 0.0, -0.1, 0.6];
    let thetas: Vec<f64> = members.points().iter().map(|point| point[0]).collect();
    let mut covers = crate::Covers::with_members(9);
    covers.update(&thetas, &values);
    let (mut lower, mut upper) = (Envelope::new(Side::Lower), Envelope::new(Side::Upper));
    for step in 0..=100 {
        let theta = -1.0 + 0.02 * f64::from(step);
        let x = [theta, 0.0, 0.0, 0.0, 0.0];
        let (low, high) = (
            covers.lower_at(&thetas, &values, theta),
            covers.upper_at(&thetas, &values, theta),
        );
        assert!((lower.at(&members, &seen, &window, &values, &x).value - low.value).abs() < 1e-14);
        assert!((upper.at(&members, &seen, &window, &values, &x).value - high.value).abs() < 1e-14);
    }
}

// Guards convexity of what comes out: along a line through the box the slopes of the lower envelope never fall.
#[test]
fn envelopes_are_convex_along_lines() {
    let members = Members::new(3, 3);
    let (window, seen) = whole(&members);
    let values: Vec<f64> = (0..27)
        .map(|member| f64::from((member * 7919 + 13) % 101) / 100.0)
        .collect();
    let mut lower = Envelope::new(Side::Lower);
    let at = |part: f64| [part, 0.5 * part + 0.2, -0.3 * part, 0.0, 0.0];
    let found: Vec<f64> = (0..=200)
        .map(|step| {
            lower
                .at(&members, &seen, &window, &values, &at(-1.0 + 0.01 * f64::from(step)))
                .value
        })
        .collect();
    assert!(
        found
            .windows(3)
            .all(|three| three[0] - 2.0 * three[1] + three[2] >= -1e-12)
    );
}
