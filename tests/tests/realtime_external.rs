//! Guards real time with somebody else's process in the loop: it takes part in both paces, what our nodes consumed of it runs
//! again bit for bit, and if it dies or hangs the run ends by its name with the coil at rest. No figure of time is judged.

use anhyst_ipc::{CoilField, NodeId, SafeField};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Logs;
use anhyst_tests::{
    A_FEW, Finished, LIMIT, alone, anhyst, children, files_with, python, start, summary_as_judged, wait_for,
};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::Child;

const FIELD_LIMIT_A_PER_M: f64 = 30e3;
const TICK_S: f64 = 1e-3;
/// How long a foreign process may be silent, in ticks: 2 s.
const SILENCE_LIMIT_TICKS: u64 = 2000;
const OURS: [NodeId; 5] = [
    NodeId::Plant,
    NodeId::Estimator,
    NodeId::Controller,
    NodeId::Inverse,
    NodeId::Guard,
];

/// A run at 1 kHz whose error is not judged, with this amplifier.
fn begin(out: &Path, amplifier: &str, duration_s: &str, pace: &str) -> Child {
    let (tick, duration) = (format!("tick_s={TICK_S}"), format!("duration_s={duration_s}"));
    let (command, out) = (format!("amplifier=exec {amplifier}"), out.to_string_lossy());
    // Without priority: ours would leave a foreign process no time on a machine that is shared.
    let pace = format!("clock=Realtime(pace: {pace})");
    let run = [
        "run",
        "scenarios/realtime.ron",
        "--no-recording",
        "--json",
        "--out",
        &out,
    ];
    let set = [
        "--set",
        "placement=Separate",
        "--set",
        &tick,
        "--set",
        &duration,
        "--set",
        &pace,
        "--set",
        "expect.tolerance_m=None",
    ];
    start(&[&run[..], &set[..], &["--external-command", &command]].concat())
}

fn logs(out: &Path) -> Option<Logs> {
    Logs::open_but(&RunFolder::open(out), &[NodeId::Amplifier]).ok()
}

/// The ticks of the coil fields that the plant took, with what they said, in order.
fn taken_by_the_plant(out: &Path) -> Vec<(u64, CoilField)> {
    let logs = logs(out).unwrap();
    let plant = logs.of(NodeId::Plant).unwrap();
    let taken = (0..plant.ticks()).filter_map(|tick| Some((tick, plant.consumed::<CoilField>(tick)?)));
    taken.collect()
}

/// `count_a_per_m`: what the amplifier's monitor may be wrong by.
fn assert_safe(out: &Path, launcher: u32, count_a_per_m: f64) {
    let logs = logs(out).unwrap();
    let guard = logs.of(NodeId::Guard).unwrap();
    for safe in (0..guard.ticks()).filter_map(|tick| guard.token::<SafeField>(tick)) {
        assert!(safe.field_a_per_m.abs() <= FIELD_LIMIT_A_PER_M, "{safe:?}");
    }
    for (tick, coil) in taken_by_the_plant(out) {
        let limit_a_per_m = FIELD_LIMIT_A_PER_M + count_a_per_m;
        assert!(coil.field_a_per_m.abs() <= limit_a_per_m, "at {tick}: {coil:?}");
        assert!(coil.tick < tick, "of the future at {tick}: {coil:?}");
    }
    assert_eq!(files_with(&format!("anhyst_{launcher}_")), Vec::<String>::new());
}

