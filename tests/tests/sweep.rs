//! Guards sweeps: the same table whatever the threads, kills and shards; nothing runs when a value is refused; no folder of another
//! sweep is gone on with.

use anhyst_tests::{Finished, LIMIT, folders, start, wait_for};
use std::path::Path;
use std::time::Duration;

/// 400 runs of a few milliseconds.
const SMALL: [&str; 14] = [
    "sweep",
    "scenarios/milling.ron",
    "--set",
    "controller.start_s=0.0",
    "--set",
    "duration_s=0.02",
    "--set",
    "expect.settling_s=0.01",
    "--vary",
    "controller.feedback.kp=0.1..0.5:20",
    "--vary",
    "plant.sensors.displacement_noise_m=[1e-9, 1e-8]",
    "--seeds",
    "10",
];
const RUNS: usize = 400;
const RESULTS: [&str; 3] = ["sweep.csv", "sweep.parquet", "sweep.html"];

fn sweep<'a>(out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], &["--out", out.to_str().unwrap()], more].concat()
}

fn results(folder: &Path) -> [Vec<u8>; 3] {
    RESULTS.map(|name| std::fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}")))
}

fn assert_same_results(one: &Path, other: &Path) {
    for ((one, other), name) in results(one).iter().zip(&results(other)).zip(RESULTS) {
        assert!(one == other, "{name} differs");
    }
}

fn rows(folder: &Path) -> usize {
    let text = std::fs::read(folder.join("rows.jsonl")).unwrap_or_default();
    text.iter().filter(|byte| **byte == b'\n').count()
}

/// Killed at ten instants from a fixed seed, and gone on with after each.
#[test]
fn a_killed_sweep_that_is_gone_on_with_has_the_same_table() {
    let (_root, [whole, killed]) = folders();
    Finished::run(&sweep(&whole, &["--threads", "1"]), LIMIT).expect(0);
    let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut under_way = 0;
    for kill in 0..10 {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let mut child = start(&sweep(&killed, &[]));
        // At any instant of the beginning, and at any while runs come to their end.
        let most_ms = if kill % 2 == 0 { 200 } else { 40 };
        if kill % 2 == 1 {
            let before = rows(&killed);
            wait_for(&mut child, || (rows(&killed) > before).then_some(()));
        }
        std::thread::sleep(Duration::from_millis(state % most_ms));
        child.kill().unwrap();
        Finished::wait(child, LIMIT);
        under_way += usize::from((1..RUNS).contains(&rows(&killed)));
    }
    // What a kill in the middle of a line leaves behind.
    let path = killed.join("rows.jsonl");
    let text = std::fs::read(&path).unwrap_or_default();
    let last = text.len().saturating_sub(30);
    if under_way > 0 {
        std::fs::write(&path, &text[..last]).unwrap();
    }
    let before = rows(&killed);
    let finished = Finished::run(&sweep(&killed, &["--json"]), LIMIT).expect(0);
    let told: serde_json::Value = serde_json::from_str(&finished.out).unwrap();
    // Lost: what was under way. Made twice: nothing.
    assert_eq!(told["made"]["runs"].as_u64().unwrap_or(0) as usize, RUNS - before);
    assert_eq!((told["found"].as_u64(), rows(&killed)), (Some(RUNS as u64), RUNS));
    assert!(under_way > 0, "no kill came while runs were under way");
    assert_same_results(&whole, &killed);
    // Once more: nothing is left to do, and the results are the same.
    let again = Finished::run(&sweep(&killed, &["--json"]), LIMIT).expect(0);
    let told: serde_json::Value = serde_json::from_str(&again.out).unwrap();
    assert!(told["made"].is_null(), "{told}");
    assert_same_results(&whole, &killed);
}

#[test]
fn gathered_shards_are_the_whole_sweep() {
    let (root, [whole, one, two, three, gathered]) = folders();
    Finished::run(&sweep(&whole, &[]), LIMIT).expect(0);
    let gather = |parts: &[&Path], code: i32| {
        let parts = parts.iter().map(|part| part.to_str().unwrap());
        let arguments: Vec<&str> = ["gather"]
            .into_iter()
            .chain(parts)
            .chain(["--out", gathered.to_str().unwrap()])
            .collect();
        Finished::run(&arguments, LIMIT).expect(code)
    };
    for (folder, shard) in [(&one, "1/3"), (&two, "2/3")] {
        Finished::run(&sweep(folder, &["--shard", shard]), LIMIT).expect(0);
    }
    let lacking = gather(&[&one, &two], 1).err;
    assert!(lacking.contains("133 of 400 runs are missing: 2, 5, 8,"), "{lacking}");
    assert!(!gathered.join("sweep.csv").exists());
    Finished::run(&sweep(&three, &["--shard", "3/3"]), LIMIT).expect(0);
    // A shard that was made twice is as good as once.
    let again = root.path().join("again");
    Finished::run(&sweep(&again, &["--shard", "2/3", "--threads", "1"]), LIMIT).expect(0);
    gather(&[&three, &two, &one, &again], 0);
    assert_same_results(&whole, &gathered);
    // A row that says otherwise is no part of it.
    let rows = two.join("rows.jsonl");
    let text = std::fs::read_to_string(&rows).unwrap();
    std::fs::write(&rows, text.replacen("\"ticks\":400", "\"ticks\":401", 1)).unwrap();
    let refused = gather(&[&two, &again], 2).err;
    assert!(refused.contains("has run ") && refused.contains("again"), "{refused}");
}

