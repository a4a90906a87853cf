//! Erratum of (14) and (20): with ŷ instead of ỹ inside sat() and ỹ_ε, a perfect estimate does not stay. The error of a perfect
//! model is zero, so θ̂' = −ỹ_ε φ* must be zero; the output ŷ is not.

/// sat(x).
fn saturation(x: f64) -> f64 {
    x.clamp(-1.0, 1.0)
}

/// ỹ_ε = x − ε·sat(x/ε): 0 within the dead zone.
fn beyond_dead_zone(x: f64, dead_zone: f64) -> f64 {
    x - dead_zone * saturation(x / dead_zone)
}

/// y' = −ky + f(θ) with f = θ·u, integrated by Euler at 1 ms for 1 s, estimator started at the truth. Returns θ̂ − θ.
fn drift_of_a_perfect_estimate(printed: bool) -> f64 {
    let (k, truth, dead_zone, step) = (2.0, 3.0, 1e-3, 1e-3);
    let (mut y, mut predicted, mut estimate) = (0.0, 0.0, truth);
    for tick in 0..1000 {
        let input = 0.001 * f64::from(tick);
        let error: f64 = predicted - y;
        let judged = if printed { predicted } else { error };
        let beyond = beyond_dead_zone(judged, dead_zone);
        // f is linear in θ: its cover is f itself, so a* = 0 and φ* = u.
        y += step * (-k * y + truth * input);
        predicted += step * (-k * predicted + estimate * input - dead_zone * saturation(judged / dead_zone));
        estimate -= step * beyond * input;
    }
    estimate - truth
}

#[test]
fn the_printed_argument_of_sat_drives_a_perfect_estimate_away() {
    let drift = drift_of_a_perfect_estimate(true);
    assert!(drift < -0.05, "{drift}");
}

#[test]
fn the_error_as_argument_leaves_it_alone() {
    assert_eq!(drift_of_a_perfect_estimate(false), 0.0);
}
