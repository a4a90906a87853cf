//! Real measurements, which are not ours to carry: named by environment variables, and asked for with `--ignored`.

use std::path::Path;

use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, Verdict, diagnose};
use anhyst_measured::{ColumnMapping, MeasuredRun, Quantity, RunReadOptions};
use anhyst_model::{Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs};

fn model(name: &str) -> ActuatorModel {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenarios/models")
        .join(name);
    let text = std::fs::read_to_string(file).expect("the model");
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(&text).expect("a model")
}

fn diagnosed(model: &ActuatorModel, run: &MeasuredRun, settle_s: f64) -> Diagnosed {
    let options = DiagnoseOptions {
        settle_s,
        ..DiagnoseOptions::default()
    };
    diagnose(model, std::slice::from_ref(run), &options, &mut |_, _| ()).expect("a diagnosis")
}

/// Rms of the per-cycle means of the residual, their own mean taken off.
fn drift_m(residual: &[f64], per_cycle: usize) -> f64 {
    let means: Vec<f64> = residual
        .chunks_exact(per_cycle)
        .map(|cycle| cycle.iter().sum::<f64>() / per_cycle as f64)
        .collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    (means.iter().map(|own| (own - mean) * (own - mean)).sum::<f64>() / means.len() as f64).sqrt()
}

/// A file of the folder, or some of its rows.
fn piezo_run(file: &str, rows: Option<&str>) -> MeasuredRun {
    let folder = std::env::var("ANHYST_PIEZO").expect("ANHYST_PIEZO");
    let mappings = ["time=t_s", "command=v_in_V*1000", "displacement=disp_um*1e-6"];
    let reading = RunReadOptions {
        mappings: mappings
            .iter()
            .map(|text| text.parse::<ColumnMapping>().expect("a mapping"))
            .collect(),
        rows: rows.map(|text| text.parse().expect("rows")),
        ..RunReadOptions::default()
    };
    MeasuredRun::read(&Path::new(&folder).join(file), &reading).expect("a run")
}

/// One sine for 40 s, and tracking with ramps of the amplitude and rests.
fn piezo_runs() -> [MeasuredRun; 2] {
    ["ident_1Hz_sine.csv", "tracking_linear_vs_hysteresis_inverse.csv"].map(|file| piezo_run(file, None))
}

/// Rows of the start from an unknown state, and rows of a cycle.
const PIEZO_ROWS: usize = 200;

/// Measured minus model, m, the instrument's zero taken off; the stage rested at no voltage before the first row.
fn left_m(model: &ActuatorModel, run: &MeasuredRun) -> Vec<f64> {
    let command = run.series(Quantity::FieldCommand).expect("a command");
    let measured = run.series(Quantity::Displacement).expect("a displacement");
    let mut actuator = Actuator::new(model, run.tick_s.expect("a tick")).expect("a model");
    actuator.step(ActuatorInput::command(0.0));
    let mut outputs = ActuatorOutputs::default();
    actuator
        .run(ActuatorInputs::commands(command), &mut outputs)
        .expect("a run");
    let gap = measured.iter().zip(&outputs.displacement_m).map(|(y, m)| y - m);
    let gap: Vec<f64> = gap.skip(PIEZO_ROWS).collect();
    let zero = gap.iter().sum::<f64>() / gap.len() as f64;
    gap.into_iter().map(|own| own - zero).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|own| own * own).sum::<f64>() / values.len() as f64).sqrt()
}

/// The fitted model without the effects that were found.
fn without_effects(model: &ActuatorModel) -> ActuatorModel {
    ActuatorModel {
        effects: Vec::new(),
        ..model.clone()
    }
}

fn names(found: &Diagnosed) -> Vec<&str> {
    let effects = found.diagnosis.effects.iter();
    effects.map(|effect| effect.name.as_str()).collect()
}

