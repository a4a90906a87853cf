//! Guards the bank: member for member it is the single model, it stores and restores, and its order is the grid's.

mod common;

use anhyst_model::{Anhysteretic, Bank, Hysteresis, MagneticState};
use proptest::prelude::*;

fn grid(low: f64, high: f64, members: usize) -> Vec<f64> {
    (0..members)
        .map(|member| low + (high - low) * member as f64 / (members as f64 - 1.0).max(1.0))
        .collect()
}

/// Worst |M_bank − M_single| over members and steps, in Ms.
fn worst_difference(base: Hysteresis, shapes: &[f64], fields: impl Iterator<Item = f64>) -> f64 {
    let mut bank = Bank::new(base, shapes).expect("valid bank");
    let mut singles = vec![MagneticState::default(); shapes.len()];
    let mut worst: f64 = 0.0;
    for field in fields {
        bank.advance(field);
        for ((single, &shape), &magnetization) in singles.iter_mut().zip(shapes).zip(bank.magnetizations()) {
            *single = base.with_shape(shape).advance(*single, field);
            worst = worst.max((single.magnetization_a_per_m - magnetization).abs());
        }
    }
    worst / base.saturation_magnetization_a_per_m
}

/// Milling-like drive at 20 kHz: 50 Hz with 30 % at 150 Hz, then decaying.
fn drive(scale: f64) -> impl Iterator<Item = f64> {
    (1..6000).map(move |step| {
        let phase = f64::from(step) * 2.0 * std::f64::consts::PI * 50.0 / 20e3;
        scale * (1.0 - f64::from(step) / 8000.0) * (phase.sin() + 0.3 * (3.0 * phase).sin())
    })
}

#[test]
fn bank_is_its_members_along_a_drive() {
    let shapes = grid(6300.0, 7300.0, 33);
    let difference = worst_difference(Hysteresis::terfenol_d(), &shapes, drive(15e3));
    println!("bank of 33 against single models along a drive: {difference:.1e} Ms");
    assert!(difference < 1e-8, "{difference:.1e} Ms");
}

#[test]
fn every_reference_material_and_range() {
    for anhysteretic in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        for name in common::MATERIALS {
            let base = common::material(anhysteretic, name);
            for (amplitude, cubic) in [
                (0.3, 0.0),
                (2.0, 0.0),
                (30.0, 0.0),
                (2.0, 0.3),
                (2.0, -1.0),
                (30.0, 0.3),
            ] {
                let base = common::with_cubic(base, cubic);
                // The Ising curve with positive coupling has no room for a positive b₃: it would fold.
                if base.validate().is_err() {
                    assert!(cubic > 0.0 && base.coupling > 0.0);
                    continue;
                }
                let shapes = grid(base.shape_a_per_m, 1.1 * base.shape_a_per_m, 5);
                let fields = drive(amplitude * base.shape_a_per_m).step_by(7);
                let difference = worst_difference(base, &shapes, fields);
                assert!(
                    difference < 1e-8,
                    "{anhysteretic:?} {name} x{amplitude}, b3 {cubic}: {difference:.1e} Ms"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn bank_is_its_members_after_random_jumps(
        fields in prop::collection::vec(-40e3..40e3, 1..30),
        members in 1_usize..20,
    ) {
        let shapes = grid(6300.0, 7300.0, members);
        let difference = worst_difference(Hysteresis::terfenol_d(), &shapes, fields.into_iter());
        prop_assert!(difference < 1e-8, "{difference:.1e} Ms");
    }
}

#[test]
fn grid_order_and_length_are_kept() {
    let shapes = [7300.0, 6300.0, 7000.0];
    let mut bank = Bank::new(Hysteresis::terfenol_d(), &shapes).expect("valid");
    bank.advance(8e3);
    assert_eq!(bank.shapes(), shapes);
    assert_eq!(bank.field_a_per_m(), 8e3);
    let [soft, hard, middle] = bank.magnetizations() else {
        panic!("three members")
    };
    assert!(soft < middle && middle < hard, "a larger shape magnetizes less");
}

/// A snapshot in mid loop goes on with the same bits.
#[test]
fn stored_bank_goes_on_with_the_same_bits() {
    let mut bank = Bank::new(Hysteresis::terfenol_d(), &grid(6300.0, 7300.0, 11)).expect("valid");
    for field in drive(15e3).take(1234) {
        bank.advance(field);
    }
    let text = serde_json::to_string(&bank).expect("serialises");
    let mut restored: Bank = serde_json::from_str(&text).expect("restores");
    assert_eq!(bank, restored);
    for field in drive(12e3).skip(1234) {
        bank.advance(field);
        restored.advance(field);
        assert_eq!(bank.magnetizations(), restored.magnetizations());
    }
    let broken = text.replace("\"direction\"", "\"course\"");
    assert!(serde_json::from_str::<Bank>(&broken).is_err());
}

/// Guards "same bits everywhere": a fingerprint of all that a bank says on each kernel, along reversals. A change of the model changes it, another
/// processor must not; that the instruction sets of one agree is tested beside the bank.
#[test]
fn every_machine_gives_these_bits() {
    // Those worked on in wide, those in narrow blocks, and one that is padded.
    let shapes = grid(6300.0, 7260.0, 49);
    let mut wrong = Vec::new();
    for (anhysteretic, coupling, amplitude, expected) in [
        (Anhysteretic::Langevin, -0.01, 8e3, 0x64b3_4adc_4bda_4bb7_u64),
        (Anhysteretic::Langevin, 0.01, 15e3, 0x2fbe_08c5_9684_55d5),
        (Anhysteretic::Langevin, -0.01, 300e3, 0xb3c9_313b_db03_a27f),
        (Anhysteretic::Ising, -0.01, 15e3, 0xd5de_6520_9d44_4f7c),
        (Anhysteretic::Ising, -0.01, 300e3, 0x92dd_41fb_1360_eda3),
    ] {
        let base = Hysteresis {
            anhysteretic,
            coupling,
            ..Hysteresis::terfenol_d()
        };
        let mut bank = Bank::new(base, &shapes).expect("valid");
        // FNV-1a, a word at a time.
        let mut fingerprint: u64 = 0xcbf2_9ce4_8422_2325;
        for step in 1..2000 {
            let phase = f64::from(step) * 0.05;
            bank.advance(amplitude * libm::sin(phase) * (1.0 + 0.3 * libm::sin(7.3 * phase)));
            for magnetization in bank.magnetizations() {
                fingerprint = (fingerprint ^ magnetization.to_bits()).wrapping_mul(0x0100_0000_01b3);
            }
        }
        if fingerprint != expected {
            wrong.push(format!(
                "{anhysteretic:?}, coupling {coupling}, {amplitude} A/m: {fingerprint:#x}"
            ));
        }
    }
    assert!(wrong.is_empty(), "other bits than expected:\n{}", wrong.join("\n"));
}
