//! Guards constants estimated from a run: they come back within what is claimed, from a chain with an effect in it too, and a model
//! that is wrong in other ways never ends worse than it began.

use std::fmt::Write as _;
use std::path::Path;

use anhyst_identify::estimate::{Observed, several};
use anhyst_measured::{MeasuredRun, RunReadOptions};
use anhyst_model::{
    ActuatorInputs, ActuatorModel, ActuatorOutputs, Anhysteretic, DriveSignal, Effect, EffectKind, Hysteresis, Noise,
    NominalParameter, simulate,
};

const TICK_S: f64 = 1e-4;
const SAMPLES: usize = 10_000;
const NOISE_M: f64 = 20e-9;

fn parameters(symbols: &[&str]) -> Vec<NominalParameter> {
    let named = symbols
        .iter()
        .map(|symbol| NominalParameter::from_symbol(symbol).unwrap());
    named.collect()
}

#[test]
fn constants_of_material_and_rod_come_back_beside_an_effect() {
    let mut nominal = ActuatorModel::terfenol_d();
    nominal.effects = vec![Effect::new(EffectKind::EddyCurrent, &[1.8e-4]).unwrap()];
    let mut truth = nominal.clone();
    let asked = parameters(&["a", "k", "damping"]);
    for (parameter, share) in asked.iter().zip([1.03, 0.96, 1.05]) {
        parameter.set(&mut truth, share * parameter.of(&nominal).unwrap());
    }
    let signal = DriveSignal::standard(SAMPLES as f64 * TICK_S);
    let commands: Vec<f64> = (0..SAMPLES).map(|k| signal.field_a_per_m(k as f64 * TICK_S)).collect();
    let mut outputs = ActuatorOutputs::default();
    simulate(&truth, TICK_S, ActuatorInputs::commands(&commands), &mut outputs).unwrap();
    let mut noise = Noise::new(7, 0);
    let mut text = "time_s,field_command_A_per_m,displacement_m\n".to_owned();
    for (k, (command, displacement)) in commands.iter().zip(&outputs.displacement_m).enumerate() {
        let seen = displacement + NOISE_M * noise.normal();
        writeln!(text, "{:.4},{command:.9},{seen:.12}", k as f64 * TICK_S).unwrap();
    }
    let file = std::env::temp_dir().join(format!("anhyst-constants-{}.csv", std::process::id()));
    std::fs::write(&file, text).unwrap();
    let run = MeasuredRun::read(&file, &RunReadOptions::default()).unwrap();
    std::fs::remove_file(&file).unwrap();
    let observed = Observed::of(&run, &nominal, 0.0).unwrap();
    let found = several(&observed, &nominal, &asked).unwrap();
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    for (parameter, value, deviation) in found.parameters {
        let expected = parameter.of(&truth).unwrap();
        assert!(
            (value - expected).abs() < 4.0 * deviation && deviation < 0.02 * expected,
            "{}: {value} ± {deviation}, truth {expected}",
            parameter.symbol()
        );
    }
}

#[test]
fn a_soft_magnet_sweep_never_ends_worse_than_it_began() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mnzn_ferrite_4amp.csv");
    let options = RunReadOptions {
        rows: Some("387..516".parse().unwrap()),
        ..RunReadOptions::default()
    };
    let run = MeasuredRun::read(&file, &options).unwrap();
    let mut model = ActuatorModel::terfenol_d();
    model.rod = None;
    model.material.hysteresis = Hysteresis {
        anhysteretic: Anhysteretic::Langevin,
        saturation_magnetization_a_per_m: 3.3e5,
        shape_a_per_m: 22.0,
        pinning_a_per_m: 17.0,
        coupling: 1.2e-4,
        reversibility: 0.7,
        cubic_coupling_m2_per_a2: 0.0,
    };
    let observed = Observed::of(&run, &model, 0.0).unwrap();
    let rms = |model: &ActuatorModel| {
        let [output, _] = observed.simulate(model).unwrap();
        let left: Vec<f64> = observed
            .measured
            .iter()
            .zip(output)
            .map(|(measured, own)| measured - own)
            .collect();
        let mean = left.iter().sum::<f64>() / left.len() as f64;
        (left.iter().map(|own| (own - mean).powi(2)).sum::<f64>() / left.len() as f64).sqrt()
    };
    let found = several(&observed, &model, &parameters(&["Ms", "a", "k", "alpha", "c"])).unwrap();
    let (before, after) = (rms(&model), rms(&found.model));
    assert!(after < 0.5 * before, "{after} A/m rms are left of {before}");
}
