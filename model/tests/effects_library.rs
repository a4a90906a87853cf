//! Guards the library's words and numbers: names, bounds, files, refusals, and the table in `docs/effects.md`.

use std::collections::HashSet;

use anhyst_model::{
    Actuator, ActuatorModel, Effect, EffectKind, Material, ModelError, ParameterRole, ParameterSpec, Stage,
};

/// The names that reports and other crates know; a rename must be meant.
const NAMES: [&str; 26] = [
    "loop_delay",
    "amplifier_saturation",
    "amplifier_slew",
    "amplifier_bandwidth",
    "coil_heating",
    "eddy_current",
    "bias_shift",
    "excess_loss",
    "thermal_drift",
    "prestress",
    "accommodation",
    "after_effect",
    "quadratic_magnetostriction",
    "thermal_expansion",
    "load_change",
    "delta_e",
    "stiffening",
    "friction",
    "periodic_disturbance",
    "backlash",
    "second_mode",
    "sensor_delay",
    "sensor_gain",
    "sensor_drift",
    "sensor_saturation",
    "quantisation",
];

/// Guards reports and saved verdicts, which hold names.
#[test]
fn names_are_those_that_reports_use() {
    assert_eq!(EffectKind::ALL.map(EffectKind::name), NAMES);
    for kind in EffectKind::ALL {
        assert_eq!(EffectKind::from_name(kind.name()), Some(kind));
        assert_eq!(
            serde_json::to_string(&kind).unwrap(),
            format!("\"{}\"", kind.name()),
            "name and serde agree"
        );
    }
    assert_eq!(EffectKind::from_name("flux_capacitor"), None);
}

/// Guards the order in which the chain applies effects: the order of the list, which must not run against the stages.
#[test]
fn kinds_stand_in_the_order_of_the_chain() {
    assert!(EffectKind::ALL.is_sorted_by_key(|kind| kind.stage()));
    assert!(
        EffectKind::ALL
            .into_iter()
            .all(|kind| kind.needs_rod() == (kind.stage() == Stage::Rod))
    );
}

/// Guards fitters, which start from these numbers: bounds in order, typical and identity inside, at least one size.
#[test]
fn parameters_are_usable_as_they_stand() {
    for kind in EffectKind::ALL {
        let mut own = HashSet::new();
        for parameter in kind.parameters() {
            let ParameterSpec {
                name,
                lower,
                upper,
                typical,
                logarithmic,
                ..
            } = *parameter;
            let what = format!("{} {name}", kind.name());
            assert!(own.insert(name), "{what} twice");
            assert!(lower < upper && lower.is_finite() && upper.is_finite(), "{what}");
            assert!((lower..=upper).contains(&typical), "{what}");
            assert!(!logarithmic || (lower >= 0.0 && typical > 0.0), "{what}");
            if let Some(identity) = parameter.identity() {
                assert!((lower..=upper).contains(&identity), "{what}");
            }
        }
        assert!(
            kind.parameters()[0].identity().is_some(),
            "{} begins with its size",
            kind.name()
        );
        let row = kind.description();
        for words in [row.summary, row.signature, row.source] {
            assert!(!words.is_empty() && !words.contains("  "), "{}: {words}", kind.name());
        }
        for other in row.confused_with {
            let known = EffectKind::from_name(other).is_some() || other.starts_with("parameter_");
            assert!(known && *other != kind.name(), "{}: {other}", kind.name());
        }
        Effect::typical(kind).validate().unwrap();
        Effect::identity(kind).validate().unwrap();
        assert!(Effect::identity(kind).is_absent() && !Effect::typical(kind).is_absent());
    }
}

