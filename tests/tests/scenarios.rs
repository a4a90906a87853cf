//! Guards what the shipped scenarios promise: each holds what it expects, and the adaptive loop is worth its trouble.

use anhyst_tests::{Finished, LIMIT, repository};
use serde_json::Value;

fn run(scenario: &str) -> Value {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let arguments = [
        "run",
        scenario,
        "--embedded",
        "--no-recording",
        "--json",
        "--out",
        &out.to_string_lossy(),
    ];
    let finished = Finished::run(&arguments, LIMIT).expect(0);
    let printed: Value = serde_json::from_str(&finished.out).unwrap();
    let written: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    printed
}

fn number(summary: &Value, name: &str) -> f64 {
    summary[name]
        .as_f64()
        .unwrap_or_else(|| panic!("no number {name} in {summary}"))
}

/// At most 1.5 times what is reached, and the scenario itself expects no more: a loop that lost a part of itself would not hold.
fn assert_reached(summary: &Value, rms_m: f64, max_m: f64) {
    assert!(number(summary, "error_rms_m") <= 1.5 * rms_m, "{summary}");
    assert!(number(summary, "error_max_m") <= 1.5 * max_m, "{summary}");
    assert!(number(summary, "tolerance_m") <= 1.5 * max_m, "{summary}");
}

#[test]
fn milling_holds_20_nm_while_a_drifts() {
    let summary = run("scenarios/milling.ron");
    assert_reached(&summary, 3.26e-9, 13.6e-9);
    assert!(number(&summary, "a_final_error_a_per_m").abs() < 2.6, "{summary}");
    // Lag while a rises by 200 A/m per second.
    assert!(number(&summary, "a_error_rms_a_per_m") < 2.6, "{summary}");
    let between = &summary["between"];
    assert!(
        number(between, "rms_m") <= 1.5 * 3.26e-9 && number(between, "max_m") <= 20e-9,
        "{summary}"
    );
    assert_eq!(summary["held"], true);
    assert_eq!(summary["ticks"], 90_000);
    assert_eq!(summary["lost_tokens"], 0);
}

#[test]
fn heavy_milling_holds_342_nm() {
    let summary = run("scenarios/milling_heavy.ron");
    assert_reached(&summary, 37.1e-9, 228.3e-9);
    // The rod must really get warm and the field really be asked for, or the scenario shows nothing.
    assert!(number(&summary, "temperature_peak_k") > 293.5, "{summary}");
}

/// k 10 % and c 6 % off: with `a` alone the error reaches 439 nm.
#[test]
fn another_material_is_learned_while_it_is_cut() {
    let summary = run("scenarios/milling_parameters.ron");
    assert_reached(&summary, 3.37e-9, 14.4e-9);
    let k = summary["parameters"]["pinning_a_per_m"][0].as_f64().unwrap();
    assert!((k - 4400.0).abs() < 15.0, "{summary}");
}

/// A rig as it is: without its learner it is off by a micrometre.
#[test]
fn a_rough_rig_is_cut_as_well() {
    let summary = run("scenarios/milling_rough.ron");
    assert_reached(&summary, 16.5e-9, 58.6e-9);
}

/// The sensor jumps twice: the field is held, walks back, and at the end the cut is as good as before.
#[test]
fn a_faulty_sensor_does_not_spoil_the_cut() {
    let summary = run("scenarios/faulty-sensor.ron");
    assert_reached(&summary, 3.22e-9, 12.4e-9);
    assert_eq!(summary["first_event"], 5, "{summary}");
    assert!(
        number(&summary, "field_peak_a_per_m") <= number(&summary, "field_limit_a_per_m"),
        "{summary}"
    );
    assert!(number(&summary, "guarded_ticks") > 0.0, "{summary}");
}

#[test]
fn a_measured_material_is_cut() {
    let summary = run("scenarios/milling_measured_material.ron");
    assert_reached(&summary, 3.22e-9, 14.9e-9);
}