/// Guards creep on a piezo stage: named, and without any free-form term the cycles' means drift by at most 0.02 µm rms
/// instead of 0.141 µm. That it is not heat is what the model says of itself (`coil: false`); the data do not: with a coil,
/// thermal_expansion ties, 5 % ahead, and predicts the other file as well (0.384 µm rms, creep 0.386 µm, neither 0.393 µm).
#[test]
#[ignore = "needs the folder of the piezo stage, named by ANHYST_PIEZO"]
fn creep_of_a_piezo_stage() {
    let [run, _] = piezo_runs();
    let found = diagnosed(&model("piezo_stage.ron"), &run, 1.0);
    println!("{}", found.diagnosis.sentence);
    println!("{:?} or {:?}", found.amended.effects, found.diagnosis.ambiguous_with);
    let before = drift_m(&left_m(&without_effects(&found.amended), &run), PIEZO_ROWS);
    let after = drift_m(&left_m(&found.amended, &run), PIEZO_ROWS);
    println!(
        "drift of the cycles' means: {:.4} -> {:.4} µm",
        1e6 * before,
        1e6 * after
    );
    assert_eq!(
        (found.diagnosis.verdict, names(&found)),
        (Verdict::Named, vec!["after_effect"])
    );
    assert!(before > 0.12e-6 && after <= 0.02e-6, "{before} {after}");
}

/// Creep found in one run must make the prediction of another, of which the diagnosis saw nothing, better.
fn creep_helps_elsewhere(run: &MeasuredRun, other: &MeasuredRun) -> Verdict {
    let found = diagnosed(&model("piezo_stage.ron"), run, 1.0);
    println!("{}", found.diagnosis.sentence);
    println!("{:?} or {:?}", found.amended.effects, found.diagnosis.ambiguous_with);
    let bare = without_effects(&found.amended);
    let [before, after] = [&bare, &found.amended].map(|model| rms(&left_m(model, other)));
    let [own_before, own_after] = [&bare, &found.amended].map(|model| rms(&left_m(model, run)));
    println!(
        "{} µm rms: {:.4} -> {:.4}; {}: {:.4} -> {:.4}",
        run.source,
        1e6 * own_before,
        1e6 * own_after,
        other.source,
        1e6 * before,
        1e6 * after
    );
    assert_eq!(names(&found), ["after_effect"]);
    assert!(after < before, "{before} {after}");
    found.diagnosis.verdict
}

/// Guards what a repaired model is for.
#[test]
#[ignore = "needs the folder of the piezo stage, named by ANHYST_PIEZO"]
fn creep_found_in_the_sine_helps_in_the_tracking() {
    let [sine, tracking] = piezo_runs();
    assert_eq!(creep_helps_elsewhere(&sine, &tracking), Verdict::Named);
}

/// Guards the other way round. Fails: the tracking's minor loops are off by more than its creep, so nothing is named.
#[test]
#[ignore = "needs the folder of the piezo stage, named by ANHYST_PIEZO; fails with the verdict unknown"]
fn creep_found_in_the_tracking_helps_in_the_sine() {
    let [sine, tracking] = piezo_runs();
    assert_eq!(creep_helps_elsewhere(&tracking, &sine), Verdict::Named);
}

/// Guards the other way round where it can be had: the tracking up to its first ramp, without minor loops. So short a run does
/// not tell creep from a sensor's drift, so the verdict is left open.
#[test]
#[ignore = "needs the folder of the piezo stage, named by ANHYST_PIEZO"]
fn creep_found_before_the_minor_loops_helps_in_the_sine() {
    let [sine, _] = piezo_runs();
    let before_the_ramp = piezo_run("tracking_linear_vs_hysteresis_inverse.csv", Some("0..2900"));
    creep_helps_elsewhere(&before_the_ramp, &sine);
}

/// Guards prestress on a Terfenol-D sweep: named, held-out strain gap at most 1.4 % of the range.
#[test]
#[ignore = "needs the file named by ANHYST_TERFENOL_CSV"]
fn prestress_of_terfenol_d() {
    let file = std::env::var("ANHYST_TERFENOL_CSV").expect("ANHYST_TERFENOL_CSV");
    let reading = RunReadOptions {
        rows: Some("0..1139".parse().expect("rows")),
        ..RunReadOptions::default()
    };
    let run = MeasuredRun::read(Path::new(&file), &reading).expect("a sweep");
    let found = diagnosed(&model("terfenol_d_measured.ron"), &run, 0.0).diagnosis;
    println!("{}", found.sentence);
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert_eq!(
        (found.verdict, names.as_slice()),
        (Verdict::Named, ["prestress"].as_slice())
    );
    let range = 1417e-6;
    assert!(
        found.gap_before / range < 0.03 && found.gap_after / range <= 0.014,
        "{} {}",
        found.gap_before,
        found.gap_after
    );
}
