//! Guards that the library's effects are those of an independent simulator, made in another language: with the true effect
//! and value the chain, driven by the command, leaves the sensor's noise of 20 nm and no more.
//!
//! The runs are not part of the project: see `anhyst_witness::shared`.

use std::path::Path;

use anhyst_model::{ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, simulate};
use anhyst_witness::shared;
use serde_json::Value;

const TICK_S: f64 = 1e-4;
/// Their noise is 20 nm; its rms over 40 001 samples is within 2 % of that.
const MAX_LEFT_M: f64 = 20.4e-9;

struct Run {
    command_a_per_m: Vec<f64>,
    displacement_m: Vec<f64>,
}

fn read(folder: &Path, name: &str) -> Run {
    let text = std::fs::read_to_string(folder.join(format!("{name}.csv"))).expect("the run");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    Run {
        command_a_per_m: rows.iter().map(|row| row[1]).collect(),
        displacement_m: rows.iter().map(|row| row[3]).collect(),
    }
}

fn left_m(model: &ActuatorModel, run: &Run) -> f64 {
    let mut outputs = ActuatorOutputs::default();
    simulate(
        model,
        TICK_S,
        ActuatorInputs::commands(&run.command_a_per_m),
        &mut outputs,
    )
    .expect("a valid model");
    let square: f64 = outputs
        .displacement_m
        .iter()
        .zip(&run.displacement_m)
        .map(|(model, measured)| (model - measured) * (model - measured))
        .sum();
    (square / run.displacement_m.len() as f64).sqrt()
}

/// The nominal model with what a label says; none where the library has no such thing.
fn amended(name: &str, truth: &Value) -> Option<ActuatorModel> {
    let number = |key: &str| truth[key].as_f64().expect("a number");
    let nominal = ActuatorModel::terfenol_d();
    if name == "parameter_k" {
        let mut changed = nominal;
        changed.material.hysteresis.pinning_a_per_m = number("k");
        return Some(changed);
    }
    let effect = Effect::typical(EffectKind::from_name(name)?);
    // Their key of the truth, and our parameter.
    let keys: &[(&str, &str)] = match effect.kind() {
        EffectKind::EddyCurrent => &[("tau_s", "time_constant_s")],
        EffectKind::AfterEffect => &[("fraction", "fraction")],
        EffectKind::ThermalDrift => &[("rate", "heating_k_per_s")],
        EffectKind::Backlash => &[("gap_m", "gap_m")],
        EffectKind::SecondMode => &[("gain", "gain"), ("hz", "frequency_hz")],
        EffectKind::AmplifierSlew => &[("rate", "slew_limit_a_per_m_s")],
        EffectKind::SensorDelay => &[("s", "delay_s")],
        EffectKind::Friction => &[("equiv_m", "friction_m")],
        _ => return None,
    };
    let effect = keys.iter().fold(effect, |effect, (key, parameter)| {
        effect.with(parameter, number(key)).expect("within its bounds")
    });
    Some(nominal.with_effect(effect))
}

#[test]
fn the_true_effect_leaves_the_noise() {
    let Some(folder) = shared("hidden") else { return };
    let labels = std::fs::read_to_string(folder.join("labels.json")).expect("labels");
    let labels: Value = serde_json::from_str(&labels).expect("JSON");
    let mut wrong = Vec::new();
    for (name, label) in labels.as_object().expect("cases") {
        let run = read(&folder, name);
        let effects: Vec<&str> = label["effects"]
            .as_array()
            .expect("effects")
            .iter()
            .filter_map(Value::as_str)
            .collect();
        let nominal_m = left_m(&ActuatorModel::terfenol_d(), &run);
        let mut model = Some(ActuatorModel::terfenol_d());
        for effect in effects.iter().filter(|&&effect| effect != "none") {
            let own = &label["truth"][effect];
            let truth = if own.is_null() { &label["truth"] } else { own };
            model = amended(effect, truth).zip(model).map(|(one, others)| {
                others
                    .effects
                    .iter()
                    .fold(one, |model, effect| model.with_effect(*effect))
            });
        }
        let amended_m = model.map(|model| left_m(&model, &run));
        println!(
            "{name} {:28} nominal {:8.2} nm, amended {}",
            effects.join(" + "),
            1e9 * nominal_m,
            amended_m.map_or(String::from("-"), |left| format!("{:6.2} nm", 1e9 * left))
        );
        if amended_m.is_some_and(|left| left > MAX_LEFT_M) {
            wrong.push(name.clone());
        }
    }
    assert!(wrong.is_empty(), "more than the noise is left in {wrong:?}");
}