#[test]
fn the_adaptive_loop_beats_a_fixed_inverse_and_a_pid_alone() {
    let scenarios =
        ["pid_alone", "feedforward_only", "fixed_inverse"].map(|name| format!("scenarios/milling_{name}.ron"));
    let mut arguments = vec!["run", "--json"];
    arguments.extend(scenarios.iter().map(String::as_str));
    arguments.push("scenarios/milling.ron");
    let finished = Finished::run(&arguments, LIMIT).expect(0);
    let summaries: Vec<Value> = serde_json::from_str(&finished.out).unwrap();
    let [pid_alone, feedforward_only, fixed_inverse, adaptive] =
        std::array::from_fn(|i| number(&summaries[i], "error_rms_m"));
    assert!(pid_alone >= 300.0 * adaptive, "{pid_alone} m against {adaptive} m");
    assert!(
        fixed_inverse >= 15.0 * adaptive,
        "{fixed_inverse} m against {adaptive} m"
    );
    assert!(
        feedforward_only > fixed_inverse,
        "{feedforward_only} m against {fixed_inverse} m"
    );
}

/// Steps: settled when the reference is, 1.5 times the overshoot that is reached.
#[test]
fn steps_settle_without_overshoot() {
    let summary = run("scenarios/steps.ron");
    assert_reached(&summary, 3.15e-9, 13.4e-9);
    let steps = summary["trajectory"]["steps"].as_array().unwrap();
    assert_eq!(
        (steps.len(), &summary["trajectory"]["kind"]),
        (4, &Value::from("steps"))
    );
    for step in steps {
        assert!(
            number(step, "settling_s") < 5e-3 && number(step, "overshoot_m") < 20e-9,
            "{step}"
        );
        assert!(
            number(step, "times") >= 4.0 && number(step, "unsettled") == 0.0,
            "{step}"
        );
    }
    // Between a step's beginning and its settling nothing counts: 5 ms of every 55 ms.
    let share = number(&summary, "uncounted_ticks") / 20_000.0;
    assert!((0.08..0.1).contains(&share), "{summary}");
}

/// Lines: straight to 1.5 times what is reached; triangle and sawtooth alike, and turns are left out of it.
#[test]
fn lines_are_straight() {
    for (file, lines, length_m, uncounted) in [
        ("raster", 30.0, 60e-6, 13.0 / 33.0),
        ("triangle", 39.0, 64e-6, 0.2),
        ("sawtooth", 19.0, 70e-6, 0.3),
    ] {
        let summary = run(&format!("scenarios/{file}.ron"));
        assert_reached(&summary, 3.15e-9, 13.4e-9);
        let found = &summary["trajectory"];
        assert_eq!(number(found, "lines"), lines, "{found}");
        assert!((number(found, "length_m") / length_m - 1.0).abs() < 1e-9, "{found}");
        assert!(number(found, "nonlinearity_m") < 1.5 * 12.9e-9, "{found}");
        assert!(
            number(found, "speed_error") < 1.5e-4 && number(found, "offset_m") < 2e-9,
            "{found}"
        );
        let share = number(&summary, "uncounted_ticks") / 20_000.0;
        assert!((share - uncounted).abs() < 0.02, "{file}: {share}");
    }
}

/// Over frequency: the feedforward makes the loop follow all of the sweep, and every line of the multisine, as it is.
#[test]
fn sweeps_and_multisines_tell_gain_and_phase() {
    for (file, kind, list, count) in [("sweep", "sweep", "bands", 20), ("multisine", "multisine", "lines", 40)] {
        let summary = run(&format!("scenarios/{file}.ron"));
        assert_reached(&summary, 3.15e-9, 13.4e-9);
        let found = &summary["trajectory"];
        assert_eq!(found["kind"], kind);
        let list = found[list].as_array().unwrap();
        assert_eq!(list.len(), count, "{found}");
        for own in list {
            assert!((number(own, "gain") - 1.0).abs() < 1e-3, "{own}");
            assert!(number(own, "phase_deg").abs() < 0.05, "{own}");
        }
    }
}

#[test]
fn a_table_in_its_own_units_is_followed() {
    assert_reached(&run("scenarios/table.ron"), 3.25e-9, 14.9e-9);
}

