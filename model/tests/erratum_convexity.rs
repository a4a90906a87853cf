//! Erratum of Fig. 5b: M(u, a) switches its convexity in `a` with the Ising curve only. With Langevin it is convex in `a` for
//! every H > 0 on a field that rises from the demagnetised state. Also: why b = Σ Bᵢ of (20), (21) is zero for this rod.

use anhyst_model::{Anhysteretic, Bank, Hysteresis, RodConstants, RodElements, RodState, TwoPolePropagator};

const MEMBERS: usize = 41;

/// Smallest and largest second difference of M over Θ = [6300, 7300], at every 200 A/m of a field that rises to 30 kA/m.
fn second_differences(anhysteretic: Anhysteretic) -> Vec<(f64, f64, f64)> {
    let shapes: Vec<f64> = (0..MEMBERS).map(|member| 6300.0 + 25.0 * member as f64).collect();
    let base = Hysteresis {
        anhysteretic,
        ..Hysteresis::terfenol_d()
    };
    let mut bank = Bank::new(base, &shapes).unwrap();
    (1..=150)
        .map(|step| {
            let field = 200.0 * f64::from(step);
            bank.advance(field);
            let bends: Vec<f64> = bank
                .magnetizations()
                .windows(3)
                .map(|m| m[0] - 2.0 * m[1] + m[2])
                .collect();
            let low = bends.iter().copied().fold(f64::INFINITY, f64::min);
            let high = bends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (field, low, high)
        })
        .collect()
}

#[test]
fn langevin_never_switches_its_convexity() {
    for (field, low, _) in second_differences(Anhysteretic::Langevin) {
        assert!(low > 0.0, "second difference {low} A/m at {field} A/m");
    }
}

#[test]
fn ising_switches_its_convexity() {
    let bends = second_differences(Anhysteretic::Ising);
    let last_convex = bends.iter().take_while(|(_, low, _)| *low > 0.0).last().unwrap().0;
    let first_concave = bends.iter().find(|(_, _, high)| *high < 0.0).unwrap().0;
    println!("convex up to {last_convex} A/m, concave from {first_concave} A/m");
    assert!((17_000.0..=17_800.0).contains(&last_convex), "{last_convex} A/m");
    assert!((18_600.0..=19_400.0).contains(&first_concave), "{first_concave} A/m");
}

/// w/((s − p₁)(s − p₂)) = B₁/(s − p₁) + B₂/(s − p₂) answers a unit step with (B₁ + B₂)t + (B₁p₁ + B₂p₂)t²/2 + … : the rod
/// in motion starts with w t²/2, so b = B₁ + B₂ is zero, g of (21) is zero, and nothing adapts.
#[test]
fn the_rod_answers_a_step_without_a_part_in_t() {
    let rod = RodElements::assemble(&RodConstants::paper(), 2).unwrap().two_pole(1.0);
    let answer = |time_s: f64| {
        let propagator = TwoPolePropagator::new(rod, time_s).unwrap();
        propagator
            .advance(RodState::default(), rod.gain, rod.gain)
            .displacement_m
    };
    // Richardson: of what is of first and of second order in t, the third cancels.
    let time_s = 1e-8;
    let (whole, half) = (answer(time_s), answer(0.5 * time_s));
    let first_order = (4.0 * half - whole) / time_s;
    assert!(first_order.abs() < 1e-4 * rod.gain * time_s, "b is {first_order} m/s");
    assert!((whole / (0.5 * rod.gain * time_s * time_s) - 1.0).abs() < 1e-4);
}
