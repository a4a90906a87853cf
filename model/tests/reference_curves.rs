//! Guards the stepping as a whole: the default substeps and the closed-form switch against curves that another program
//! computed (algebraic form, eighth order, 1e-11).

mod common;

use anhyst_model::{Bank, MagneticState};

/// Largest |M| error over the largest |M| of the curve.
const TOLERANCE: f64 = 1e-7;

#[test]
fn all_reference_curves_at_default_stepping() {
    let curves = common::reference_curves();
    assert_eq!(curves.len(), 32);
    let mut worst = (0.0, String::new());
    for curve in &curves {
        let mut state = MagneticState::default();
        let error = curve.worst_error(|field| {
            state = curve.hysteresis.advance(state, field);
            state.magnetization_a_per_m
        });
        assert!(error <= TOLERANCE, "{}: {error:.2e} of max|M|", curve.name);
        if error > worst.0 {
            worst = (error, curve.name.clone());
        }
    }
    println!("worst of 32 curves: {:.2e} of max|M| ({})", worst.0, worst.1);
}

#[test]
fn banks_follow_the_reference_curves_too() {
    let mut worst: f64 = 0.0;
    for curve in common::reference_curves() {
        let shape = curve.hysteresis.shape_a_per_m;
        let mut bank = Bank::new(curve.hysteresis, &[0.995 * shape, shape, 1.1 * shape]).expect("valid");
        let error = curve.worst_error(|field| {
            bank.advance(field);
            bank.magnetizations()[1]
        });
        assert!(error <= TOLERANCE, "{}: {error:.2e} of max|M|", curve.name);
        worst = worst.max(error);
    }
    println!("bank, worst of 32 curves: {worst:.2e} of max|M|");
}

/// One jump per leg must do as well as 60 points: the caller's sampling must not matter.
#[test]
fn whole_legs_in_one_step() {
    let mut worst: f64 = 0.0;
    for curve in common::reference_curves() {
        let mut state = MagneticState::default();
        for leg in curve.points[1..].chunks(60) {
            let &(field, expected) = leg.last().expect("a leg has 60 points");
            state = curve.hysteresis.advance(state, field);
            let error =
                (state.magnetization_a_per_m - expected).abs() / curve.hysteresis.saturation_magnetization_a_per_m;
            assert!(error <= TOLERANCE, "{} at {field} A/m: {error:.2e} Ms", curve.name);
            worst = worst.max(error);
        }
    }
    println!("one step a leg, worst of 32 curves: {worst:.2e} Ms");
}
