//! Guards `anhyst verify-amplifier`: the right amplifier passes, and each wrong one fails for what it does wrong and for
//! nothing else. No bound here is on time: the latency limit is ten seconds.

use anhyst_tests::{Finished, LIMIT, SharedMemory, anhyst, files_with, start};
use serde_json::Value;
use std::path::Path;
use std::time::Duration;

/// What each wrong amplifier does, the checks that must fail, and the exit status.
const WRONG: [(&str, &[&str], i32); 19] = [
    ("permuted_layout", &["layout"], 1),
    ("silent_after_100_ticks", &["rate"], 1),
    ("skips_a_tick", &["rate"], 1),
    ("numbers_ticks_from_one", &["rate"], 1),
    ("dies_after_100_ticks", &[], 3),
    ("stuck_after_300_ticks", &["stuck"], 1),
    ("wrong_sign", &["sign"], 1),
    ("answers_in_oersted", &["unit"], 1),
    ("gain_of_ten_percent_more", &["gain"], 1),
    ("with_offset", &["offset"], 1),
    ("noisy", &["noise"], 1),
    ("late_by_three_ticks", &["delay"], 1),
    ("early_by_a_tick", &["delay"], 1),
    ("slow_bandwidth", &["bandwidth"], 1),
    ("without_limit", &["limit"], 1),
    ("without_slew_limit", &["slew"], 1),
    ("hides_its_limits", &["limit_reported", "slew_reported"], 1),
    ("answers_nan", &["finite"], 1),
    ("latches_after_nonsense", &["recovery"], 1),
];

struct Verified {
    finished: Finished,
    report: Value,
    page: String,
}

impl Verified {
    fn failed(&self) -> Vec<&str> {
        let checks = self.report["checks"].as_array().unwrap();
        let failed = checks.iter().filter(|check| check["passed"] == false);
        failed.map(|check| check["name"].as_str().unwrap()).collect()
    }
}

/// Verifies the process that `command` starts, and proves that nothing of it is left.
fn verify(command: &str) -> Verified {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_string_lossy().into_owned();
    let launcher = start(&[
        "verify-amplifier",
        "scenarios/amplifier.ron",
        "--out",
        &folder,
        "--command",
        command,
        "--silence-s",
        "4",
        "--latency-limit-s",
        "10",
        "--start-limit-s",
        "60",
    ]);
    let prefix = format!("anhyst_{}_", launcher.id());
    let finished = Finished::wait(launcher, LIMIT);
    assert_eq!(files_with(&prefix), Vec::<String>::new(), "after {command}");
    let read = |name: &str| std::fs::read_to_string(Path::new(&folder).join(name));
    let text = read("amplifier.json").unwrap_or_else(|error| panic!("{error}: {}{}", finished.out, finished.err));
    Verified {
        report: serde_json::from_str(&text).unwrap(),
        page: read("report.html").unwrap(),
        finished,
    }
}

fn wrong(mistake: &str) -> Verified {
    verify(&format!("exec {} {mistake}", env!("CARGO_BIN_EXE_wrong_amplifier")))
}

/// The simulated amplifier keeps what it promises; the report has the pictures.
#[test]
fn the_simulated_amplifier_passes() {
    let folder = tempfile::tempdir().unwrap();
    let verified = verify(&format!(
        "exec {} node amplifier \"$ANHYST_SCENARIO\" --out {} --service-prefix \"$ANHYST_SERVICE_PREFIX\" --root \"$ANHYST_ROOT\"",
        anhyst().display(),
        folder.path().display()
    ));
    let Verified { finished, report, page } = verified;
    let finished = finished.expect(0);
    assert_eq!(report["passed"], true, "{}", finished.out);
    let checks = report["checks"].as_array().unwrap();
    assert!(checks.len() >= 20, "{} checks: {}", checks.len(), finished.out);
    for check in checks {
        let what = ["name", "unit", "sentence"].map(|key| check[key].is_string());
        assert_eq!(what, [true; 3], "{check}");
        assert!(check["value"].is_number() && check["limit"].is_number(), "{check}");
    }
    assert_eq!(report["not_judged"], Value::Array(Vec::new()));
    let charts = page.matches("<div class=\"chart\">").count();
    assert!(charts >= 6, "{charts} charts");
    assert!(!page.contains("src=\"http"), "the page must be self-contained");
}

/// The right amplifier of the fault family passes, too: it is the mistake that fails, not the family.
#[test]
fn without_a_mistake_the_wrong_amplifier_passes() {
    let verified = wrong("no_mistake");
    assert_eq!(verified.failed(), Vec::<&str>::new(), "{}", verified.finished.out);
    verified.finished.expect(0);
}