/// Guards model files: what is written is read again, bit for bit, in RON and in JSON.
#[test]
fn a_file_keeps_every_effect() {
    for kind in EffectKind::ALL {
        let mut effect = Effect::typical(kind);
        for (value, parameter) in effect.values_mut().iter_mut().zip(kind.parameters()) {
            *value = parameter.lower + (parameter.upper - parameter.lower) / 3.0;
        }
        let model = ActuatorModel::terfenol_d().with_effect(effect);
        let text = ron::to_string(&model).unwrap();
        assert_eq!(ron::from_str::<ActuatorModel>(&text).unwrap(), model, "{text}");
        let text = serde_json::to_string(&model).unwrap();
        assert_eq!(serde_json::from_str::<ActuatorModel>(&text).unwrap(), model, "{text}");
    }
}

/// Guards the notation that users write, and its refusals.
#[test]
fn effects_are_written_as_one_would_say_them() {
    let eddy: Effect = ron::from_str("EddyCurrent(time_constant_s: 1.8e-4)").unwrap();
    assert_eq!(eddy, Effect::new(EffectKind::EddyCurrent, &[1.8e-4]).unwrap());
    assert_eq!(
        ron::to_string(&eddy).unwrap(),
        "EddyCurrent(time_constant_s:0.00018,diffusion:0.0)"
    );
    // What data hardly fix may be left out.
    let creep: Effect = ron::from_str("AfterEffect(fraction: 0.03)").unwrap();
    assert_eq!(creep.values(), [0.03, 0.03, 3.0]);
    let refused = |text: &str, word: &str| {
        let refusal = ron::from_str::<Effect>(text).unwrap_err().to_string();
        assert!(refusal.contains(word), "{text}: {refusal}");
    };
    refused("EddyCurrent(time_constant_s: 1e-4, color: 3.0)", "color");
    refused("EddyCurrent()", "time_constant_s");
    refused("SecondMode(gain: 0.1)", "frequency_hz");
    refused(
        "EddyCurrent(time_constant_s: 1e-4, time_constant_s: 2e-4)",
        "time_constant_s",
    );
    refused("EddyCurent(time_constant_s: 1e-4)", "EddyCurent");
    refused("EddyCurrent(time_constant_s: \"long\")", "");
}

/// Guards the least that a model file needs, and that it refuses what it does not know.
#[test]
fn a_model_file_may_be_short() {
    let material = ron::to_string(&Material::terfenol_d()).unwrap();
    let text = format!("(name: \"bar\", source: \"none\", material: {material})");
    let model: ActuatorModel = ron::from_str(&text).unwrap();
    model.validate().unwrap();
    assert!(model.rod.is_none() && model.effects.is_empty());
    assert_eq!(model.ambient_temperature_k, 293.0);
    assert!(ron::from_str::<ActuatorModel>(&text.replace("name:", "nome:")).is_err());
    let rod = "(rod: Some((gain: 1.3724e-2, damping_per_s: 7889.9, stiffness_per_s2: 6.4251e7)), name";
    let model: ActuatorModel = ron::from_str(&text.replacen("(name", rod, 1)).unwrap();
    assert_eq!(model.rod, ActuatorModel::terfenol_d().rod);
}

/// Guards the sentence of a refusal: value, limits and unit, for every parameter on both sides and for not-a-number.
#[test]
fn values_outside_their_bounds_are_refused_in_a_sentence() {
    for kind in EffectKind::ALL {
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let ParameterSpec { lower, upper, .. } = *parameter;
            let width = upper - lower;
            for wrong in [lower - 0.01 * width, upper + 0.01 * width, f64::NAN] {
                let mut effect = Effect::typical(kind);
                effect.values_mut()[index] = wrong;
                let refusal = effect.validate().unwrap_err();
                let sentence = refusal.to_string();
                for part in [
                    kind.name(),
                    parameter.name,
                    &wrong.to_string(),
                    &lower.to_string(),
                    &upper.to_string(),
                    parameter.unit,
                ] {
                    assert!(sentence.contains(part), "{part} in: {sentence}");
                }
                let model = ActuatorModel::terfenol_d().with_effect(effect);
                assert_eq!(
                    model.validate().map_err(|other| other.to_string()),
                    Err(sentence),
                    "the model refuses it alike"
                );
            }
            for right in [lower, upper] {
                let mut effect = Effect::typical(kind);
                effect.values_mut()[index] = right;
                effect.validate().unwrap();
            }
        }
    }
    let sentence = Effect::new(EffectKind::EddyCurrent, &[0.5]).unwrap_err().to_string();
    assert_eq!(
        sentence,
        "time_constant_s of eddy_current is 0.5 s, but must be between 0 and 0.02 s"
    );
}