/// A sweep's run is the run: the same digest as `anhyst run` with the same settings.
#[test]
fn a_run_of_a_sweep_is_the_run() {
    let (_root, [swept, run]) = folders();
    let settings = ["--set", "duration_s=0.15", "--set", "expect.settling_s=0.12"];
    let scenario = ["sweep", "scenarios/milling.ron"];
    let vary = ["--vary", "controller.feedback.kp=[0.3, 0.4]", "--seeds", "2", "--out"];
    let more = [swept.to_str().unwrap(), "--threads", "100000", "--json"];
    let told = Finished::run(&[&scenario[..], &settings, &vary, &more].concat(), LIMIT).expect(0);
    // No more threads than runs, and no more time in runs than the threads had.
    let told: serde_json::Value = serde_json::from_str(&told.out).unwrap();
    let made = |name: &str| told["made"][name].as_f64().unwrap();
    assert_eq!(made("threads"), 4.0);
    assert!(made("in_runs_s") <= 4.0 * made("took_s"), "{told}");
    let table = std::fs::read_to_string(swept.join("sweep.csv")).unwrap();
    let last: Vec<&str> = table.lines().last().unwrap().split(',').collect();
    let own = ["--set", "controller.feedback.kp=0.4", "--set", "seed=2"];
    let scenario = ["run", "scenarios/milling.ron", "--embedded", "--no-recording", "--out"];
    let arguments = [&scenario[..], &[run.to_str().unwrap()], &settings, &own].concat();
    Finished::run(&arguments, LIMIT);
    assert_eq!(last.last().copied(), Some(anhyst_tests::digest(&run).as_str()));
    assert_eq!(last[..3], ["3", "0.4", "2"]);
}

#[test]
fn what_cannot_be_is_refused_before_anything_runs() {
    let (_root, [out]) = folders();
    let text = out.to_str().unwrap();
    for (more, words) in [
        (
            &["--vary", "controller.feedback.kq=1..2:2"][..],
            &["kq", "expected one of `kp`", "as changed by --vary"][..],
        ),
        (
            &["--vary", "controller.feedback.kp=[0.1, fast]"],
            &["controller.feedback.kp", "a number"],
        ),
        (&["--vary", "tick_s=5e-5..-5e-5:2"], &["tick_s"]),
        (&["--vary", "controller.feedback.kp=1..2"], &["how many values"]),
        (&["--vary", "seed=1..2:2"], &["--seeds"]),
        (&["--shard", "3/2"], &["3/2"]),
        (&["--seeds", "0"], &["0 is no whole number of at least 1"]),
    ] {
        let arguments = [&["sweep", "scenarios/milling.ron", "--out", text], more].concat();
        let refused = Finished::run(&arguments, LIMIT).expect(2);
        for word in words {
            assert!(refused.err.contains(word), "{word}: {}", refused.err);
        }
        assert!(!out.exists(), "{more:?}");
    }
    let realtime = Finished::run(&["sweep", "scenarios/realtime.ron", "--out", text], LIMIT).expect(2);
    assert!(realtime.err.contains("in lockstep"), "{}", realtime.err);
}

#[test]
fn the_folder_of_another_sweep_is_refused_by_what_differs() {
    let (_root, [out]) = folders();
    let text = out.to_str().unwrap();
    let of = |more: &[&str]| {
        let small = ["--set", "duration_s=0.11", "--set", "expect.settling_s=0.1"];
        let arguments = [&["sweep", "scenarios/milling.ron", "--out", text], &small[..], more].concat();
        Finished::run(&arguments, LIMIT)
    };
    of(&["--vary", "controller.feedback.kp=[0.1, 0.2]"]).expect(0);
    let before = results(&out);
    for (more, words) in [
        (
            &["--vary", "controller.feedback.kp=[0.1, 0.3]"][..],
            "at place 2 0.2 there, 0.3 here",
        ),
        (
            &["--vary", "controller.feedback.ki_per_s=[0.1, 0.2]"],
            "controller.feedback.kp varies",
        ),
        (
            &["--vary", "controller.feedback.kp=[0.1, 0.2]", "--seeds", "3"],
            "--seeds is 1 there",
        ),
        (
            &[
                "--vary",
                "controller.feedback.kp=[0.1, 0.2]",
                "--set",
                "guard.field_limit_a_per_m=31e3",
            ],
            "guard.field_limit_a_per_m is 30000.0 there, and 31000.0",
        ),
        (
            &["--vary", "controller.feedback.kp=[0.1, 0.2]", "--shard", "1/2"],
            "shard 1/1 is there",
        ),
    ] {
        let refused = of(more).expect(2);
        assert!(refused.err.contains(words), "{words}: {}", refused.err);
    }
    assert!(before == results(&out));
}
