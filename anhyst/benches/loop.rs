//! How fast the loop runs: in one process, in seven, and what the recorder costs it.
//!
//! `cargo bench -p anhyst --bench loop`. Pairs are run in turn and their ratio is the median over the pairs, so that a machine
//! whose speed drifts disturbs little. Quote ratios and multiples of real time, not nanoseconds.

use std::process::Command;

const PAIRS: usize = 5;
/// Three processes' worth of loop on one core, so that the recorder has the other.
const LOOP_IN_ONE_PROCESS: &str = "placement=Groups([[plant, estimator, controller, inverse, guard, amplifier]])";

/// Ticks per second of a run of the milling scenario, and whether every token arrived.
fn ticks_per_s(more: &[&str]) -> f64 {
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/milling.ron");
    let out = std::env::temp_dir().join(format!("anhyst-bench-{}", std::process::id()));
    let output = Command::new(env!("CARGO_BIN_EXE_anhyst"))
        .args(["run", scenario, "--json", "--out"])
        .arg(&out)
        .args(more)
        .output()
        .expect("the executable starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a summary");
    assert_eq!(summary["lost_tokens"], 0);
    std::fs::remove_dir_all(&out).expect("the results can be removed");
    summary["ticks_per_s"].as_f64().expect("a number")
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn report(name: &str, with: &[&str], without: &[&str]) {
    let pairs: Vec<(f64, f64)> = (0..PAIRS).map(|_| (ticks_per_s(with), ticks_per_s(without))).collect();
    let speed = |values: Vec<f64>| median(values) / 20e3;
    let (with, without) = (
        speed(pairs.iter().map(|p| p.0).collect()),
        speed(pairs.iter().map(|p| p.1).collect()),
    );
    let slower = median(pairs.iter().map(|(with, without)| without / with).collect());
    println!(
        "{name}: {with:.2} times real time at 20 kHz; without recorder {without:.2}; slower by a factor of {slower:.3}"
    );
}

fn main() {
    report("one process", &["--embedded"], &["--embedded", "--no-recording"]);
    let grouped = ["--set", LOOP_IN_ONE_PROCESS];
    report(
        "loop in one process, recorder in another",
        &grouped,
        &[&grouped[..], &["--no-recording"]].concat(),
    );
    report("seven processes", &[], &["--no-recording"]);
}