#[test]
fn each_wrong_amplifier_fails_for_what_it_does() {
    for (mistake, failing, code) in WRONG {
        let verified = wrong(mistake);
        let said = format!("{mistake}:\n{}", verified.finished.out);
        assert_eq!(verified.finished.code, Some(code), "{said}");
        assert_eq!(verified.report["passed"], false, "{said}");
        assert_eq!(verified.failed(), failing, "{said}");
    }
}

/// Guards the safe field: a driver that holds the field when nobody commands must not be let near a rig.
#[test]
fn an_amplifier_that_ignores_a_dead_controller_fails() {
    let verified = wrong("ignores_dead_controller");
    assert_eq!(
        verified.failed(),
        ["safe_when_controller_dies"],
        "{}",
        verified.finished.out
    );
    verified.finished.expect(1);
}

/// Guards the reasons: they are sentences that name what is wrong.
#[test]
fn the_sentences_name_the_fault() {
    for (mistake, words) in [
        ("answers_in_oersted", "Oe"),
        ("late_by_three_ticks", "3 ticks later than stated"),
        ("dies_after_100_ticks", "ended with exit status 7"),
        ("permuted_layout", "it speaks CoilField of 32 bytes"),
    ] {
        let verified = wrong(mistake);
        assert!(
            verified.finished.out.contains(words),
            "{mistake}:\n{}",
            verified.finished.out
        );
    }
}

#[test]
fn a_command_that_starts_nothing_is_status_3() {
    let verified = verify("echo cannot open the bus; exit 9");
    assert!(
        verified
            .finished
            .out
            .contains("ended with exit status 9: cannot open the bus"),
        "{}",
        verified.finished.out
    );
    verified.finished.expect(3);
}

#[test]
fn bad_input_is_status_2() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_string_lossy().into_owned();
    let base = ["verify-amplifier", "scenarios/amplifier.ron", "--out", &folder];
    for bad in [
        ["--limit-a-per-m", "-1"],
        ["--silence-s", "0"],
        ["--bandwidth-hz", "0.001"],
    ] {
        let finished = Finished::run(&[&base[..], &bad[..]].concat(), LIMIT).expect(2);
        assert!(!finished.err.is_empty());
    }
}

/// Guards /dev/shm after a test under names that the user chose, with a driver that was started by hand: nothing stays.
#[test]
fn by_hand_nothing_is_left_either() {
    let memory = SharedMemory::unique();
    let root = memory.root.to_string_lossy().into_owned();
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_string_lossy().into_owned();
    let names = ["--service-prefix", &memory.prefix, "--root", &root];
    let limits = ["--silence-s", "1", "--latency-limit-s", "10", "--start-limit-s", "60"];
    let base = ["verify-amplifier", "scenarios/amplifier.ron", "--out", &folder];
    let verifier = start(&[&base[..], &names, &limits].concat());
    // As people do it: when the verifier has said where to meet, the scenario is written.
    let scenario = out.path().join("scenario.ron");
    let since = std::time::Instant::now();
    while !std::fs::read_to_string(&scenario).is_ok_and(|text| text.trim_end().ends_with(')')) {
        assert!(since.elapsed() < LIMIT, "no scenario.ron");
        std::thread::sleep(Duration::from_millis(10));
    }
    let process = out.path().join("process").to_string_lossy().into_owned();
    let driver = ["node", "amplifier", &scenario.to_string_lossy(), "--out", &process];
    let driver = start(&[&driver[..], &names].concat());
    Finished::wait(verifier, LIMIT).expect(0);
    Finished::wait(driver, LIMIT);
    assert_eq!(memory.files(), Vec::<String>::new());
    assert!(!memory.root.exists(), "{root} is still there");
}

/// Guards the sentence: who starts a driver must read where it was waited for.
#[test]
fn a_driver_that_does_not_come_is_told_where_to_meet() {
    let memory = SharedMemory::unique();
    let root = memory.root.to_string_lossy().into_owned();
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_string_lossy().into_owned();
    let base = ["verify-amplifier", "scenarios/amplifier.ron", "--out", &folder];
    let names = [
        "--service-prefix",
        &memory.prefix,
        "--root",
        &root,
        "--start-limit-s",
        "0.5",
    ];
    let finished = Finished::run(&[&base[..], &names].concat(), LIMIT).expect(3);
    let place = format!("ANHYST_SERVICE_PREFIX={} ANHYST_ROOT={root}", memory.prefix);
    assert!(
        finished.out.contains("amplifier did not come within"),
        "{}",
        finished.out
    );
    assert!(finished.out.contains(&place), "{}", finished.out);
    assert_eq!(memory.files(), Vec::<String>::new());
}
