//! Guards the second diagnosis: an amended model is amended on, up or down, and an amendment is written whenever the gap shrinks.

use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, Verdict, amended_text, diagnose};
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{ActuatorModel, Effect, EffectKind};
use anhyst_witness::{Hidden, Material, Rig, excitation};

const TICK_S: f64 = 1e-4;

fn diagnosed(model: &ActuatorModel, rig: &Rig) -> Diagnosed {
    let record = rig.record(TICK_S, excitation(TICK_S));
    let series = vec![
        (Quantity::FieldCommand, record.command_a_per_m),
        (Quantity::Field, record.field_a_per_m),
        (Quantity::Displacement, record.displacement_m),
    ];
    let run = MeasuredRun::in_memory("witness", Some(TICK_S), series).unwrap();
    let found = diagnose(model, &[run], &DiagnoseOptions::default(), &mut |_, _| ()).unwrap();
    println!("{}: {}", found.diagnosis.verdict.name(), found.diagnosis.sentence);
    found
}

fn lagging(time_constant_s: f64) -> (ActuatorModel, Rig) {
    let hidden = Hidden {
        eddy_current_s: time_constant_s,
        ..Hidden::default()
    };
    let effect = Effect::new(EffectKind::EddyCurrent, &[time_constant_s]).unwrap();
    (
        ActuatorModel::terfenol_d().with_effect(effect),
        Rig { hidden, ..Rig::NOMINAL },
    )
}

#[test]
fn an_effect_that_the_model_has_is_put_right_up_and_down() {
    for (believed, truth) in [(1.5e-4, 1.8e-4), (1.8e-4, 1.5e-4)] {
        let found = diagnosed(&lagging(believed).0, &lagging(truth).1);
        let effects = &found.diagnosis.effects;
        let names: Vec<&str> = effects.iter().map(|own| own.name.as_str()).collect();
        assert_eq!(
            (found.diagnosis.verdict, names),
            (Verdict::Named, vec!["eddy_current"]),
            "{}",
            found.diagnosis.sentence
        );
        let value = &effects[0].values[0];
        assert_eq!(value.nominal, Some(believed));
        assert!((value.value - truth).abs() < 0.01 * truth, "{value:?}");
        let amended = found.amended.effect(EffectKind::EddyCurrent).unwrap();
        assert_eq!(amended.values()[0], value.value);
        // From there on nothing is missing.
        let again = diagnosed(&found.amended, &lagging(truth).1).diagnosis;
        assert_eq!(
            (again.verdict, again.effects.len()),
            (Verdict::None, 0),
            "{}",
            again.sentence
        );
    }
}

/// Guards the loop's use of a diagnosis that names nothing: what it calibrated is written, with what is left in the head.
#[test]
fn what_shrinks_the_gap_is_written_though_nothing_is_named() {
    let nominal = ActuatorModel::terfenol_d();
    let off = Rig {
        material: Material {
            pinning_a_per_m: 4080.0,
            ..Material::TERFENOL_D
        },
        ..Rig::NOMINAL
    };
    let rippled = |material: Material, ripple: f64| Rig {
        material,
        hidden: Hidden {
            ripple,
            ..Hidden::default()
        },
        ..Rig::NOMINAL
    };
    let (alone, beside) = (rippled(Material::TERFENOL_D, 0.02), rippled(off.material, 0.005));
    for (rig, verdict) in [
        (off, Verdict::None),
        (alone, Verdict::Unknown),
        (beside, Verdict::Unknown),
    ] {
        let found = diagnosed(&nominal, &rig);
        assert_eq!(found.diagnosis.verdict, verdict, "{}", found.diagnosis.sentence);
        let shrinks = found.diagnosis.explained > 0.0;
        assert_eq!(found.amended.material != nominal.material, shrinks);
        // A ripple alone is no calibration's business.
        assert_eq!(shrinks, rig.material != Material::TERFENOL_D);
        let text = amended_text(&found.diagnosis, &found.amended).unwrap();
        assert_eq!(text.contains("% of the gap's energy; left: "), shrinks, "{text}");
        assert_eq!(text.contains("the model is as it was given"), !shrinks, "{text}");
        if verdict == Verdict::None {
            let pinning = found.amended.material.hysteresis.pinning_a_per_m;
            assert!((pinning - 4080.0).abs() < 0.01 * 4080.0, "{pinning} A/m");
        }
    }
}
