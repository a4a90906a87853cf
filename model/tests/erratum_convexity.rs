//! Erratum of Fig. 5b: M(u, a) switches its convexity in `a` with the Ising curve only. With Langevin it is convex in `a` for
//! every H > 0 on a field that rises from the demagnetised state. Also: why b = Σ Bᵢ of (20), (21) is zero for this rod.

use anhyst_model::{Anhysteretic, Bank, Hysteresis, RodConstants, RodElements};

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

/// w/((s − p₁)(s − p₂)) = B₁/(s − p₁) + B₂/(s − p₂) with B₁ = w/(p₁ − p₂), B₂ = w/(p₂ − p₁): then b = B₁ + B₂ = 0, g of (21) is
/// zero and nothing adapts. Checked by evaluating both sides with the rod's own poles (complex, so in real and imaginary parts).
#[test]
fn the_two_pole_rod_has_residues_that_cancel() {
    let rod = RodElements::assemble(&RodConstants::paper(), 2).unwrap().two_pole(1.0);
    let half = 0.5 * rod.damping_per_s;
    let omega = (rod.stiffness_per_s2 - half * half).sqrt();
    assert!(omega > 0.0, "the paper's rod is underdamped");
    // p = −half ± jω, so B = ∓ j·w/(2ω): the residues are imaginary, equal and opposite.
    let residue = [-rod.gain / (2.0 * omega), rod.gain / (2.0 * omega)];
    let s = 1000.0;
    // B/(s − p) with B = j·r and s − p = d ∓ jω, for real s.
    let distance = s + half;
    let fraction = |r: f64, imaginary: f64| {
        let square = distance * distance + imaginary * imaginary;
        (r * imaginary / square, r * distance / square)
    };
    let (one, other) = (fraction(residue[0], -omega), fraction(residue[1], omega));
    let whole = rod.gain / (s * s + rod.damping_per_s * s + rod.stiffness_per_s2);
    assert!(
        ((one.0 + other.0) / whole - 1.0).abs() < 1e-12,
        "the residues are those of the rod"
    );
    assert!((one.1 + other.1).abs() < 1e-12 * whole);
    assert_eq!(residue[0] + residue[1], 0.0);
}
