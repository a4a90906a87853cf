//! Guards ∂M/∂θ: the same magnetization as without, and the derivatives that differences of neighbouring models give.

mod common;

use anhyst_model::{Anhysteretic, Hysteresis, HysteresisParameter, MagneticState, SensitiveState};
use proptest::prelude::*;

fn materials() -> impl Strategy<Value = Hysteresis> {
    let plain = (common::curves(), 1e5..1.5e6, 1e3..3e4, 0.05..3.0, -1.0..0.7, 0.01..0.8);
    (plain, common::cubic_shares())
        .prop_map(|(plain, cubic)| common::with_cubic(common::drawn(plain), cubic))
        .prop_filter("valid", |material| material.validate().is_ok())
}

/// Turning points as multiples of a + k; the way between them is made in some 20 steps.
fn fields(material: &Hysteresis, turns: &[f64]) -> Vec<f64> {
    let scale = material.shape_a_per_m + material.pinning_a_per_m;
    let mut from = 0.0;
    let mut fields = Vec::new();
    for turn in turns {
        for part in 1..=20 {
            fields.push(scale * (from + (turn - from) * f64::from(part) / 20.0));
        }
        from = *turn;
    }
    fields
}

/// How much a parameter is moved for a difference, in its unit.
fn reach(material: &Hysteresis, parameter: HysteresisParameter) -> f64 {
    match parameter {
        HysteresisParameter::Coupling => 1e-4 * material.shape_a_per_m / material.saturation_magnetization_a_per_m,
        HysteresisParameter::Reversibility => 1e-4,
        _ => 1e-4 * parameter.of(material),
    }
}

