//! Guards that the estimator takes account of known effects: with the true `a` its prediction is what the chain's sensor
//! says.

use anhyst_estimator::{Estimator, EstimatorSettings, FieldSource, LawSettings, MinMaxSettings};
use anhyst_model::{
    Actuator, ActuatorInput, ActuatorModel, AmplifierConstants, Effect, EffectKind, rod_per_strain, with_known_effects,
};

const TICK_S: f64 = 5e-5;
/// The actuator begins settled under a constant field, the estimator at rest: its rod swings in for 80 of its time constants.
const SETTLED_TICKS: u64 = 400;

fn settings() -> EstimatorSettings {
    EstimatorSettings {
        law: LawSettings::FixedShape { shape_a_per_m: 7012.0 },
        ..EstimatorSettings::default()
    }
}

fn estimator(settings: &EstimatorSettings, effects: &[Effect]) -> Result<Estimator, String> {
    let model = ActuatorModel::terfenol_d();
    let rod = rod_per_strain(model.rod.unwrap(), &model.material);
    let (material, rod) = with_known_effects(&model.material, rod, effects);
    let amplifier = AmplifierConstants::default();
    Estimator::with_effects(settings, &material, rod, amplifier, TICK_S, effects).map_err(|error| error.to_string())
}

/// Largest difference of prediction and sensor over 0.4 s of milling, m.
fn largest_gap_m(effects: &[Effect], known: &[Effect]) -> f64 {
    let mut model = ActuatorModel::terfenol_d();
    model.effects = effects.to_vec();
    let mut actuator = Actuator::new(&model, TICK_S).unwrap();
    let mut estimator = estimator(&settings(), known).unwrap();
    let command = |k: u64| {
        let angle = 2.0 * std::f64::consts::PI * 50.0 * TICK_S * k as f64;
        let grown = (TICK_S * k as f64 / 0.1).min(1.0);
        grown * (9e3 * libm::sin(angle) + 2.7e3 * libm::sin(3.0 * angle))
    };
    let mut largest_m: f64 = 0.0;
    let mut commands = [0.0; 2];
    for k in 0..8000 {
        // One tick of computing and one of hold: the coil at t_k has what was commanded in tick k - 2.
        let said = actuator.step(ActuatorInput::command(commands[1]));
        let found = estimator.step(k, commands[0], said.field_a_per_m, said.displacement_m);
        if k >= SETTLED_TICKS {
            largest_m = largest_m.max(found.correction.output_error_m.abs());
        }
        commands = [command(k), commands[0]];
    }
    largest_m
}

fn effect(kind: EffectKind, values: &[f64]) -> Effect {
    Effect::new(kind, values).unwrap()
}

#[test]
fn a_known_effect_leaves_no_gap() {
    let effects = [
        effect(EffectKind::EddyCurrent, &[1.8e-4]),
        effect(EffectKind::AmplifierBandwidth, &[1e-4]),
        effect(EffectKind::LoopDelay, &[2.5e-4]),
        effect(EffectKind::BiasShift, &[500.0]),
        effect(EffectKind::Prestress, &[5e-14]),
        effect(EffectKind::AfterEffect, &[0.0325, 0.03, 3.0]),
        effect(EffectKind::QuadraticMagnetostriction, &[0.1]),
        effect(EffectKind::ThermalExpansion, &[0.5, 20.0, 12e-6]),
        effect(EffectKind::LoadChange, &[0.1, 0.1]),
        effect(EffectKind::CoilHeating, &[20.0, 100.0]),
        effect(EffectKind::Stiffening, &[1e8]),
        effect(EffectKind::Backlash, &[1.8e-6, 0.0]),
        effect(EffectKind::SecondMode, &[0.03, 415.0, 0.03]),
        effect(EffectKind::SensorDelay, &[5.35e-4, 0.0]),
        effect(EffectKind::SensorGain, &[0.1]),
        effect(EffectKind::SensorDrift, &[1e-6, 1e-7]),
    ];
    // What the estimator leaves out with nothing hidden: between ticks it takes M for a straight line.
    let nothing = largest_gap_m(&[], &[]);
    println!("nothing: {nothing:.2e} m");
    for one in effects {
        let (known, unknown) = (largest_gap_m(&[one], &[one]), largest_gap_m(&[one], &[]));
        println!("{}: {known:.2e} m known, {unknown:.2e} m unknown", one.kind().name());
        assert!(
            known < 2.0 * nothing && unknown > 10.0 * known,
            "{}: {known} m, {unknown} m",
            one.kind().name()
        );
    }
}

// Guards against a silent half-truth: what cannot be taken into account is refused.
#[test]
fn what_does_not_go_together_is_refused() {
    let measured = EstimatorSettings {
        field: FieldSource::Measured { play_a_per_m: 3.0 },
        ..settings()
    };
    let eddy = effect(EffectKind::EddyCurrent, &[1.8e-4]);
    assert!(estimator(&measured, &[eddy]).is_err_and(|sentence| sentence.contains("Commanded")));
    let matrix = EstimatorSettings {
        law: LawSettings::Matrix(MinMaxSettings::matrix()),
        ..EstimatorSettings::default()
    };
    let late = effect(EffectKind::SensorDelay, &[5e-4, 0.0]);
    assert!(estimator(&matrix, &[late]).is_err_and(|sentence| sentence.contains("Matrix")));
}