/// Guards what effects need: each one once, a rod for what acts on it, time for what takes time.
#[test]
fn what_does_not_go_together_is_refused() {
    let typical = Effect::typical;
    let mut model = ActuatorModel::terfenol_d();
    model.effects = vec![typical(EffectKind::EddyCurrent); 2];
    assert_eq!(
        model.validate(),
        Err(ModelError::EffectRepeated { effect: "eddy_current" })
    );
    for kind in EffectKind::ALL {
        let mut model = ActuatorModel::terfenol_d().with_effect(typical(kind));
        let still = Actuator::quasi_static(&model);
        assert_eq!(still.is_err(), kind.needs_time(), "{}", kind.name());
        if let Err(refusal) = still {
            assert_eq!(refusal, ModelError::EffectNeedsTime { effect: kind.name() });
        }
        model.rod = None;
        let refusal = model.validate().err();
        let expected = ModelError::EffectNeedsRod { effect: kind.name() };
        assert_eq!(refusal, kind.needs_rod().then_some(expected));
    }
    // b₃ Ms² of 0.17 joins α, with a susceptibility near 20 where M is half of Ms.
    let folding = Effect::new(EffectKind::Prestress, &[1e-13 * 3.0]).unwrap();
    let refusal = ActuatorModel::terfenol_d().with_effect(folding).validate();
    assert!(matches!(refusal, Err(ModelError::PrestressFolds { .. })), "{refusal:?}");
    assert!(
        Effect::new(EffectKind::EddyCurrent, &[1e-4, 1.0, 0.0]).is_err()
            && Effect::new(EffectKind::EddyCurrent, &[]).is_err()
    );
    assert!(Effect::typical(EffectKind::EddyCurrent).with("tau", 1.0).is_err());
    let model = ActuatorModel::terfenol_d();
    assert!(Actuator::new(&model, 0.0).is_err() && Actuator::new(&model, f64::INFINITY).is_err());
}

/// As one would write it.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// The table of `docs/effects.md`, from the library.
fn table() -> String {
    let mut rows = vec![
        String::from("| effect | acts on | parameters | how it shows | confused with |"),
        String::from("|---|---|---|---|---|"),
    ];
    for kind in EffectKind::ALL {
        let parameters: Vec<String> = kind
            .parameters()
            .iter()
            .map(|parameter| {
                let unit = if parameter.unit.is_empty() {
                    String::new()
                } else {
                    format!(" {}", parameter.unit)
                };
                let role = match parameter.role {
                    ParameterRole::Size { identity } => format!("absent at {}", number(identity)),
                    ParameterRole::Shape => String::from("free"),
                    ParameterRole::Fixed => format!("{} unless told", number(parameter.typical)),
                };
                let (name, lower, upper) = (parameter.name, number(parameter.lower), number(parameter.upper));
                format!("`{name}` {lower} to {upper}{unit}, {role}")
            })
            .collect();
        let confused = kind.description().confused_with.join(", ");
        rows.push(format!(
            "| **{}**: {} | {} | {} | {} | {} |",
            kind.name(),
            kind.description().summary,
            kind.stage().name(),
            parameters.join("; "),
            kind.description().signature,
            if confused.is_empty() { "-" } else { &confused },
        ));
    }
    rows.join("\n")
}

/// Guards the user's table: it is the library's, word for word. On a failure the right table is printed.
#[test]
fn the_documented_table_is_true() {
    let file = format!("{}/../docs/effects.md", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&file).unwrap_or_default();
    let table = table();
    if !text.contains(&table) {
        println!("{table}");
        panic!("docs/effects.md does not hold the table above");
    }
}
