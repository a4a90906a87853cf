//! Guards `fit --law` and `predict` as a user runs them, on a made stage: backlash elements in parallel, moved one by one.

use anhyst_tests::{Finished, LIMIT};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

const NOISE_M: f64 = 5e-9;

/// A stage of five backlashes behind a soft spring each, driven by a swelling sine about 60 V: `time_s,voltage_V,displacement_um`.
fn measured(folder: &Path, name: &str, hertz: f64) -> String {
    let (widths, gains) = ([2.0, 6.0, 12.0, 22.0, 40.0], [0.006, 0.008, 0.005, 0.004, 0.002]);
    let mut followers = [0.0_f64; 5];
    let mut noise = 12_345_u64;
    let mut text = "time_s,voltage_V,displacement_um\n".to_owned();
    for sample in 0..4000 {
        let t = 0.005 * f64::from(sample);
        let v = 60.0 * (1.0 - (-t / 0.2).exp()) + (15.0 + 2.0 * t) * (2.0 * std::f64::consts::PI * hertz * t).sin();
        let mut micrometres = 0.03 * v;
        for ((follower, width), gain) in followers.iter_mut().zip(widths).zip(gains) {
            // Dragged by the edge that it meets.
            if v - *follower > 0.5 * width {
                *follower = v - 0.5 * width;
            }
            if v - *follower < -0.5 * width {
                *follower = v + 0.5 * width;
            }
            micrometres += gain * *follower;
        }
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        micrometres += 1e6 * NOISE_M * ((noise >> 40) as f64 / f64::from(1 << 23) - 1.0);
        writeln!(text, "{t},{v},{micrometres}").unwrap();
    }
    let file = folder.join(name);
    std::fs::write(&file, text).unwrap();
    file.to_string_lossy().into_owned()
}

fn read(finished: Finished) -> Value {
    serde_json::from_str(&finished.expect(0).out).unwrap()
}

#[test]
fn a_law_is_fitted_to_one_file_and_predicts_another() {
    let root = tempfile::tempdir().unwrap();
    let (one, other) = (
        measured(root.path(), "one.csv", 1.0),
        measured(root.path(), "other.csv", 0.37),
    );
    let out = |name: &str| root.path().join(name).to_string_lossy().into_owned();
    let fit = read(Finished::run(
        &["fit", &one, "--law", "auto", "--out", &out("fit"), "--json"],
        LIMIT,
    ));
    let told = fit["held_out_nrmse"].as_f64().unwrap();
    assert!(told < 2e-3 && fit["law"].is_string(), "{fit}");
    // Why this one of all.
    let (law, why) = (fit["law"].as_str().unwrap(), fit["why"].as_str().unwrap());
    let rule = ["it predicts what was kept back best", "it has the fewest numbers"];
    assert!(
        why.starts_with(law) && rule.iter().any(|rule| why.contains(rule)),
        "{why}"
    );
    let law = root.path().join("fit/law.ron").to_string_lossy().into_owned();
    let along = [
        "predict",
        "--model",
        &law,
        "--data",
        &other,
        "--out",
        &out("predict"),
        "--json",
    ];
    let predicted = read(Finished::run(&along, LIMIT));
    assert_eq!(predicted["unit"], "m", "{predicted}");
    let number = |field: &str| predicted[field].as_f64().unwrap();
    // Noise is 3 nm rms of a range of 5 µm.
    assert!(number("rms") < 5.0 * NOISE_M, "{predicted}");
    assert!(
        number("rms_after_mean") <= number("rms") && number("range") > 4e-6,
        "{predicted}"
    );
    assert!(root.path().join("predict/predict.csv").exists() && root.path().join("fit/fit.svg").exists());
    // A law that cannot describe it says so in its report, not with a small number.
    let line = read(Finished::run(
        &["fit", &one, "--law", "linear", "--out", &out("line"), "--json"],
        LIMIT,
    ));
    assert!(line["held_out_nrmse"].as_f64().unwrap() > 5.0 * told, "{line}");
    assert_eq!(line["why"], "", "{line}");
}

/// Guards the way out of a refusal: under foreign names it ends with the options that read the file, and a misspelt one with the right one.
#[test]
fn a_refusal_of_columns_ends_with_what_to_give() {
    let root = tempfile::tempdir().unwrap();
    let file = measured(root.path(), "one.csv", 1.0);
    let made = std::fs::read_to_string(&file).unwrap();
    let out = root.path().join("fit").to_string_lossy().into_owned();
    let fit = |columns: &[&str]| {
        let base = ["fit", &file, "--law", "linear", "--out", &out];
        Finished::run(&[&base[..], columns].concat(), LIMIT)
    };
    let words = |finished: Finished| finished.err.split_whitespace().collect::<Vec<_>>().join(" ");
    // Of the second the output is known by its name, so the reader does not refuse it, but the law has no input.
    for (header, columns) in [
        ("t_s,v_in_V,PosX_um", &["voltage=v_in_V", "displacement=PosX_um"][..]),
        ("time_s,v_in_V,displacement_um", &["voltage=v_in_V"]),
    ] {
        std::fs::write(&file, made.replace("time_s,voltage_V,displacement_um", header)).unwrap();
        let refused = words(fit(&[]).expect(2));
        let (_, proposed) = refused
            .split_once("seem to be, give ")
            .unwrap_or_else(|| panic!("{refused}"));
        let (proposed, _) = proposed.split_once(" (why: anhyst data ").unwrap();
        let proposed: Vec<&str> = proposed.split(' ').collect();
        for column in columns {
            assert!(proposed.contains(column), "no {column} in {proposed:?}");
        }
        fit(&proposed).expect(0);
    }
    let misspelt = words(fit(&["--column", "voltage=v_in_v"]).expect(2));
    assert!(misspelt.contains("Is \"v_in_V\" meant?"), "{misspelt}");
    let misspelt = words(fit(&["--column", "voltge=v_in_V"]).expect(2));
    assert!(misspelt.contains("is voltage= meant?"), "{misspelt}");
}

