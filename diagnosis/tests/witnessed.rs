//! Guards what a diagnosis is for: it *names* what is hidden in runs of an actuator that shares no code with the model, and
//! names nothing where that is taken away again. Each run: 0.8 s at 10 kHz, 20 nm of noise, 1 A/m on the measured field.

use anhyst_diagnosis::{DiagnoseOptions, Diagnosis, Verdict, diagnose};
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::ActuatorModel;
use anhyst_witness::{Hidden, Material, Rig, Sensor, excitation};

const TICK_S: f64 = 1e-4;
const NOISE_M: f64 = 20e-9;

fn diagnosed(rig: &Rig) -> Diagnosis {
    let record = rig.record(TICK_S, excitation(TICK_S));
    let series = vec![
        (Quantity::FieldCommand, record.command_a_per_m),
        (Quantity::Field, record.field_a_per_m),
        (Quantity::Displacement, record.displacement_m),
    ];
    let run = MeasuredRun::in_memory("witness", Some(TICK_S), series).unwrap();
    let nominal = ActuatorModel::terfenol_d();
    let options = DiagnoseOptions::default();
    diagnose(&nominal, &[run], &options, &mut |_, _| ()).unwrap().diagnosis
}

fn hidden(hidden: Hidden) -> Rig {
    Rig { hidden, ..Rig::NOMINAL }
}

fn sensor(sensor: Sensor) -> Rig {
    Rig { sensor, ..Rig::NOMINAL }
}

/// Exactly these names, no tie; the held-out gap at the noise; each true value within a hundredth of its size.
fn assert_named(rig: &Rig, verdict: Verdict, truth: &[(&str, &str, f64)]) {
    let found = diagnosed(rig);
    println!("{}: {}", found.verdict.name(), found.sentence);
    let mut names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    names.sort_unstable();
    let expected: Vec<&str> = truth.iter().map(|(name, ..)| *name).collect();
    let ties = &found.ambiguous_with;
    assert_eq!(
        (found.verdict, names, ties.len()),
        (verdict, expected, 0),
        "{}; ties {ties:?}",
        found.sentence
    );
    assert!(
        found.gap_before > 3.0 * NOISE_M && found.gap_after < 1.1 * NOISE_M,
        "{}",
        found.sentence
    );
    for (name, number, value) in truth {
        let effect = found.effects.iter().find(|effect| effect.name == *name).unwrap();
        let fitted = effect.values.iter().find(|fitted| fitted.name == *number).unwrap();
        let error = (fitted.value - value).abs();
        assert!(error < 0.01 * value, "{name}: {fitted:?} instead of {value}");
    }
}

#[test]
fn a_lag_is_named_and_where_it_is() {
    let lag_s = 1.8e-4;
    let eddy_current = hidden(Hidden {
        eddy_current_s: lag_s,
        ..Hidden::default()
    });
    assert_named(
        &eddy_current,
        Verdict::Named,
        &[("eddy_current", "time_constant_s", lag_s)],
    );
    // The same lag before the coil is in the measured field, too.
    let amplifier = hidden(Hidden {
        amplifier_lag_s: lag_s,
        ..Hidden::default()
    });
    assert_named(
        &amplifier,
        Verdict::Named,
        &[("amplifier_bandwidth", "time_constant_s", lag_s)],
    );
}

#[test]
fn what_does_not_depend_on_the_rate_is_named() {
    let friction = hidden(Hidden {
        friction_m: 1.5e-6,
        ..Hidden::default()
    });
    assert_named(&friction, Verdict::Named, &[("friction", "friction_m", 1.5e-6)]);
    let pinning = Rig {
        material: Material {
            pinning_a_per_m: 3455.0,
            ..Material::TERFENOL_D
        },
        ..Rig::NOMINAL
    };
    assert_named(
        &pinning,
        Verdict::Parameter,
        &[("parameter_k", "pinning_a_per_m", 3455.0)],
    );
}

#[test]
fn a_sensor_is_named_as_one() {
    let late = sensor(Sensor {
        delay_s: 3.2e-4,
        ..Sensor::GOOD
    });
    assert_named(&late, Verdict::Sensor, &[("sensor_delay", "delay_s", 3.2e-4)]);
    let clipped = sensor(Sensor {
        limit_m: 30e-6,
        ..Sensor::GOOD
    });
    assert_named(&clipped, Verdict::Sensor, &[("sensor_saturation", "limit_m", 30e-6)]);
}

#[test]
fn a_pair_is_named_whole() {
    let pair = hidden(Hidden {
        eddy_current_s: 1.8e-4,
        creep: 0.03,
        ..Hidden::default()
    });
    let truth = [
        ("after_effect", "fraction", 0.03),
        ("eddy_current", "time_constant_s", 1.8e-4),
    ];
    assert_named(&pair, Verdict::Named, &truth);
}

/// Every case above with what is hidden taken away, under several seeds: no name is given for nothing.
#[test]
fn nothing_is_named_where_nothing_is_hidden() {
    for seed in 1..=3 {
        let found = diagnosed(&Rig { seed, ..Rig::NOMINAL });
        assert_eq!(found.verdict, Verdict::None, "seed {seed}: {}", found.sentence);
        assert!(
            found.effects.is_empty() && found.gap_after < 1.1 * NOISE_M,
            "{}",
            found.sentence
        );
    }
}

/// M(1 + r sin(M/30 kA/m)) is in no library, and must not be given a name that is.
#[test]
fn what_nobody_listed_is_unknown() {
    let found = diagnosed(&hidden(Hidden {
        ripple: 0.03,
        ..Hidden::default()
    }));
    assert_eq!(found.verdict, Verdict::Unknown, "{}", found.sentence);
    assert!(
        found.effects.is_empty() && found.unknown_term.is_some(),
        "{}",
        found.sentence
    );
    assert!(found.gap_before > 3.0 * NOISE_M, "{}", found.sentence);
}
