//! Guards the errors that speed is told with: one step, one inverse step and a bank along the signal of `anhyst bench`, each against
//! the same law in steps an eighth as long.

use anhyst_model::{Bank, Hysteresis, MagneticState};
use std::f64::consts::TAU;

const SAMPLES: usize = 8000;

/// 20 kHz: 50 Hz with a decaying amplitude, then biased minor loops at 250 Hz. At most 0.06 k a sample.
fn fields() -> Vec<f64> {
    (1..=SAMPLES)
        .map(|step| {
            let (time_s, gone) = (step as f64 / 20e3, step as f64 / SAMPLES as f64);
            if gone < 0.75 {
                15e3 * (1.0 - gone) * (TAU * 50.0 * time_s).sin()
            } else {
                4e3 + 1.5e3 * (TAU * 250.0 * time_s).sin()
            }
        })
        .collect()
}

/// M of a material at each field, A/m.
fn finely(material: &Hysteresis) -> Vec<f64> {
    let mut state = MagneticState::default();
    fields()
        .into_iter()
        .map(|field| {
            let from = state.field_a_per_m;
            for part in 1..=8 {
                state = material.advance(state, from + (field - from) * f64::from(part) / 8.0);
            }
            state.magnetization_a_per_m
        })
        .collect()
}

#[test]
fn a_step_errs_by_less_than_2e_9_of_saturation() {
    let material = Hysteresis::terfenol_d();
    let mut state = MagneticState::default();
    let mut worst: f64 = 0.0;
    for (field, fine) in fields().into_iter().zip(finely(&material)) {
        state = material.advance(state, field);
        worst = worst.max((state.magnetization_a_per_m - fine).abs());
    }
    let worst = worst / material.saturation_magnetization_a_per_m;
    println!("step: {worst:.1e} Ms");
    assert!(worst < 2e-9, "{worst:.1e} Ms");
}

/// The bar is 2e-6; what is reached is the forward step's own error, seen through the slope.
#[test]
fn an_inverse_step_finds_the_field() {
    let material = Hysteresis::terfenol_d();
    let mut state = MagneticState::default();
    let (mut worst, mut missed, mut slope): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for (field, fine) in fields().into_iter().zip(finely(&material)) {
        let found = material.advance_to_magnetization(state, fine, 3e4);
        assert!(!found.limited);
        let forward = material.advance(state, found.state.field_a_per_m);
        let rising = fine > state.magnetization_a_per_m;
        worst = worst.max((found.state.field_a_per_m - field).abs() / 15e3);
        missed = missed.max((forward.magnetization_a_per_m - fine).abs() / material.saturation_magnetization_a_per_m);
        slope = slope.max((found.slope / material.slope(forward, rising) - 1.0).abs());
        state = found.state;
    }
    println!("inverse step: {worst:.1e} of 15 kA/m, misses its demand by {missed:.1e} Ms, slope off by {slope:.1e}");
    assert!(worst < 1e-7, "{worst:.1e} of 15 kA/m");
    assert!(missed < 1e-12, "{missed:.1e} Ms");
    assert!(slope < 1e-5, "{slope:.1e}");
}

#[test]
fn a_bank_errs_by_less_than_1e_8_of_saturation() {
    let material = Hysteresis::terfenol_d();
    let shapes: Vec<f64> = (0..40).map(|member| 6300.0 + 25.0 * f64::from(member)).collect();
    let mut bank = Bank::new(material, &shapes).expect("valid");
    let fine: Vec<Vec<f64>> = shapes
        .iter()
        .map(|&shape| finely(&material.with_shape(shape)))
        .collect();
    let mut worst: f64 = 0.0;
    for (sample, field) in fields().into_iter().enumerate() {
        bank.advance(field);
        for (member, magnetization) in bank.magnetizations().iter().enumerate() {
            worst = worst.max((magnetization - fine[member][sample]).abs());
        }
    }
    let worst = worst / material.saturation_magnetization_a_per_m;
    println!("bank: {worst:.1e} Ms");
    assert!(worst < 1e-8, "{worst:.1e} Ms");
}