/// What holds of every run to the end: tokens flowed both ways, and our nodes run again on what they consumed.
fn assert_took_part(out: &Path, launcher: Child, count_a_per_m: f64) {
    let id = launcher.id();
    let summary = summary_as_judged(&Finished::wait(launcher, LIMIT));
    assert_safe(out, id, count_a_per_m);
    let mut heard: Vec<u64> = taken_by_the_plant(out).iter().map(|(_, coil)| coil.tick).collect();
    heard.dedup();
    assert!(heard.len() > A_FEW, "{} coil fields reached the plant", heard.len());
    let moved = taken_by_the_plant(out)
        .iter()
        .any(|(_, coil)| coil.field_a_per_m != 0.0);
    assert!(moved, "the amplifier never gave a field");
    let seen = summary["realtime"]["external"].as_array().unwrap();
    let readers: Vec<&str> = seen.iter().filter_map(|seen| seen["reader"].as_str()).collect();
    assert_eq!(readers.len(), 2, "{seen:?}");
    assert!(
        seen.iter()
            .all(|seen| seen["late_ticks"].is_u64() && seen["missing_ticks"].is_u64()),
        "{seen:?}"
    );
    let replayed = Finished::run(&["replay", &out.to_string_lossy(), "--json"], LIMIT).expect(0);
    assert!(
        replayed.err.contains("amplifier was external and is not replayed"),
        "{}",
        replayed.err
    );
    let nodes: Vec<Value> = serde_json::from_str(&replayed.out).unwrap();
    assert_eq!(nodes.len(), OURS.len());
    for node in nodes {
        assert!(
            node["same"] == true && node["ticks"].as_u64() > Some(A_FEW as u64),
            "{node}"
        );
    }
}

#[test]
fn a_python_amplifier_takes_part_in_both_paces() {
    let _alone = alone();
    let Some(python) = python() else { return };
    let root = tempfile::tempdir().unwrap();
    for pace in ["FreeRunning", "PacedByMeasurement"] {
        let out = root.path().join(pace);
        let amplifier = format!("{python} examples/amplifier-python/amplifier.py");
        assert_took_part(&out, begin(&out, &amplifier, "1", pace), 0.0);
    }
}

/// Guards the same in the library that the Rust skeleton and the C library share.
#[test]
fn an_amplifier_behind_iio_files_takes_part() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    // Like sysfs, no disk.
    let memory = tempfile::tempdir_in("/dev/shm").unwrap();
    let device = memory.path().join("iio:device0");
    std::fs::create_dir(&device).unwrap();
    for direction in ["out", "in"] {
        std::fs::write(device.join(format!("{direction}_voltage0_scale")), "0.305175781\n").unwrap();
        std::fs::write(device.join(format!("{direction}_voltage0_offset")), "-32768\n").unwrap();
    }
    std::fs::write(device.join("out_voltage0_raw"), "32768\n").unwrap();
    std::os::unix::fs::symlink("out_voltage0_raw", device.join("in_voltage0_raw")).unwrap();
    let driver = anhyst().with_file_name("anhyst-amplifier-hardware");
    let amplifier = format!("{} --device {}", driver.display(), device.display());
    let out = root.path().join("run");
    // 0.305 mV a count, 1 A/V, 9000/m.
    assert_took_part(&out, begin(&out, &amplifier, "1", "FreeRunning"), 2.75);
    let raw = std::fs::read_to_string(device.join("out_voltage0_raw")).unwrap();
    assert_eq!(raw.trim(), "32768", "the output is at zero after the run");
}

/// Waits until the plant has taken a coil field like this.
fn wait_for_coil(launcher: &mut Child, out: &Path, like: impl Fn(&CoilField) -> bool) {
    wait_for(launcher, || {
        let logs = logs(out)?;
        let plant = logs.of(NodeId::Plant).unwrap();
        let mut some = (0..plant.ticks()).step_by(5);
        some.find(|tick| plant.consumed::<CoilField>(*tick).is_some_and(|coil| like(&coil)))
    });
}

/// A living process of the run, once the plant has taken coil fields for a hundred ticks.
fn at_work(launcher: &mut Child, out: &Path, name: &str) -> Pid {
    wait_for_coil(launcher, out, |coil| coil.tick > 90);
    let mut found = children(launcher.id()).into_iter();
    let (pid, _) = found.find(|(_, first)| first.ends_with(name)).unwrap();
    Pid::from_raw(pid as i32).unwrap()
}

