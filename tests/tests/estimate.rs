//! Guards `anhyst estimate` as a user runs it: a run made by the simulator, with noise, gives its parameters back.

use anhyst_model::{ActuatorInputs, ActuatorModel, ActuatorOutputs, DriveSignal, HysteresisParameter, Noise, simulate};
use anhyst_tests::{Finished, LIMIT};
use std::fmt::Write as _;
use std::path::Path;

const TICK_S: f64 = 1e-4;
const SECONDS: f64 = 2.0;
const NOISE_M: f64 = 20e-9;

/// A run of an actuator that differs from the nominal one in some parameters.
fn measured(folder: &Path, changed: &[(HysteresisParameter, f64)]) -> String {
    let mut model = ActuatorModel::terfenol_d();
    for (parameter, share) in changed {
        let hysteresis = model.material.hysteresis;
        model.material.hysteresis = parameter.with(hysteresis, share * parameter.of(&hysteresis));
    }
    let signal = DriveSignal::standard(SECONDS);
    let samples = (SECONDS / TICK_S) as usize;
    let commands: Vec<f64> = (0..samples).map(|k| signal.field_a_per_m(k as f64 * TICK_S)).collect();
    let mut outputs = ActuatorOutputs::default();
    simulate(&model, TICK_S, ActuatorInputs::commands(&commands), &mut outputs).unwrap();
    let mut noise = Noise::new(7, 0);
    let mut text = "time_s,field_command_A_per_m,displacement_m\n".to_owned();
    for (k, (command, displacement)) in commands.iter().zip(&outputs.displacement_m).enumerate() {
        let seen = displacement + NOISE_M * noise.normal();
        writeln!(text, "{:.4},{command:.6},{seen:.10}", k as f64 * TICK_S).unwrap();
    }
    let path = folder.join("run.csv");
    std::fs::write(&path, text).unwrap();
    path.to_string_lossy().into_owned()
}

fn estimate(folder: &Path, data: &str, more: &[&str]) -> serde_json::Value {
    let out = folder.join("out");
    let out = out.to_string_lossy();
    let common = [
        "estimate",
        "--model",
        "scenarios/models/nominal.ron",
        "--data",
        data,
        "--out",
        &out,
        "--json",
    ];
    let arguments: Vec<&str> = common.into_iter().chain(more.iter().copied()).collect();
    let finished = Finished::run(&arguments, LIMIT).expect(0);
    for file in ["estimate.json", "estimate.svg"] {
        assert!(folder.join("out").join(file).is_file(), "{file}");
    }
    serde_json::from_str(&finished.out).unwrap()
}

#[test]
fn every_law_finds_the_shape() {
    let folder = tempfile::tempdir().unwrap();
    let data = measured(folder.path(), &[(HysteresisParameter::Shape, 1.03)]);
    let truth = 1.03 * 7012.0;
    for (law, within) in [
        ("gauss-newton", 1.0),
        ("folded", 3.0),
        ("matrix", 3.0),
        ("gradient", 3.0),
    ] {
        let found = estimate(folder.path(), &data, &["--law", law]);
        let value = found["parameters"]["a"]["value"].as_f64().unwrap();
        assert!((value - truth).abs() < within, "{law}: {value} A/m, truth {truth} A/m");
        assert_eq!(
            (found["informed"].as_bool(), found["law"].as_str()),
            (Some(true), Some(law))
        );
        let (after, before) = (&found["residual_rms_after"], &found["residual_rms_before"]);
        assert!(
            after.as_f64().unwrap() < 1.1 * NOISE_M && before.as_f64().unwrap() > 5.0 * NOISE_M,
            "{law}: {found}"
        );
    }
}

#[test]
fn several_parameters_are_found_together() {
    let folder = tempfile::tempdir().unwrap();
    let changed = [(HysteresisParameter::Shape, 1.02), (HysteresisParameter::Pinning, 0.97)];
    let data = measured(folder.path(), &changed);
    let found = estimate(folder.path(), &data, &["--parameters", "a,k"]);
    for (symbol, truth) in [("a", 1.02 * 7012.0), ("k", 0.97 * 4000.0)] {
        let parameter = &found["parameters"][symbol];
        let [value, sd] = ["value", "standard_deviation"].map(|key| parameter[key].as_f64().unwrap());
        assert!(
            (value - truth).abs() < 5.0 * sd && sd < 1e-2 * truth,
            "{symbol}: {value} ± {sd}, truth {truth}"
        );
    }
}

// Guards the sentences: what cannot be estimated is refused before any work, with status 2.
#[test]
fn what_cannot_be_estimated_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let data = measured(folder.path(), &[]);
    let model = "scenarios/models/nominal.ron";
    let out = folder.path().join("out");
    let out = out.to_string_lossy();
    let common = ["estimate", "--model", model, "--data", &data, "--out", &out];
    for (more, said) in [
        (&["--law", "gaus-newton"][..], "a similar value exists: 'gauss-newton'"),
        (&["--parameters", "a,b"], "possible values: Ms, a, k, alpha, c"),
        (&["--parameters", "a,a"], "stands twice"),
        (&["--range-a-per-m", "7300..6300"], "lower edge"),
        (
            &["--column", "displacement=nothing"],
            "there is no column \"nothing\", which was named for the displacement",
        ),
    ] {
        let arguments: Vec<&str> = common.iter().chain(more).copied().collect();
        let finished = Finished::run(&arguments, LIMIT).expect(2);
        assert!(finished.err.contains(said), "{more:?}: {}", finished.err);
    }
}
