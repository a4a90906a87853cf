//! Guards the way from loops without strain to a diagnosis: what `anhyst fit` writes of them is a model for `diagnose` and
//! `estimate` where the magnetization was measured, and refused where it would have to move something.

use anhyst_tests::{Finished, LIMIT};
use std::path::Path;

const LOOPS: &str = "identify/tests/data/mnzn_ferrite_4amp.csv";

/// The `hysteresis.ron` of a quick fit.
fn fitted(folder: &Path) -> String {
    let out = folder.join("fit");
    let (path, quick) = (
        out.to_string_lossy(),
        ["--curve", "langevin", "--candidates", "40", "--starts", "2"],
    );
    Finished::run(&[&["fit", LOOPS, "--out", &path], &quick[..]].concat(), LIMIT).expect(0);
    assert!(!out.join("material.ron").exists());
    out.join("hysteresis.ron").to_string_lossy().into_owned()
}

fn with_model(command: &str, model: &str, data: &str, folder: &Path, more: &[&str]) -> Finished {
    let out = folder.join(command);
    let (model, out) = (["--model", model, "--data", data], out.to_string_lossy());
    Finished::run(
        &[&[command][..], &model, &["--out", &out, "--json"], more].concat(),
        LIMIT,
    )
}

#[test]
fn loops_without_strain_are_diagnosed_and_estimated() {
    let root = tempfile::tempdir().unwrap();
    let model = fitted(root.path());
    let read = |finished: Finished| -> serde_json::Value { serde_json::from_str(&finished.expect(0).out).unwrap() };
    let found = read(with_model("diagnose", &model, LOOPS, root.path(), &[]));
    assert_eq!(found["unit"], "A/m", "{found}");
    // What it writes is a model again.
    let amended = root.path().join("diagnose/amended.ron").to_string_lossy().into_owned();
    for model in [&model, &amended] {
        let largest = ["--rows", "387..516"];
        let found = read(with_model("estimate", model, LOOPS, root.path(), &largest));
        assert_eq!(found["output"], "magnetization", "{found}");
        // The largest loop alone says nearly what all of them say.
        let shape = found["parameters"]["a"]["value"].as_f64().unwrap();
        let text = std::fs::read_to_string(model).unwrap();
        let own = text.split("shape_a_per_m: ").nth(1).unwrap().split(',').next().unwrap();
        let share = shape / own.parse::<f64>().unwrap();
        assert!((share - 1.0).abs() < 0.05, "{share}");
    }
}

#[test]
fn what_it_cannot_move_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let model = root.path().join("hysteresis.ron");
    let text = "(anhysteretic: Langevin, saturation_magnetization_a_per_m: 6.5e5, shape_a_per_m: 8600, pinning_a_per_m: 4900, \
                coupling: 0.009, reversibility: 0.2)";
    std::fs::write(&model, text).unwrap();
    let sweep: String = (0..100)
        .map(|row| f64::from(row) * 0.0628)
        .map(|phase| {
            format!(
                "{},{},{}\n",
                3e4 * phase.sin(),
                4e5 * (phase - 0.2).sin(),
                4e-4 * phase.sin().powi(2)
            )
        })
        .collect();
    let data = root.path().join("sweep.csv");
    std::fs::write(&data, format!("field_A_per_m,magnetization_A_per_m,strain\n{sweep}")).unwrap();
    let (model, data) = (model.to_string_lossy(), data.to_string_lossy());
    let refused = |command: &str, more: &[&str]| {
        let finished = with_model(command, &model, &data, root.path(), more).expect(2);
        finished
            .err
            .replace(['\n', '│'], " ")
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
    };
    let told = refused("diagnose", &[]);
    assert!(
        told.contains("has no strain law") && told.contains("--column strain=-"),
        "{told}"
    );
    let told = refused(
        "diagnose",
        &["--column", "strain=-", "--control", "scenarios/diagnosed.ron"],
    );
    assert!(told.contains("--control") && told.contains("moves nothing"), "{told}");
    let told = refused("estimate", &["--column", "magnetization=-"]);
    assert!(told.contains("strain (with a strain law)"), "{told}");
    let material = format!("material=File({model:?})");
    let told = Finished::run(&["check", "scenarios/diagnosed.ron", "--set", &material], LIMIT)
        .expect(2)
        .err;
    assert!(told.contains("the strain law is not known"), "{told}");
}