/// Guards the summary against silence about an estimate that cannot go where it wants to: the rod's a is beyond its range.
#[test]
fn an_estimate_at_the_end_of_its_range_is_told() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let beyond = "plant.shape=Thermal(reference_a_per_m: 7600, reference_temperature_k: 293)";
    let arguments = [
        "run",
        "scenarios/milling.ron",
        "--embedded",
        "--no-recording",
        "--set",
        beyond,
    ];
    let short = ["--set", "duration_s=1", "--out", &out.to_string_lossy()];
    let finished = Finished::run(&[&arguments[..], &short].concat(), LIMIT).expect(1);
    let told = "noticed: the estimate of a stood at the end of its range, near 7300 A/m, for ";
    assert!(finished.out.contains(told), "{}", finished.out);
}

/// Guards the warning: 1 kHz for a rod of 1275 Hz, said by `check` and by `run`; the shipped cut at 20 kHz is not warned of.
#[test]
fn a_tick_that_is_long_for_the_rod_is_warned_of() {
    let check = |scenario: &str| {
        let finished = Finished::run(&["check", scenario, "--json"], LIMIT).expect(0);
        serde_json::from_str::<Value>(&finished.out).unwrap()
    };
    let slow = check("scenarios/realtime.ron");
    assert!((number(&slow, "samples_per_resonance") - 0.784).abs() < 0.001, "{slow}");
    let warning = slow["warnings"][0].as_str().unwrap();
    assert!(
        warning.contains("long for the rod, 0.8 samples in a period of its resonance at 1275 Hz"),
        "{warning}"
    );
    assert_eq!(check("scenarios/milling.ron")["warnings"], Value::Array(Vec::new()));
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let slowed = [
        "tick_s=2e-4",
        "controller.feedback=None",
        "duration_s=0.6",
        "expect.tolerance_m=None",
    ];
    let out_text = out.to_string_lossy();
    let mut arguments = vec![
        "run",
        "scenarios/milling.ron",
        "--embedded",
        "--no-recording",
        "--out",
        &out_text,
    ];
    slowed.iter().for_each(|setting| arguments.extend(["--set", setting]));
    let finished = Finished::run(&arguments, LIMIT).expect(0);
    assert!(
        finished.out.contains("warning: the tick of 200 µs is long for the rod"),
        "{}",
        finished.out
    );
}

/// Twenty rigs as they scatter: each is cut by what one scenario says of the loop.
#[test]
fn twenty_rough_rigs_are_cut() {
    let files: Vec<String> = (1..=20).map(|rig| format!("scenarios/rough/{rig:02}.ron")).collect();
    let mut arguments = vec!["run", "--json"];
    arguments.extend(files.iter().map(String::as_str));
    let finished = Finished::run(&arguments, LIMIT).expect(0);
    let summaries: Vec<Value> = serde_json::from_str(&finished.out).unwrap();
    assert_eq!(summaries.len(), 20);
    for summary in &summaries {
        let (name, max_m) = (&summary["scenario"], number(summary, "error_max_m"));
        println!(
            "{name}: {:.1} nm rms, {:.1} nm at most",
            1e9 * number(summary, "error_rms_m"),
            1e9 * max_m
        );
        assert_eq!(summary["held"], true, "{summary}");
        assert_eq!(summary["guarded_ticks"], 0, "{summary}");
    }
}

/// Guards the exit status: what does not hold is 1, not 0.
#[test]
fn a_tolerance_that_is_too_tight_is_not_held() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let tight = ["--set", "expect.tolerance_m=1e-9", "--set", "duration_s=0.6"];
    let arguments = [
        &[
            "run",
            "scenarios/milling.ron",
            "--embedded",
            "--no-recording",
            "--out",
            &out.to_string_lossy(),
        ],
        &tight[..],
    ];
    let finished = Finished::run(&arguments.concat(), LIMIT).expect(1);
    assert!(finished.out.contains("NOT held: largest error "), "{}", finished.out);
}

#[test]
fn every_shipped_scenario_passes_the_check() {
    let folder = repository().join("scenarios");
    let mut checked = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "ron") {
            Finished::run(&["check", &path.to_string_lossy()], LIMIT).expect(0);
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(
                text.starts_with("// "),
                "{} does not open with what it shows",
                path.display()
            );
            checked += 1;
        }
    }
    assert!(checked >= 6, "only {checked} scenarios");
}
