//! Guards the inverse alone: the demand is met where it can be, the limit holds, and no input breaks the output.

use super::*;
use proptest::prelude::*;

const LIMIT: f64 = 30_000.0;

fn inverse(structure: Structure) -> Inverse {
    let settings = InverseSettings {
        structure,
        field_limit_a_per_m: Some(LIMIT),
        compensate_amplifier: true,
        drive: None,
        drives: Vec::new(),
    };
    let amplifier = AmplifierConstants {
        bandwidth_hz: Some(2000.0),
        ..AmplifierConstants::default()
    };
    Inverse::new(&settings, Hysteresis::terfenol_d(), &amplifier, f64::INFINITY).unwrap()
}

/// ±40 µm at 50 Hz plus 30 % at 150 Hz as a magnetization, at 20 kHz.
fn demand(k: u64) -> MagnetizationDemand {
    let (t, w) = (5e-5 * k as f64, 2.0 * std::f64::consts::PI * 50.0);
    let ((s1, c1), (s3, c3)) = ((w * t).sin_cos(), (3.0 * w * t).sin_cos());
    MagnetizationDemand {
        magnetization_a_per_m: 1.87e5 * (s1 + 0.3 * s3),
        magnetization_rate_a_per_m_s: 1.87e5 * w * (c1 + 0.9 * c3),
    }
}

// Guards timing and inversion together: with an exact model and an ideal amplifier the magnetization at t_k+2 is the demand
// of tick k. The plant here is the model itself, one tick of computing delay included.
#[test]
fn the_demand_is_met_two_ticks_later() {
    let nominal = Hysteresis::terfenol_d();
    meets_the_demand(nominal, None);
    let others = OtherParameters {
        saturation_magnetization_a_per_m: 7.5e5,
        pinning_a_per_m: 4500.0,
        coupling: -0.012,
        reversibility: 0.2,
    };
    let estimated = Hysteresis {
        saturation_magnetization_a_per_m: 7.5e5,
        pinning_a_per_m: 4500.0,
        coupling: -0.012,
        reversibility: 0.2,
        ..nominal
    };
    meets_the_demand(estimated, Some(others));
}

/// With a plant of this material, the inverse knowing the paper's and what is estimated beside `a`.
fn meets_the_demand(model: Hysteresis, others: Option<OtherParameters>) {
    let settings = InverseSettings {
        field_limit_a_per_m: Some(LIMIT),
        ..InverseSettings::default()
    };
    let nominal = Hysteresis::terfenol_d();
    let mut inverse = Inverse::new(&settings, nominal, &AmplifierConstants::default(), 2.0 * LIMIT).unwrap();
    let (mut state, mut on_its_way) = (MagneticState::default(), 0.0);
    let mut due = [0.0; 2];
    for k in 0..2000 {
        let error = (state.magnetization_a_per_m - due[0]).abs();
        assert!(k < 2 || error <= 1e-6 * 1.87e5, "tick {k}: {error} A/m");
        let known = StateEstimate {
            shape_a_per_m: model.shape_a_per_m,
            others,
            state,
            next_field_a_per_m: on_its_way,
        };
        let wanted = demand(k + 2);
        let command = inverse.step(wanted, known);
        assert!(!command.limited);
        due = [due[1], wanted.magnetization_a_per_m];
        state = model.advance(state, on_its_way);
        on_its_way = command.field_a_per_m;
    }
}

// Guards the limit: a demand beyond saturation is clamped and reported, and the lead adds nothing to it.
#[test]
fn an_impossible_demand_is_clamped_and_reported() {
    for structure in [Structure::FromEstimate, Structure::OwnMemory, Structure::Gain] {
        let mut inverse = inverse(structure);
        let wanted = MagnetizationDemand {
            magnetization_a_per_m: -2e6,
            magnetization_rate_a_per_m_s: -1e9,
        };
        let known = StateEstimate {
            shape_a_per_m: 7012.0,
            ..StateEstimate::default()
        };
        let command = inverse.step(wanted, known);
        assert!(command.limited, "{structure:?}");
        assert_eq!(
            (command.field_a_per_m, command.coil_field_a_per_m),
            (-LIMIT, -LIMIT),
            "{structure:?}"
        );
    }
}

