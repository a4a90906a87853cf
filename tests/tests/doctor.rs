//! Guards the advice of `anhyst doctor --realtime` and `--lockstep`: every way is measured, and what it says to paste is a scenario. How late a
//! run is, or how fast, is the machine's affair and not judged.

use anhyst_tests::{Finished, LIMIT, alone, files_with, folders, start};
use serde_json::Value;
use std::collections::BTreeSet;

const SCENARIO: &str = "scenarios/realtime.ron";

/// What the doctor prints, who leaves nothing in shared memory.
fn found(asked: &[&str]) -> Value {
    let (_root, [folder]) = folders();
    let out = folder.to_string_lossy();
    let launcher = start(
        &[
            &["doctor", "--set", "expect.settling_s=0", "--out", &out, "--json"],
            asked,
        ]
        .concat(),
    );
    let id = launcher.id();
    let finished = Finished::wait(launcher, LIMIT).expect(0);
    assert_eq!(files_with(&format!("anhyst_{id}_")), Vec::<String>::new());
    serde_json::from_str(&finished.out).unwrap()
}

#[test]
fn every_way_is_measured_and_what_is_advised_can_be_run() {
    let _alone = alone();
    let found = found(&["--realtime", SCENARIO, "--duration-s", "0.3", "--rate-hz", "1000"]);
    let ways = found["ways"].as_array().unwrap();
    let kinds: BTreeSet<_> = ways
        .iter()
        .map(|one| (one["way"]["wait"].to_string(), one["way"]["placement"].to_string()))
        .collect();
    assert_eq!(kinds.len(), 6, "{kinds:?}");
    for one in ways.iter().chain(found["rates"].as_array().unwrap()) {
        let number = |name: &str| one[name].as_f64().unwrap_or(f64::NAN);
        assert_eq!(number("ticks"), (0.3 * number("rate_hz")).round(), "{one}");
        assert!((0.0..=1.0).contains(&number("late_share")), "{one}");
        // A process that polls uses more than none of a CPU, and six cannot use more than there are.
        let cpus = found["cpus"].as_f64().unwrap();
        assert!(number("cpus_used") > 0.0 && number("cpus_used") < 1.1 * cpus, "{one}");
    }
    let kept = found["rates"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|one| one["late_share"].as_f64() < Some(1e-3));
    let highest = kept.filter_map(|one| one["rate_hz"].as_f64()).reduce(f64::max);
    assert_eq!(found["highest_rate_hz"].as_f64(), highest);
    let settings = found["settings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|setting| setting.as_str().unwrap());
    let settings: Vec<&str> = settings.flat_map(|setting| ["--set", setting]).collect();
    Finished::run(&[&["check", SCENARIO], &settings[..]].concat(), LIMIT).expect(0);
}

#[test]
fn hops_are_measured_and_the_fastest_way_can_be_run() {
    let _alone = alone();
    // In real time by itself: what is advised must say that it is not to be.
    let found = found(&["--lockstep", SCENARIO, "--duration-s", "0.6"]);
    let ways = found["ways"].as_array().unwrap();
    // The blocks alone, and two placements, on one core and polling on all.
    assert_eq!(ways.len(), 1 + 2 * 2);
    for one in ways {
        assert!(one["ticks_per_s"].as_f64() > Some(0.0), "{one}");
        assert_eq!(one["hop_us"].is_number(), one["hops"] != 0, "{one}");
    }
    let best = |of: &dyn Fn(&&Value) -> bool| {
        let rate = |one: &&Value| one["ticks_per_s"].as_f64().unwrap();
        let best = ways
            .iter()
            .filter(of)
            .max_by(|one, other| rate(one).total_cmp(&rate(other)));
        best.unwrap()["command"].as_str().unwrap()
    };
    assert_eq!(found["separate"], best(&|one| one["hops"] == 6));
    assert_eq!(found["fastest"], best(&|one| one["hops"] != 0));
    // As typed, but for a folder of its own.
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("run");
    let words = found["separate"].as_str().unwrap().strip_prefix("anhyst ").unwrap();
    let words = words.split(' ').map(|word| word.trim_matches('\''));
    let more = [
        "--set",
        "duration_s=0.2",
        "--no-recording",
        "--out",
        folder.to_str().unwrap(),
    ];
    let run = Finished::run(&words.chain(more).collect::<Vec<_>>(), LIMIT).expect(0);
    assert!(
        run.out.contains("(0 lost)") && !run.out.contains("missed deadlines"),
        "{}",
        run.out
    );
}