/// Guards the coil where our side is hung: the amplifier needs nobody to take the field away, and comes back when it may.
#[test]
fn while_the_guard_is_silent_the_amplifier_goes_to_the_safe_field() {
    let _alone = alone();
    let Some(python) = python() else { return };
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let amplifier = format!("{python} examples/amplifier-python/amplifier.py");
    let mut launcher = begin(&out, &amplifier, "6", "FreeRunning");
    let guard = at_work(&mut launcher, &out, "guard");
    kill_process(guard, Signal::STOP).unwrap();
    wait_for_coil(&mut launcher, &out, |coil| {
        coil.status & CoilField::SAFE != 0 && coil.field_a_per_m == 0.0
    });
    kill_process(guard, Signal::CONT).unwrap();
    assert_took_part(&out, launcher, 0.0);
    let taken = taken_by_the_plant(&out);
    let safe = taken
        .iter()
        .position(|(_, coil)| coil.status & CoilField::SAFE != 0)
        .unwrap();
    let back = taken[safe..]
        .iter()
        .any(|(_, coil)| coil.status & (CoilField::RAMPING | CoilField::SAFE) == 0);
    assert!(back, "{:?}", taken.last());
}

/// Guards the end of a run with a process that was started again: the driver finds it under its new status.
#[test]
fn a_restarted_estimator_does_not_keep_a_driver_waiting() {
    let _alone = alone();
    let Some(python) = python() else { return };
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let amplifier = format!("{python} examples/amplifier-python/amplifier.py");
    let mut launcher = begin(&out, &amplifier, "4", "FreeRunning");
    kill_process(at_work(&mut launcher, &out, "estimator"), Signal::KILL).unwrap();
    assert_took_part(&out, launcher, 0.0);
    let log = std::fs::read_to_string(RunFolder::open(&out).log("amplifier")).unwrap();
    assert_eq!(log, "", "the amplifier came to its end by itself");
}

/// Guards the end: dead is seen by the launcher, hung by whoever reads; both are told by name, and the current dies. What a
/// program in Python says of its tick is a heartbeat, so that it died *after* that tick is all that is known.
#[test]
fn an_amplifier_that_dies_or_hangs_ends_the_run_by_name() {
    let _alone = alone();
    let Some(python) = python() else { return };
    let root = tempfile::tempdir().unwrap();
    for (signal, told) in [
        (Signal::KILL, "amplifier was killed by signal 9 after tick "),
        (Signal::STOP, "amplifier does not answer at tick "),
    ] {
        let out = root.path().join(format!("{}", signal.as_raw()));
        let amplifier = format!("{python} examples/amplifier-python/amplifier.py");
        let mut launcher = begin(&out, &amplifier, "40", "FreeRunning");
        let id = launcher.id();
        kill_process(at_work(&mut launcher, &out, "amplifier.py"), signal).unwrap();
        let finished = Finished::wait(launcher, LIMIT).expect(3);
        assert!(finished.err.contains(told), "{}", finished.err);
        assert!(!finished.err.contains("started again"), "{}", finished.err);
        assert_safe(&out, id, 0.0);
        let taken = taken_by_the_plant(&out);
        let oldest_ticks = taken.iter().map(|(tick, coil)| tick - coil.tick).max();
        // The plant takes it a tick late, and one tick more tells that the limit is passed.
        assert!(oldest_ticks <= Some(SILENCE_LIMIT_TICKS + 2), "{oldest_ticks:?}");
        let report = std::fs::read_to_string(RunFolder::open(&out).report("plant-sim")).unwrap();
        let report: Value = serde_json::from_str(&report).unwrap();
        let field_a_per_m = report["nodes"][0]["field_a_per_m"].as_f64();
        assert!(
            field_a_per_m.is_some_and(|field| field.abs() <= 1.0),
            "{field_a_per_m:?}"
        );
    }
}
