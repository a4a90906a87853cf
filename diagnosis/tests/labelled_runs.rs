//! Guards what a diagnosis is for, on labelled runs of independent simulators: `hidden` (clean) and `rigged` (with a rig's nuisances).
//!
//! The runs are not part of the project. They are looked for in `../shared`, or where `ANHYST_SHARED` says; without them nothing is
//! tested. `ANHYST_ONLY=rig03,case07` picks some, `ANHYST_VERBOSE=1` says more.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anhyst_diagnosis::{Cost, DiagnoseOptions, Diagnosis, FoundEffect, Verdict, diagnose};
use anhyst_measured::{MeasuredRun, RunReadOptions};
use anhyst_model::ActuatorModel;
use serde_json::Value;

fn shared(folder: &str) -> Option<PathBuf> {
    let own = std::env::var("ANHYST_SHARED").map(PathBuf::from);
    let own = own.unwrap_or_else(|_| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"));
    let folder = own.join(folder);
    if !folder.is_dir() {
        println!("no {}: nothing is tested", folder.display());
    }
    folder.is_dir().then_some(folder)
}

fn labels(folder: &Path) -> Vec<(String, Value)> {
    let text = std::fs::read_to_string(folder.join("labels.json")).expect("labels");
    let labels: Value = serde_json::from_str(&text).expect("JSON");
    let only = std::env::var("ANHYST_ONLY").unwrap_or_default();
    let chosen = |name: &str| only.is_empty() || only.split(',').any(|own| name.starts_with(own));
    let all = labels.as_object().expect("cases").iter();
    all.filter(|(name, _)| chosen(name))
        .map(|(name, label)| (name.clone(), label.clone()))
        .collect()
}

fn sorted(mut names: Vec<String>) -> Vec<String> {
    names.sort();
    names
}

/// `x_…` is in no library.
fn right(found: &Diagnosis, truth: &[String]) -> bool {
    let effects: Vec<String> = found.effects.iter().map(|effect| effect.name.clone()).collect();
    match truth {
        [only] if only == "none" => found.verdict == Verdict::None,
        [only] if only.starts_with("x_") => found.verdict == Verdict::Unknown && effects.is_empty(),
        _ => {
            let truth = sorted(truth.to_vec());
            let tied = found.ambiguous_with.iter();
            let mut tied = tied.map(|names| sorted(names.split(" + ").map(str::to_owned).collect()));
            sorted(effects) == truth || tied.any(|own| own == truth)
        }
    }
}

fn text(effects: &[FoundEffect]) -> String {
    let effects = effects.iter().map(|effect| {
        let values = effect.values.iter().map(|value| {
            let deviation = value
                .standard_deviation
                .map_or("?".to_owned(), |own| format!("{own:.1e}"));
            format!("{:.5e} ± {deviation}", value.value)
        });
        let values = values.collect::<Vec<_>>().join(", ");
        format!("{} {:.3} ({values})", effect.name, effect.share)
    });
    effects.collect::<Vec<_>>().join("; ")
}

/// Diagnoses every run of a folder; the names of those that are wrong.
fn wrong(folder: &Path, truth: impl Fn(&Value) -> Vec<String>) -> Vec<String> {
    let mut wrong = Vec::new();
    for (name, label) in labels(folder) {
        let truth = truth(&label);
        let files = ["csv", "parquet"].map(|extension| folder.join(format!("{name}.{extension}")));
        let file = files.into_iter().find(|file| file.exists()).expect("a run");
        let run = MeasuredRun::read(&file, &RunReadOptions::default()).expect("a run");
        let begin = Instant::now();
        let model = ActuatorModel::terfenol_d();
        let options = DiagnoseOptions::default();
        let mut progress = |what: &str, _: f64| {
            if std::env::var("ANHYST_VERBOSE").is_ok() {
                println!("{:6.1} s {what}", begin.elapsed().as_secs_f64());
            }
        };
        let found = diagnose(&model, &[run], &options, &mut progress)
            .expect("a diagnosis")
            .diagnosis;
        let right = right(&found, &truth);
        println!(
            "{} {name} {} {}: {} {:.1} s, gap {:.1} -> {:.2} nm held out, left {:.2}, noise {:.2} nm, explained {:.4}, confidence {:.3}, ties {:?}\n       {}",
            if right { "ok   " } else { "WRONG" },
            truth.join(" + "),
            label["nuisance"].as_str().unwrap_or(""),
            found.verdict.name(),
            begin.elapsed().as_secs_f64(),
            1e9 * found.gap_before,
            1e9 * found.gap_after,
            1e9 * found.remainder_rms,
            1e9 * found.noise_rms,
            found.explained,
            found.confidence,
            found.ambiguous_with,
            text(&found.effects),
        );
        let sum = |of: fn(&Cost) -> usize| found.cost.iter().map(of).sum::<usize>();
        println!(
            "       {} simulations, {} from the field on",
            sum(|own| own.simulations),
            sum(|own| own.magnetized)
        );
        if std::env::var("ANHYST_VERBOSE").is_ok() {
            for own in &found.cost {
                println!(
                    "       {}: {} simulations, {} from the field on, {:.1} s",
                    own.work, own.simulations, own.magnetized, own.seconds
                );
            }
            println!(
                "       nuisance {}\n       parameters {}",
                text(&found.nuisance),
                text(&found.parameters)
            );
            for candidate in found.candidates.iter().take(8) {
                println!(
                    "       {} {:.1} {:.3e}",
                    candidate.name, candidate.delta_bic, candidate.gap_after
                );
            }
            for test in [&found.test_before, &found.test_after] {
                let groups = test.groups.iter().take(6);
                let groups: Vec<String> = groups
                    .map(|own| format!("{} {:.0}/{}", own.name, own.statistic, own.degrees))
                    .collect();
                println!("       {}", groups.join(", "));
            }
            println!("       {}", found.sentence);
        }
        if !right {
            wrong.push(name);
        }
    }
    wrong
}

#[test]
fn clean_runs() {
    let Some(folder) = shared("hidden") else { return };
    let truth = |label: &Value| {
        let names = label["effects"].as_array().expect("effects").iter();
        names.filter_map(Value::as_str).map(str::to_owned).collect()
    };
    let wrong = wrong(&folder, truth);
    assert!(wrong.is_empty(), "wrong: {wrong:?}");
}

#[test]
fn rigged_runs() {
    let Some(folder) = shared("rigged") else { return };
    let truth = |label: &Value| {
        label["hidden"]
            .as_str()
            .expect("hidden")
            .split(" + ")
            .map(str::to_owned)
            .collect()
    };
    let wrong = wrong(&folder, truth);
    assert!(wrong.is_empty(), "wrong: {wrong:?}");
}
