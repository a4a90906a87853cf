//! How fast the loop runs: in one process, in seven, what the recorder costs it, and what five parameters on line do.
//!
//! `cargo bench -p anhyst --bench loop`. Pairs are run in turn and their ratio is the median over the pairs, so that a machine
//! whose speed drifts disturbs little. Quote ratios and multiples of real time, not nanoseconds.

use rustix::process::Pid;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const PAIRS: usize = 5;
/// All of the loop in one process; the recorder, which is not named, gets its own.
const LOOP_IN_ONE_PROCESS: &str = "placement=Groups([[plant, estimator, controller, inverse, guard, amplifier]])";

/// How the processes are spread over two cores.
#[derive(Clone, Copy, PartialEq)]
enum Cores {
    AsTheSystemLikes,
    /// The loop on core 0, the recorder on core 1.
    RecorderApart,
}

/// Ticks per second of a run of the milling scenario; every token must have arrived.
fn ticks_per_s(cores: Cores, more: &[&str]) -> f64 {
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/milling.ron");
    let out = std::env::temp_dir().join(format!("anhyst-bench-{}", std::process::id()));
    let mut command = Command::new(env!("CARGO_BIN_EXE_anhyst"));
    command
        .args(["run", scenario, "--json", "--out"])
        .arg(&out)
        .args(more)
        .stdout(Stdio::piped());
    let child = match cores {
        Cores::AsTheSystemLikes => command.spawn(),
        Cores::RecorderApart => spawn_apart(&mut command),
    };
    let output = child.and_then(Child::wait_with_output).expect("the executable runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a summary");
    assert_eq!(summary["lost_tokens"], 0);
    std::fs::remove_dir_all(&out).expect("the results can be removed");
    summary["ticks_per_s"].as_f64().expect("a number")
}

/// Starts the run on core 0 and moves the recorder, with all its threads, to core 1 as soon as it lives.
fn spawn_apart(command: &mut Command) -> std::io::Result<Child> {
    let everywhere = sched_getaffinity(None)?;
    sched_setaffinity(None, &only(0))?;
    let child = command.spawn();
    sched_setaffinity(None, &everywhere)?;
    let child = child?;
    // Threads that the recorder starts later inherit the core of the one that starts them.
    for _ in 0..50 {
        for task in recorder_threads(child.id()) {
            let _ = sched_setaffinity(Pid::from_raw(task), &only(1));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(child)
}

fn only(core: usize) -> CpuSet {
    let mut set = CpuSet::new();
    set.set(core);
    set
}

fn recorder_threads(launcher: u32) -> Vec<i32> {
    let children = std::fs::read_to_string(format!("/proc/{launcher}/task/{launcher}/children")).unwrap_or_default();
    let is_recorder = |pid: &&str| {
        std::fs::read_to_string(format!("/proc/{pid}/cmdline"))
            .is_ok_and(|line| line.split('\0').nth(2) == Some("recorder"))
    };
    let threads = |pid: &str| {
        std::fs::read_dir(format!("/proc/{pid}/task"))
            .into_iter()
            .flatten()
            .flatten()
    };
    let recorders = children.split_whitespace().filter(is_recorder);
    recorders
        .flat_map(threads)
        .filter_map(|task| task.file_name().to_string_lossy().parse().ok())
        .collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Multiples of real time with and without, and the median of how much slower with is.
fn compare(cores: Cores, with: &[&str], without: &[&str]) -> (f64, f64, f64) {
    let pairs: Vec<(f64, f64)> = (0..PAIRS)
        .map(|_| (ticks_per_s(cores, with), ticks_per_s(cores, without)))
        .collect();
    let speed = |values: Vec<f64>| median(values) / 20e3;
    let (with, without) = (
        speed(pairs.iter().map(|p| p.0).collect()),
        speed(pairs.iter().map(|p| p.1).collect()),
    );
    let slower = median(pairs.iter().map(|(with, without)| without / with).collect());
    (with, without, slower)
}

fn report(name: &str, cores: Cores, with: &[&str], without: &[&str]) {
    let (with, without, slower) = compare(cores, with, without);
    println!(
        "{name}: {with:.2} times real time at 20 kHz; without recorder {without:.2}; slower by a factor of {slower:.3}"
    );
}

fn main() {
    let grouped = ["--set", LOOP_IN_ONE_PROCESS];
    let unrecorded = [&grouped[..], &["--no-recording"]].concat();
    report(
        "one process",
        Cores::AsTheSystemLikes,
        &["--embedded"],
        &["--embedded", "--no-recording"],
    );
    report(
        "loop in one process, recorder in another",
        Cores::AsTheSystemLikes,
        &grouped,
        &unrecorded,
    );
    report("seven processes", Cores::AsTheSystemLikes, &[], &["--no-recording"]);
    report(
        "seven processes, the recorder's core free of the loop",
        Cores::RecorderApart,
        &[],
        &["--no-recording"],
    );
    let bare = ["--embedded", "--no-recording"];
    let several = [
        &bare[..],
        &["--set", "estimator.law=MultiParameter(coupling: (share: 0.05))"],
    ]
    .concat();
    let (several, one, slower) = compare(Cores::AsTheSystemLikes, &several, &bare);
    println!(
        "five parameters on line: {several:.2} times real time at 20 kHz; `a` alone {one:.2}; slower by a factor of {slower:.3}"
    );
}
