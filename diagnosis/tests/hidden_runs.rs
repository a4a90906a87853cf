//! The workflow on runs of an independent simulator in which one effect is hidden each.
//!
//! The runs are not part of the project; one who has them says where:
//! `ANHYST_HIDDEN_RUNS=DIR cargo test --release -p anhyst-diagnosis --test hidden_runs -- --ignored --nocapture`.

use std::path::Path;
use std::time::Instant;

use anhyst_diagnosis::{DiagnoseOptions, Diagnosis, Verdict, diagnose};
use anhyst_measured::{MeasuredRun, RunReadOptions};
use anhyst_model::ActuatorModel;
use serde_json::Value;

/// Effects that no library holds.
fn unlisted(name: &str) -> bool {
    name.starts_with("x_")
}

fn right(found: &Diagnosis, truth: &[&str]) -> bool {
    let sorted = |mut names: Vec<String>| {
        names.sort();
        names
    };
    let effects: Vec<String> = found.effects.iter().map(|effect| effect.name.clone()).collect();
    match truth {
        ["none"] => found.verdict == Verdict::None,
        [only] if unlisted(only) => found.verdict == Verdict::Unknown,
        _ => {
            let truth = sorted(truth.iter().map(|name| (*name).to_owned()).collect());
            let tied = found
                .ambiguous_with
                .iter()
                .map(|names| sorted(names.split(" + ").map(str::to_owned).collect()));
            let named = !matches!(found.verdict, Verdict::None | Verdict::Unknown | Verdict::NotExcited);
            named
                && found.ambiguous_with.len() < 3
                && (sorted(effects) == truth || tied.into_iter().any(|own| own == truth))
        }
    }
}

fn fitted(found: &Diagnosis) -> String {
    let effects = found.effects.iter().map(|effect| {
        let values = effect.values.iter().map(|value| {
            let deviation = value
                .standard_deviation
                .map_or("?".to_owned(), |deviation| format!("{deviation:.1e}"));
            format!("{:.6e} ± {deviation}", value.value)
        });
        format!("{} {}", effect.name, values.collect::<Vec<_>>().join(", "))
    });
    effects.collect::<Vec<_>>().join("; ")
}

/// Guards the whole workflow: the true name (or a flagged tie that holds it), and a held-out gap at the noise.
#[test]
#[ignore = "needs the hidden runs; ANHYST_HIDDEN_RUNS says where they are"]
fn what_is_hidden_is_found() {
    let folder = std::env::var("ANHYST_HIDDEN_RUNS").expect("ANHYST_HIDDEN_RUNS");
    let only = std::env::var("ANHYST_HIDDEN_ONLY").unwrap_or_default();
    let labels = std::fs::read_to_string(format!("{folder}/labels.json")).expect("labels");
    let labels: Value = serde_json::from_str(&labels).expect("JSON");
    let mut wrong = Vec::new();
    for (name, label) in labels.as_object().expect("cases") {
        if !only.is_empty() && !only.split(',').any(|own| own == name) {
            continue;
        }
        let truth: Vec<&str> = label["effects"]
            .as_array()
            .expect("effects")
            .iter()
            .filter_map(Value::as_str)
            .collect();
        let file = format!("{folder}/{name}.csv");
        let run = MeasuredRun::read(Path::new(&file), &RunReadOptions::default()).expect("a run");
        let begin = Instant::now();
        let found = diagnose(
            &ActuatorModel::terfenol_d(),
            &[run],
            &DiagnoseOptions::default(),
            &mut |_, _| (),
        )
        .expect("a diagnosis")
        .diagnosis;
        println!(
            "{name} {:26} {:9} {:.1} s, gap {:.1} -> {:.2} nm, noise {:.2} nm, dBIC {:.0}, confidence {:.3}\n       {}; ties {:?}; truth {}",
            truth.join(" + "),
            found.verdict.name(),
            begin.elapsed().as_secs_f64(),
            1e9 * found.gap_before,
            1e9 * found.gap_after,
            1e9 * found.noise_rms,
            found.delta_bic.unwrap_or(f64::NAN),
            found.confidence,
            fitted(&found),
            found.ambiguous_with,
            label["truth"]
        );
        println!("       {}", found.sentence);
        for group in found.test_after.groups.iter().take(2) {
            println!(
                "       left: {} S {:.1} df {} tail {:.1e}",
                group.name, group.statistic, group.degrees, group.tail
            );
        }
        if std::env::var("ANHYST_VERBOSE").is_ok() {
            for candidate in found.candidates.iter().take(12) {
                println!(
                    "       {} {:.1} {:.3e}",
                    candidate.name, candidate.delta_bic, candidate.gap_after
                );
            }
            for sentence in &found.place {
                println!("       where: {sentence}");
            }
            for own in &found.detectable {
                println!(
                    "       seen: {} {} {:.3e} {}",
                    own.term, own.quantity, own.smallest, own.unit
                );
            }
            for own in &found.not_excited {
                println!("       not seen: {} {}", own.term, own.reason);
            }
            println!("       {:?}", found.experiment);
        }
        let noise = truth != ["none"] && !unlisted(truth[0]) && found.gap_after > 1.1 * found.noise_rms;
        if !right(&found, &truth) || noise {
            wrong.push(name.clone());
        }
    }
    assert!(wrong.is_empty(), "wrong: {wrong:?}");
}
