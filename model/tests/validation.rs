//! Guards the refusals: a parameter set is valid only if the slope stays finite and positive for every reachable state.

mod common;

use anhyst_model::{
    ActuatorModel, Anhysteretic, Bank, Hysteresis, MagneticState, Magnetostriction, ModelError, NominalParameter,
};

fn set(shape: f64, pinning: f64, coupling: f64, reversibility: f64, saturation: f64) -> Hysteresis {
    Hysteresis {
        anhysteretic: Anhysteretic::Langevin,
        saturation_magnetization_a_per_m: saturation,
        shape_a_per_m: shape,
        pinning_a_per_m: pinning,
        coupling,
        reversibility,
        cubic_coupling_m2_per_a2: 0.0,
    }
}

#[test]
fn published_sets_are_accepted() {
    for material in [
        Hysteresis::terfenol_d(),
        set(560.0, 1200.0, 7e-4, 0.1, 1.6e6),
        set(27.0, 30.0, 5e-5, 0.55, 3.5e5),
        set(20.0, 30.0, 2e-5, 0.2, 1.3e6),
        set(1100.0, 400.0, 1.6e-3, 0.2, 1.7e6),
        set(10.0, 5.0, 1e-6, 0.1, 6e5),
        set(29639.0, 96544.0, 0.046, 0.07, 1.58e6),
        set(8366.0, 7054.0, 0.0088, 0.43, 6.46e5),
    ] {
        material.validate().expect("published set");
    }
    for curve in common::reference_curves() {
        curve.hysteresis.validate().expect("reference material");
    }
}

#[test]
fn folded_anhysteretic_is_refused_with_its_numbers() {
    // The set of a vendor's example: αMs/3a = 1.18.
    let error = set(108.7, 177.6, 2.94e-4, 0.21, 1.31e6).validate().expect_err("folds");
    assert!(matches!(error, ModelError::AnhystereticFolds { product, .. } if (product - 1.181).abs() < 1e-3));
    println!("{error}");
    assert!(error.to_string().contains("must stay below 1"));
    // Strong pinning does not help.
    assert!(set(101.0, 1e5, 3e-4, 0.1, 1.0e6).validate().is_ok());
    assert!(set(99.0, 1e5, 3e-4, 0.1, 1.0e6).validate().is_err());
}

#[test]
fn overcome_pinning_is_refused_and_would_have_been_singular() {
    // Below αMs/3a = 1, but an Ising curve is three times as steep.
    let material = Hysteresis {
        anhysteretic: Anhysteretic::Ising,
        ..set(5000.0, 2000.0, 0.012, 0.1, 7.65e5)
    };
    let error = material.validate().expect_err("pinning overcome");
    println!("{error}");
    assert!(matches!(error, ModelError::PinningOvercome { .. }));
    let mut state = MagneticState::default();
    for step in 1..=60 {
        state = material.advance(state, 100.0 * f64::from(step));
    }
    let share = state.magnetization_a_per_m / material.saturation_magnetization_a_per_m;
    println!(
        "what it would have done by 6 kA/m: M = {share:.2} Ms, slope {:.0}",
        material.slope(state, true)
    );
    assert!(!(0.0..1.0).contains(&share), "the refused set was harmless");
}

#[test]
fn pinning_that_is_all_but_overcome_is_refused_and_would_have_run_away() {
    // α(Man − Mirr) gets to 0.99993 k: finite along the equation, but not in steps.
    let material = Hysteresis {
        anhysteretic: Anhysteretic::Ising,
        ..set(7012.0, 4000.0, 0.01, 0.487, 7.65e5)
    };
    assert!(matches!(material.validate(), Err(ModelError::PinningOvercome { .. })));
    let mut largest = 0.0_f64;
    for parts in 1..=200 {
        let mut state = MagneticState::default();
        for end in [3e4, -3e4, 3e4] {
            let from = state.field_a_per_m;
            for part in 1..=parts {
                state = material.advance(state, from + (end - from) * f64::from(part) / f64::from(parts));
                largest = largest.max(state.magnetization_a_per_m.abs());
            }
        }
    }
    assert!(
        largest > 2.0 * material.saturation_magnetization_a_per_m,
        "the refused set was harmless"
    );
}

#[test]
fn numbers_out_of_range_are_named() {
    let good = Hysteresis::terfenol_d();
    for (bad, name) in [
        (
            Hysteresis {
                saturation_magnetization_a_per_m: 0.0,
                ..good
            },
            "saturation magnetization",
        ),
        (
            Hysteresis {
                shape_a_per_m: -7012.0,
                ..good
            },
            "shape a is -7012 A/m",
        ),
        (
            Hysteresis {
                pinning_a_per_m: f64::NAN,
                ..good
            },
            "pinning k is NaN A/m",
        ),
        (
            Hysteresis {
                coupling: f64::INFINITY,
                ..good
            },
            "coupling alpha",
        ),
        (
            Hysteresis {
                reversibility: 1.0,
                ..good
            },
            "reversibility c is 1",
        ),
        (
            Hysteresis {
                reversibility: -0.1,
                ..good
            },
            "reversibility c is -0.1",
        ),
    ] {
        let message = bad.validate().expect_err(name).to_string();
        assert!(message.contains(name), "{message}");
    }
}

#[test]
fn banks_refuse_what_their_members_would() {
    assert!(matches!(
        Bank::new(Hysteresis::terfenol_d(), &[]),
        Err(ModelError::TooFew { .. })
    ));
    assert!(Bank::new(Hysteresis::terfenol_d(), &[7000.0, 0.0]).is_err());
    assert!(Bank::new(set(1100.0, 400.0, 1.6e-3, 0.2, 1.7e6), &[1100.0, 900.0]).is_err());
}

/// A material of which only the magnetization was measured drives no rod, and has no constant of a strain law to calibrate.
#[test]
fn a_material_without_a_strain_law_moves_nothing() {
    let mut model = ActuatorModel::terfenol_d();
    model.material.magnetostriction = Magnetostriction::Unmeasured;
    assert_eq!(model.validate(), Err(ModelError::NoStrainLaw));
    assert_eq!(model.material.validate(), Err(ModelError::NoStrainLaw));
    model.rod = None;
    assert_eq!(model.validate(), Ok(()));
    assert_eq!(NominalParameter::Gain.spec(&model), None);
    model.material.hysteresis.pinning_a_per_m = -1.0;
    assert!(model.validate().is_err());
}
