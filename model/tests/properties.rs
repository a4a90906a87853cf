//! Guards what every hysteresis of this kind must do, over random materials and random field histories.

mod common;

use anhyst_model::{Anhysteretic, Bank, Hysteresis, MagneticState, SensitiveState};
use common::{curves, drawn};
use proptest::prelude::*;

/// Materials around the physical ranges, both curves, both signs of the coupling; invalid draws are dropped.
fn materials() -> impl Strategy<Value = Hysteresis> {
    (curves(), 1e5..1.5e6, 1e3..3e4, 0.05..3.0, -1.5..0.8, 0.0..0.9)
        .prop_map(drawn)
        .prop_filter("valid", |material| material.validate().is_ok())
}

/// Fields as multiples of a + k.
fn histories() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-4.0..4.0, 1..12)
}

fn scale(material: &Hysteresis) -> f64 {
    material.shape_a_per_m + material.pinning_a_per_m
}

fn after(material: &Hysteresis, history: &[f64]) -> MagneticState {
    history.iter().fold(MagneticState::default(), |state, field| {
        material.advance(state, field * scale(material))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// M(−H) = −M(H), to the last bit.
    #[test]
    fn odd_symmetry(material in materials(), history in histories()) {
        let mirrored: Vec<f64> = history.iter().map(|field| -field).collect();
        let (state, image) = (after(&material, &history), after(&material, &mirrored));
        prop_assert_eq!(state.magnetization_a_per_m, -image.magnetization_a_per_m);
    }

    /// |M| ≤ Ms, for any history.
    #[test]
    fn saturation(material in materials(), history in histories(), far in 1.0..1e3) {
        let state = material.advance(after(&material, &history), far * scale(&material));
        let saturation = material.saturation_magnetization_a_per_m;
        prop_assert!(state.magnetization_a_per_m.abs() <= saturation * (1.0 + 1e-12));
        prop_assert!(state.magnetization_a_per_m > 0.0 || far < 10.0);
    }

    /// dM/dH > 0 (≥ 0 without reversible part) in both directions after any history, and M follows the field's direction.
    #[test]
    fn slope_is_positive(material in materials(), history in histories(), to in -4.0..4.0) {
        let state = after(&material, &history);
        for rising in [false, true] {
            let slope = material.slope(state, rising);
            prop_assert!(slope.is_finite() && slope >= 0.0, "slope {slope} rising {rising}");
            prop_assert!(slope > 0.0 || material.reversibility < 1e-3 || material.anhysteretic == Anhysteretic::Ising);
        }
        let end = material.advance(state, to * scale(&material));
        let moved = (end.magnetization_a_per_m - state.magnetization_a_per_m)
            * (end.field_a_per_m - state.field_a_per_m).signum();
        prop_assert!(moved >= -1e-12 * material.saturation_magnetization_a_per_m, "moved {moved}");
    }

    /// Passivity, locally: the loss is ∫ k·|dMirr|, so Mirr may only move in the field's direction.
    #[test]
    fn irreversible_part_follows_the_field(material in materials(), history in histories(), to in -4.0..4.0) {
        let state = after(&material, &history);
        let end = material.advance(state, to * scale(&material));
        let moved = (material.irreversible(end) - material.irreversible(state))
            * (end.field_a_per_m - state.field_a_per_m).signum();
        prop_assert!(moved >= -1e-9 * material.saturation_magnetization_a_per_m, "moved {moved}");
    }

    /// Passivity, in the whole: a closed symmetric loop encloses ∮ H dM ≥ 0, and pinning makes it more than nothing.
    #[test]
    fn loops_dissipate(material in materials(), amplitude in 0.1..4.0) {
        let high = amplitude * scale(&material);
        let mut state = material.advance(MagneticState::default(), high);
        for _ in 0..30 {
            state = material.advance(material.advance(state, -high), high);
        }
        let start = state;
        let mut area = 0.0;
        let parts = 400;
        for end in [-high, high] {
            let from = state.field_a_per_m;
            for part in 1..=parts {
                let to = from + (end - from) * f64::from(part) / f64::from(parts);
                let next = material.advance(state, to);
                area += 0.5 * (state.field_a_per_m + to) * (next.magnetization_a_per_m - state.magnetization_a_per_m);
                state = next;
            }
        }
        let opening = (state.magnetization_a_per_m - start.magnetization_a_per_m).abs();
        prop_assert!(opening < 1e-3 * material.saturation_magnetization_a_per_m, "not closed: {opening}");
        prop_assert!(area > 0.0, "area {area}");
    }

    /// The state is all the memory: going in two moves of one direction is going in one, to the stepping's error.
    #[test]
    fn split_moves_agree(material in materials(), history in histories(), to in -4.0..4.0, share in 0.0..1.0) {
        let state = after(&material, &history);
        let to = to * scale(&material);
        let middle = state.field_a_per_m + share * (to - state.field_a_per_m);
        let whole = material.advance(state, to).magnetization_a_per_m;
        let split = material.advance(material.advance(state, middle), to).magnetization_a_per_m;
        let error = (whole - split).abs() / material.saturation_magnetization_a_per_m;
        prop_assert!(error < 1e-7, "split differs by {error:.1e} Ms");
    }
}

#[test]
fn fields_that_are_not_finite_give_no_number() {
    let material = Hysteresis::terfenol_d();
    let mut bank = Bank::new(material, &[6500.0, 7000.0]).expect("valid");
    for field in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let state = material.advance(MagneticState::default(), field);
        assert!(state.magnetization_a_per_m.is_nan(), "{field} gave {state:?}");
        bank.advance(field);
        assert!(bank.magnetizations().iter().all(|magnetization| magnetization.is_nan()));
    }
}

#[test]
fn absurd_fields_saturate() {
    let material = Hysteresis::terfenol_d();
    for field in [1e9, -1e15, 1e30] {
        let state = material.advance(MagneticState::default(), field);
        let share = state.magnetization_a_per_m / material.saturation_magnetization_a_per_m;
        assert!(
            (share.abs() - 1.0).abs() < 1e-4 && share * field > 0.0,
            "{field}: {share}"
        );
    }
}

/// Guards what b₃ costs a material without it: nothing, not a bit. One that is lost beside α leaves all bits, too, although
/// other code runs.
#[test]
fn a_vanishing_cubic_coupling_changes_no_bit() {
    for anhysteretic in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        let without = Hysteresis {
            anhysteretic,
            ..Hysteresis::terfenol_d()
        };
        let with = Hysteresis {
            cubic_coupling_m2_per_a2: 1e-40,
            ..without
        };
        let mut state = MagneticState::default();
        let (mut sensitive, mut plain) = (SensitiveState::default(), SensitiveState::default());
        for step in 1..3000 {
            let phase = 0.03 * f64::from(step);
            let field = 15e3 * libm::sin(phase) * (1.0 + 0.3 * libm::sin(7.3 * phase));
            sensitive = with.advance_with_sensitivities(sensitive, field);
            plain = without.advance_with_sensitivities(plain, field);
            let demanded = without.advance(state, 0.9 * field).magnetization_a_per_m;
            assert_eq!(
                with.advance_to_magnetization(state, demanded, 3e4),
                without.advance_to_magnetization(state, demanded, 3e4)
            );
            assert_eq!(sensitive.mean_excess_a_per_m, plain.mean_excess_a_per_m);
            assert_eq!(with.advance(state, field), without.advance(state, field));
            state = without.advance(state, field);
            assert_eq!(sensitive.magnetic(), state);
        }
    }
}

/// Guards files of materials: one written before b₃ is read, and a material without b₃ is written as it was.
#[test]
fn materials_without_a_cubic_coupling_are_written_without_it() {
    let material = Hysteresis::terfenol_d();
    let text = serde_json::to_string(&material).expect("serialises");
    assert!(!text.contains("cubic"), "{text}");
    assert_eq!(serde_json::from_str::<Hysteresis>(&text).expect("restores"), material);
    let stressed = Hysteresis {
        cubic_coupling_m2_per_a2: 1e-14,
        ..material
    };
    let text = serde_json::to_string(&stressed).expect("serialises");
    assert_eq!(serde_json::from_str::<Hysteresis>(&text).expect("restores"), stressed);
}