/// A file of a law that holds what no law takes is refused with its place, and one for another input by name.
#[test]
fn a_wrong_law_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let data = measured(root.path(), "one.csv", 1.0);
    let law = root.path().join("law.ron");
    let refused = |text: &str| {
        std::fs::write(&law, text).unwrap();
        let (law, out) = (law.to_string_lossy(), root.path().join("out"));
        let out = out.to_string_lossy();
        Finished::run(&["predict", "--model", &law, "--data", &data, "--out", &out], LIMIT)
            .expect(2)
            .err
    };
    let plays = "laws: [Plays(groups: [(warp: Straight, radii: [1.0], weights: [-2.0])])]";
    let file = |input: &str, laws: &str| {
        format!(
            "(input: {input}, output: Displacement, start: Rest, input_extent: (0.0, 1.0), model: (offset: 0.0, slope: 1.0, {laws}))"
        )
    };
    let negative = refused(&file("Voltage", plays));
    assert!(negative.contains("weight of a play is -2"), "{negative}");
    let other = refused(&file("Current", "laws: []"));
    assert!(other.contains("holds no current, which drives the law"), "{other}");
    let unknown = refused(&file("Voltage", "lawz: []"));
    assert!(unknown.contains("lawz") && unknown.contains("law.ron:1:"), "{unknown}");
}

/// Relays between hand-made thresholds magnetise a rod, and its strain is even in that: over the field alone it is a line.
#[test]
fn a_strain_is_even_in_a_magnetization_that_is_known() {
    let root = tempfile::tempdir().unwrap();
    let mut up = vec![false; 400];
    let threshold = |relay: usize| {
        let (row, column) = ((relay / 20) as f64, (relay % 20) as f64);
        let (middle, half) = (400.0 * (row - 9.5), 100.0 * (column + 1.0));
        (middle + half, middle - half)
    };
    let mut text = "loop_id,field_A_per_m,magnetization_A_per_m,strain\n".to_owned();
    for (number, size) in [12_000.0, 7000.0, 4000.0, 9000.0].into_iter().enumerate() {
        // Twice round: the second time the loop repeats.
        for sample in 0..800 {
            let angle = 2.0 * std::f64::consts::PI * f64::from(sample) / 400.0;
            let field = size * angle.cos();
            for (relay, up) in up.iter_mut().enumerate() {
                let (rise, fall) = threshold(relay);
                *up = if field >= rise { true } else { *up && field > fall };
            }
            let raised = up.iter().filter(|up| **up).count() as f64;
            let m = 2000.0 * (raised - 200.0) + 10.0 * field;
            if sample >= 399 {
                let strain = 1e-5 + 2e-15 * m * m + 3e-27 * m.powi(4);
                writeln!(text, "{number},{field},{m},{strain}").unwrap();
            }
        }
    }
    let file = root.path().join("rod.csv");
    std::fs::write(&file, text).unwrap();
    let (file, out) = (
        file.to_string_lossy(),
        root.path().join("fit").to_string_lossy().into_owned(),
    );
    let arguments = [
        "fit", &file, "--law", "auto", "--output", "strain", "--out", &out, "--json",
    ];
    let fit = read(Finished::run(&arguments, LIMIT));
    // Relays jump; a law moves on.
    let told = fit["held_out_nrmse"].as_f64().unwrap();
    let line = fit["candidates"]
        .as_array()
        .unwrap()
        .iter()
        .find(|own| own["law"] == "linear")
        .unwrap();
    assert!(
        told < 0.06 && told < 0.2 * line["held_out_nrmse"].as_f64().unwrap(),
        "{fit}"
    );
    let model = root.path().join("fit/law.ron").to_string_lossy().into_owned();
    let along = ["predict", "--model", &model, "--data", &file, "--out", &out, "--json"];
    let predicted = read(Finished::run(&along, LIMIT));
    let share = predicted["rms"].as_f64().unwrap() / predicted["range"].as_f64().unwrap();
    assert!((share - fit["nrmse"].as_f64().unwrap()).abs() < 1e-9, "{predicted}");
    // A loop does not take it.
    let set = format!("material=File(\"{model}\")");
    let refused = Finished::run(&["check", "scenarios/piezo/sine.ron", "--set", &set], LIMIT).expect(2);
    assert!(refused.err.contains("a strain over a law"), "{}", refused.err);
}
