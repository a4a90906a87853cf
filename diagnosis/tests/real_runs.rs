//! Guards what a diagnosis says of real measurements: a piezo stage, soft magnets, Terfenol-D, reversal curves of a rock.
//!
//! The data are not ours to carry. They are looked for in `../shared/data`, or where `ANHYST_SHARED` says; without them nothing is
//! tested. `--nocapture` shows the decompositions.

use std::path::{Path, PathBuf};

use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, Diagnosis, FoundEffect, Verdict, diagnose};
use anhyst_measured::{ColumnMapping, MeasuredRun, Quantity, RunReadOptions};
use anhyst_model::{Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs, Anhysteretic, Hysteresis};

fn data(file: &str) -> Option<PathBuf> {
    let own = std::env::var("ANHYST_SHARED").map(PathBuf::from);
    let own = own.unwrap_or_else(|_| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"));
    let file = own.join("data").join(file);
    if !file.exists() {
        println!("no {}: nothing is tested", file.display());
    }
    file.exists().then_some(file)
}

fn model(name: &str) -> ActuatorModel {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenarios/models")
        .join(name);
    let text = std::fs::read_to_string(file).expect("the model");
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(&text).expect("a model")
}

fn diagnosed(model: &ActuatorModel, runs: &[MeasuredRun], settle_s: f64) -> Diagnosed {
    let options = DiagnoseOptions {
        settle_s,
        ..DiagnoseOptions::default()
    };
    let found = diagnose(model, runs, &options, &mut |_, _| ()).expect("a diagnosis");
    show(&found.diagnosis);
    found
}

fn show(own: &Diagnosis) {
    let shares = |effects: &[FoundEffect]| {
        let shares = effects.iter().map(|effect| {
            let values = effect.values.iter().map(|value| format!("{:.4e}", value.value));
            format!(
                "{} {:.3} ({})",
                effect.name,
                effect.share,
                values.collect::<Vec<_>>().join(", ")
            )
        });
        shares.collect::<Vec<_>>().join("; ")
    };
    println!("{} {}: {}", own.data[0].source, own.verdict.name(), own.sentence);
    println!(
        "  explained {:.3}, confidence {:.3}, ties {:?}",
        own.explained, own.confidence, own.ambiguous_with
    );
    println!("  effects {}", shares(&own.effects));
    println!("  nuisance {}", shares(&own.nuisance));
    println!("  parameters {}", shares(&own.parameters));
    for candidate in own.candidates.iter().take(7) {
        println!(
            "  {} {:.1} {:.3e}",
            candidate.name, candidate.delta_bic, candidate.gap_after
        );
    }
}

/// A decomposition in numbers, and none but a nearly complete explanation with confidence.
fn decomposed(own: &Diagnosis) {
    let parts = own.effects.iter().chain(&own.nuisance).chain(&own.parameters);
    assert!(parts.clone().next().is_some());
    assert!(
        parts.clone().all(|part| part.share.is_finite()),
        "{parts:?}",
        parts = parts.collect::<Vec<_>>()
    );
    assert!(own.explained.is_finite() && (0.0..=1.0).contains(&own.confidence));
    assert!(
        own.effects.is_empty() || own.confidence <= 0.9 || own.explained > 2.0 / 3.0,
        "{} of the gap with confidence {}",
        own.explained,
        own.confidence
    );
}

fn read(file: &str, mappings: &[&str], rows: Option<&str>) -> Option<Vec<MeasuredRun>> {
    let reading = RunReadOptions {
        mappings: mappings
            .iter()
            .map(|text| text.parse::<ColumnMapping>().expect("a mapping"))
            .collect(),
        rows: rows.map(|text| text.parse().expect("rows")),
        ..RunReadOptions::default()
    };
    Some(MeasuredRun::read_each(&data(file)?, &reading).expect("runs"))
}

/// One sine for 40 s, and tracking with ramps of the amplitude and rests.
fn piezo_runs() -> Option<[MeasuredRun; 2]> {
    let own = |file| {
        let mappings = ["time=t_s", "command=v_in_V*1000", "displacement=disp_um*1e-6"];
        read(&format!("piezo_stage_ntu_dbo/{file}"), &mappings, None)?.pop()
    };
    Some([
        own("ident_1Hz_sine.csv")?,
        own("tracking_linear_vs_hysteresis_inverse.csv")?,
    ])
}

/// Rows of the start from an unknown state.
const PIEZO_ROWS: usize = 200;

/// Measured minus model, m rms, the instrument's zero taken off; the stage rested at no voltage before the first row.
fn left_m(model: &ActuatorModel, run: &MeasuredRun) -> f64 {
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
    (gap.iter().map(|own| (own - zero) * (own - zero)).sum::<f64>() / gap.len() as f64).sqrt()
}

fn names(found: &Diagnosed) -> Vec<&str> {
    let effects = found.diagnosis.effects.iter();
    effects.map(|effect| effect.name.as_str()).collect()
}

/// Creep is named in one run, and the amended model predicts another, of which the diagnosis saw nothing, better by a fifth.
fn creep_helps_elsewhere(run: &MeasuredRun, other: &MeasuredRun, coil: bool) {
    let nominal = ActuatorModel {
        coil,
        ..model("piezo_stage.ron")
    };
    let found = diagnosed(&nominal, std::slice::from_ref(run), 1.0);
    let [before, after] = [&nominal, &found.amended].map(|model| left_m(model, other));
    let bare = ActuatorModel {
        effects: Vec::new(),
        ..found.amended.clone()
    };
    println!(
        "  the other: {:.4} -> {:.4} µm, without its effects {:.4}",
        1e6 * before,
        1e6 * after,
        1e6 * left_m(&bare, other)
    );
    decomposed(&found.diagnosis);
    assert_eq!(found.diagnosis.verdict, Verdict::Named);
    assert!(names(&found).contains(&"after_effect"), "{:?}", names(&found));
    assert!(after < 0.8 * before, "{before} {after}");
}

/// Guards what a repaired model is for. That a stage has no coil that would warm it need not be said.
#[test]
fn creep_of_a_sine_helps_in_the_tracking() {
    let Some([sine, tracking]) = piezo_runs() else { return };
    creep_helps_elsewhere(&sine, &tracking, true);
    creep_helps_elsewhere(&sine, &tracking, false);
}

/// Guards the other way round: the tracking is full of minor loops that the model does not follow.
#[test]
fn creep_of_the_tracking_helps_in_the_sine() {
    let Some([sine, tracking]) = piezo_runs() else { return };
    creep_helps_elsewhere(&tracking, &sine, false);
    creep_helps_elsewhere(&tracking, &sine, true);
}

/// Guards the strain of a sweep that has its magnetization beside it.
#[test]
fn terfenol_d() {
    let file = "terfenol_d_7MPa_factory/terfenol_d_H_B_strain.csv";
    let Some(runs) = read(file, &[], Some("0..1139")) else {
        return;
    };
    let found = diagnosed(&model("terfenol_d_measured.ron"), &runs, 0.0).diagnosis;
    decomposed(&found);
    assert!(found.explained > 0.5, "{}", found.explained);
}

/// Guards purely magnetic data: loops of several amplitudes, as `anhyst fit` fits them all together, and reversal curves.
#[test]
fn magnetization() {
    let own = |anhysteretic, numbers: [f64; 5]| Hysteresis {
        anhysteretic,
        saturation_magnetization_a_per_m: numbers[0],
        shape_a_per_m: numbers[1],
        pinning_a_per_m: numbers[2],
        coupling: numbers[3],
        reversibility: numbers[4],
        ..ActuatorModel::terfenol_d().material.hysteresis
    };
    let sets = [
        (
            "soft_magnetics_szewczyk/mnzn_ferrite_4amp.csv",
            own(
                Anhysteretic::Langevin,
                [304_902.4, 18.2008, 19.88146, 1.2394e-4, 0.78976],
            ),
        ),
        (
            "soft_magnetics_szewczyk/steel_M130_27s_3amp.csv",
            own(
                Anhysteretic::Langevin,
                [1_810_110.5, 229.6354, 47.13415, 3.6164e-4, 0.841073],
            ),
        ),
        (
            "soft_magnetics_szewczyk/amorphous_perp.csv",
            own(
                Anhysteretic::Ising,
                [1_039_436.6, 47.90262, 2.334707, -1.60454e-4, 0.604068],
            ),
        ),
        (
            "forc_pmagpy/forc_train_every6th.csv",
            own(Anhysteretic::Langevin, [520_000.0, 28_000.0, 30_000.0, 1e-3, 0.5]),
        ),
    ];
    for (file, hysteresis) in sets {
        let Some(runs) = read(file, &[], None) else { return };
        let mut fitted = ActuatorModel {
            source: "fitted to other loops".to_owned(),
            rod: None,
            ..ActuatorModel::terfenol_d()
        };
        fitted.material.hysteresis = hysteresis;
        decomposed(&diagnosed(&fitted, &runs, 0.0).diagnosis);
    }
}