// Guards a broken estimator or controller: their last good tick's command stays.
#[test]
fn unusable_inputs_keep_the_last_command() {
    let mut inverse = inverse(Structure::FromEstimate);
    let known = StateEstimate {
        shape_a_per_m: 7012.0,
        ..StateEstimate::default()
    };
    let good = inverse.step(
        MagnetizationDemand {
            magnetization_a_per_m: 5e4,
            magnetization_rate_a_per_m_s: 1e6,
        },
        known,
    );
    assert!(good.field_a_per_m > 0.0);
    let wanted = MagnetizationDemand {
        magnetization_a_per_m: f64::NAN,
        ..MagnetizationDemand::default()
    };
    assert_eq!(inverse.step(wanted, known), good);
    for broken in [
        StateEstimate {
            shape_a_per_m: f64::NAN,
            ..known
        },
        StateEstimate {
            shape_a_per_m: 0.0,
            ..known
        },
        StateEstimate {
            next_field_a_per_m: f64::INFINITY,
            ..known
        },
        StateEstimate {
            state: MagneticState {
                magnetization_a_per_m: f64::NAN,
                ..known.state
            },
            ..known
        },
    ] {
        assert_eq!(inverse.step(MagnetizationDemand::default(), broken), good);
    }
}

// Guards settings: the sentence has the value.
#[test]
fn refusals_say_the_value() {
    let settings = InverseSettings {
        field_limit_a_per_m: Some(-3.0),
        ..InverseSettings::default()
    };
    assert!(
        settings
            .validate()
            .unwrap_err()
            .to_string()
            .contains("field_limit_a_per_m: -3 A/m")
    );
    assert!(serde_json::from_str::<InverseSettings>(r#"{"limit":1}"#).is_err());
}

fn any_bits() -> impl Strategy<Value = f64> {
    // Random bit patterns are mostly huge or tiny; mix in numbers of the size that the loop has, and neighbours of the limits.
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        -1e6..1e6_f64,
        Just(f64::NAN),
        Just(7012.0),
        Just(0.0)
    ]
}

proptest! {
    #[test]
    fn any_bit_pattern_gives_a_finite_field_within_the_limit(
        words in prop::collection::vec(prop::array::uniform6(any_bits()), 1..6),
        structure in prop_oneof![Just(Structure::FromEstimate), Just(Structure::OwnMemory), Just(Structure::Gain)],
    ) {
        let mut inverse = inverse(structure);
        for [shape, field, magnetization, next, demand, rate] in words {
            let known = StateEstimate {
                others: None,
                shape_a_per_m: shape,
                state: MagneticState { field_a_per_m: field, magnetization_a_per_m: magnetization },
                next_field_a_per_m: next,
            };
            let wanted = MagnetizationDemand { magnetization_a_per_m: demand, magnetization_rate_a_per_m_s: rate };
            let command = inverse.step(wanted, known);
            prop_assert!(command.field_a_per_m.abs() <= LIMIT && command.coil_field_a_per_m.abs() <= LIMIT);
            prop_assert!(command.reached_magnetization_a_per_m.is_finite());
            prop_assert!(command.start_magnetization_a_per_m.is_finite());
        }
    }
}

// Guards against an estimate gone astray: what no material is, or one ten times the believed, is not inverted.
#[test]
fn parameters_that_are_no_material_are_not_believed() {
    let known = |pinning_a_per_m: f64, reversibility: f64| StateEstimate {
        shape_a_per_m: 7012.0,
        others: Some(OtherParameters {
            saturation_magnetization_a_per_m: 7.65e5,
            pinning_a_per_m,
            coupling: -0.01,
            reversibility,
        }),
        ..StateEstimate::default()
    };
    let mut own = inverse(Structure::FromEstimate);
    let before = own.step(demand(100), known(4000.0, 0.18));
    assert_ne!(before, Command::default());
    for broken in [
        known(f64::NAN, 0.18),
        known(0.0, 0.18),
        known(4e5, 0.18),
        known(4000.0, 1.5),
        known(4000.0, f64::NAN),
    ] {
        assert_eq!(own.step(demand(300), broken), before, "{broken:?}");
    }
}