/// Central differences of magnetization over all fields, extrapolated from two reaches: error of the order of reach⁴. With
/// each, what the two reaches differ by: where δ̂ switches within the reach, the slope has a kink there, and the error is of
/// that size.
fn differences(material: &Hysteresis, fields: &[f64], parameter: HysteresisParameter) -> Vec<(f64, f64)> {
    let run = |part: f64| {
        let moved = parameter.with(*material, parameter.of(material) + part * reach(material, parameter));
        let mut state = MagneticState::default();
        fields
            .iter()
            .map(|field| {
                state = moved.advance(state, *field);
                state.magnetization_a_per_m
            })
            .collect::<Vec<f64>>()
    };
    let [wide_up, wide_down, up, down] = [2.0, -2.0, 1.0, -1.0].map(run);
    (0..fields.len())
        .map(|step| {
            let wide = (wide_up[step] - wide_down[step]) / 4.0 / reach(material, parameter);
            let narrow = (up[step] - down[step]) / 2.0 / reach(material, parameter);
            (narrow + (narrow - wide) / 3.0, (narrow - wide).abs())
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    // Guards that nothing but derivatives is added: bit for bit the same magnetization, on every way, reversal and step
    // length.
    #[test]
    fn the_value_is_that_of_advance(material in materials(), turns in prop::collection::vec(-4.0..4.0, 1..12), parts in 1..30_usize) {
        let mut plain = MagneticState::default();
        let mut sensitive = SensitiveState::default();
        for field in fields(&material, &turns).into_iter().step_by(parts) {
            plain = material.advance(plain, field);
            sensitive = material.advance_with_sensitivities(sensitive, field);
            prop_assert_eq!(plain, sensitive.magnetic());
        }
    }

    // Guards every derivative on random loops, minor ones among them.
    #[test]
    fn derivatives_are_those_of_neighbouring_models(material in materials(), turns in prop::collection::vec(-3.0..3.0, 1..8)) {
        let fields = fields(&material, &turns);
        let mut state = SensitiveState::default();
        let exact: Vec<SensitiveState> = fields
            .iter()
            .map(|field| {
                state = material.advance_with_sensitivities(state, *field);
                state
            })
            .collect();
        for parameter in HysteresisParameter::ALL {
            let expected = differences(&material, &fields, parameter);
            let largest = expected.iter().fold(0.0_f64, |most, (value, _)| most.max(value.abs()));
            let mut worst = 0.0_f64;
            for (state, (expected, doubt)) in exact.iter().zip(expected) {
                worst = worst.max((state.derivatives[parameter.index()] - expected).abs() - doubt);
            }
            prop_assert!(worst <= 2e-5 * largest, "{:?}: {} of {}", parameter, worst, largest);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    // Guards continuity over reversals and over the switch of δ̂: on one way back and forth no derivative jumps.
    #[test]
    fn derivatives_are_continuous_in_the_end_field(material in materials(), turns in prop::collection::vec(-3.0..3.0, 3)) {
        let scale = material.shape_a_per_m + material.pinning_a_per_m;
        let mut state = SensitiveState::default();
        for turn in &turns[..2] {
            state = material.advance_with_sensitivities(state, turn * scale);
        }
        let parts = 2000;
        let ends: Vec<SensitiveState> = (0..=parts)
            .map(|part| {
                let field = scale * (turns[1] + (turns[2] - turns[1]) * f64::from(part) / f64::from(parts));
                material.advance_with_sensitivities(state, field)
            })
            .collect();
        for parameter in HysteresisParameter::ALL.map(HysteresisParameter::index) {
            let largest = ends.iter().fold(0.0_f64, |most, end| most.max(end.derivatives[parameter].abs()));
            for pair in ends.windows(2) {
                let jump = (pair[1].derivatives[parameter] - pair[0].derivatives[parameter]).abs();
                prop_assert!(jump <= 0.05 * largest, "{} of {} at {:?}", jump, largest, pair[1]);
            }
        }
    }
}

// Guards one long way against many short ones: the same derivatives, up to the error of the steps.
#[test]
fn one_way_in_one_call_or_in_many() {
    for anhysteretic in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        for name in common::MATERIALS {
            let material = common::material(anhysteretic, name);
            let (mut whole, mut pieces) = (SensitiveState::default(), SensitiveState::default());
            for turn in [3.0, -0.5, 1.0, -2.0, 0.1] {
                let to = turn * material.shape_a_per_m;
                whole = material.advance_with_sensitivities(whole, to);
                let from = pieces.field_a_per_m;
                for part in 1..=1000 {
                    let field = from + (to - from) * f64::from(part) / 1000.0;
                    pieces = material.advance_with_sensitivities(pieces, field);
                }
                for (one, many) in whole.derivatives.iter().zip(pieces.derivatives) {
                    let scale = 1.0 + one.abs();
                    assert!(
                        (one - many).abs() < 1e-4 * scale,
                        "{anhysteretic:?} {name}: {one} {many}"
                    );
                }
            }
        }
    }
}

// Guards the closed form at rest: with c = 0 and no walls moved yet nothing depends on anything; a broken field is not
// hidden.
#[test]
fn special_cases() {
    let material = Hysteresis::terfenol_d();
    let state = material.advance_with_sensitivities(SensitiveState::default(), 5e3);
    // A field that rests leaves everything but the mean excess, which is that of the way from sample to sample.
    let resting = SensitiveState {
        mean_excess_a_per_m: 0.0,
        mean_excess_derivatives: [0.0; HysteresisParameter::COUNT],
        ..state
    };
    assert_eq!(material.advance_with_sensitivities(state, 5e3), resting);
    let broken = material.advance_with_sensitivities(state, f64::NAN);
    assert!(broken.magnetization_a_per_m.is_nan() && broken.derivatives.iter().all(|value| value.is_nan()));
    let hard = HysteresisParameter::Reversibility.with(material, 0.0);
    let risen = hard.advance_with_sensitivities(SensitiveState::default(), 5e3);
    let back = hard.advance_with_sensitivities(risen, 4.9e3);
    // Without reversible bending M stays where it is after a reversal, and so do its derivatives, but for the one by c.
    assert_eq!(back.magnetization_a_per_m, risen.magnetization_a_per_m);
    assert_eq!(back.derivatives[..4], risen.derivatives[..4]);
    // Far in saturation M is Ms up to a/H.
    let far = material.advance_with_sensitivities(state, 7012e3);
    assert!((far.derivatives[0] - 1.0).abs() < 2e-2, "{far:?}");
}

// Guards the list that every array of five is ordered by.
#[test]
fn parameters_by_name() {
    let material = Hysteresis::terfenol_d();
    for (index, parameter) in HysteresisParameter::ALL.into_iter().enumerate() {
        assert_eq!(parameter.index(), index);
        assert_eq!(parameter.of(&material), material.parameters()[index]);
        let other = parameter.with(material, 0.5);
        assert_eq!(parameter.of(&other), 0.5);
        assert_eq!(parameter.with(other, parameter.of(&material)), material);
    }
    let symbols = HysteresisParameter::ALL.map(HysteresisParameter::symbol);
    assert_eq!(symbols, ["Ms", "a", "k", "alpha", "c"]);
}
