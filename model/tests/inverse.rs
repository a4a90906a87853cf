//! Guards the inverse: inverse∘forward is the identity from any state, limits are reported, and nothing turns into NaN.

mod common;

use anhyst_model::{Anhysteretic, Hysteresis, MagneticState};
use proptest::prelude::*;

fn materials() -> impl Strategy<Value = Hysteresis> {
    let reference = (
        prop_oneof![Just(Anhysteretic::Langevin), Just(Anhysteretic::Ising)],
        prop::sample::select(&common::MATERIALS[..]),
    )
        .prop_map(|(anhysteretic, name)| common::material(anhysteretic, name));
    (
        reference,
        prop_oneof![Just(None), Just(Some(0.0)), Just(Some(1e-6)), (0.0..0.9).prop_map(Some)],
        common::cubic_shares(),
    )
        .prop_map(|(material, reversibility, cubic)| Hysteresis {
            reversibility: reversibility.unwrap_or(material.reversibility),
            ..common::with_cubic(material, cubic)
        })
        .prop_filter("valid", |material| material.validate().is_ok())
}

fn after(material: &Hysteresis, history: &[f64]) -> MagneticState {
    let scale = material.shape_a_per_m + material.pinning_a_per_m;
    history.iter().fold(MagneticState::default(), |state, field| {
        material.advance(state, field * scale)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// The demand is the magnetization of a field that can be reached: the answer's own magnetization must be it.
    #[test]
    fn inverse_then_forward_is_the_identity(
        material in materials(),
        history in prop::collection::vec(-3.0..3.0, 0..8),
        to in -3.0..3.0,
        reach in prop_oneof![Just(1.0), Just(1e-1), Just(1e-3), Just(1e-6)],
    ) {
        let state = after(&material, &history);
        let scale = material.shape_a_per_m + material.pinning_a_per_m;
        let field = state.field_a_per_m + reach * (to * scale - state.field_a_per_m);
        let off = common::identity_error(&material, &state, field, 10.0 * scale) / material.saturation_magnetization_a_per_m;
        prop_assert!(off < 1e-12, "off by {off:.1e} Ms");
    }

    /// Any finite demand, any limit: finite, within the limit, and either met or reported.
    #[test]
    fn any_demand_is_met_or_reported(
        material in materials(),
        history in prop::collection::vec(-3.0..3.0, 0..8),
        demand in -2.0..2.0,
        limit in 0.0..4.0,
    ) {
        let state = after(&material, &history);
        let limit = limit * (material.shape_a_per_m + material.pinning_a_per_m);
        let demanded = demand * material.saturation_magnetization_a_per_m;
        let answer = material.advance_to_magnetization(state, demanded, limit);
        prop_assert!(answer.state.field_a_per_m.abs() <= limit);
        prop_assert!(answer.state.magnetization_a_per_m.is_finite() && answer.slope.is_finite());
        let error = (answer.state.magnetization_a_per_m - demanded).abs()
            / material.saturation_magnetization_a_per_m;
        // Without reversible part the field jumps across a phase in which M stands still: that demand is met at its edge.
        prop_assert!(answer.limited || error < 1e-12, "off by {error:.1e} Ms and not reported");
        let forward = material.advance(state, answer.state.field_a_per_m);
        let apart = (forward.magnetization_a_per_m - answer.state.magnetization_a_per_m).abs()
            / material.saturation_magnetization_a_per_m;
        prop_assert!(apart < 1e-12, "the forward step ends {apart:.1e} Ms elsewhere");
        if answer.limited {
            prop_assert_eq!(answer.state.field_a_per_m.abs(), limit);
        }
    }
}

#[test]
fn demand_beyond_saturation_stops_at_the_limit() {
    let material = Hysteresis::terfenol_d();
    let answer = material.advance_to_magnetization(MagneticState::default(), 1e6, 3e4);
    assert!(answer.limited);
    assert_eq!(answer.state, material.advance(MagneticState::default(), 3e4));
}

#[test]
fn without_reversible_part_the_field_jumps_to_the_switch() {
    let material = Hysteresis {
        reversibility: 0.0,
        ..Hysteresis::terfenol_d()
    };
    let top = material.advance(MagneticState::default(), 2e4);
    // Just below the top, falling: M stands still until Man comes down to it.
    let demanded = top.magnetization_a_per_m - 1.0;
    let answer = material.advance_to_magnetization(top, demanded, 3e4);
    assert!(!answer.limited && answer.state.field_a_per_m < top.field_a_per_m - 1e3);
    assert!((answer.state.magnetization_a_per_m - demanded).abs() < 1e-6);
}

#[test]
fn present_magnetization_and_not_a_number_move_nothing() {
    let material = Hysteresis::terfenol_d();
    let state = material.advance(MagneticState::default(), 9e3);
    let answer = material.advance_to_magnetization(state, state.magnetization_a_per_m, 3e4);
    assert!(answer.state == state && !answer.limited);
    let answer = material.advance_to_magnetization(state, f64::NAN, 3e4);
    assert!(answer.state == state && answer.limited);
    let answer = material.advance_to_magnetization(state, f64::INFINITY, 3e4);
    assert!(answer.limited && answer.state.field_a_per_m == 3e4);
}

#[test]
fn a_state_beyond_the_limit_comes_back_to_it() {
    let material = Hysteresis::terfenol_d();
    let state = material.advance(MagneticState::default(), 3e4);
    let answer = material.advance_to_magnetization(state, 7e5, 2e4);
    assert!(answer.limited && answer.state.field_a_per_m == 2e4);
    let answer = material.advance_to_magnetization(state, state.magnetization_a_per_m, 2e4);
    assert!(answer.limited && answer.state.field_a_per_m == 2e4);
}
