//! Guards the field whatever process dies or hangs, and whenever: each in turn, 50 random instants. The run ends with exit
//! status 3 and the culprit's name, nothing is left in shared memory, and the last field is the safe one within the ticks
//! that docs/safety.md states. With the feature `recorder` the runs are recorded, and the recordings readable up to the fault.

use anhyst_tests::{Finished, LIMIT, files_with, start};
use serde_json::Value;
use std::path::Path;

/// Their names as processes and as nodes of a scenario.
const PROCESSES: [(&str, &str); 7] = [
    ("plant-sim", "plant"),
    ("estimator", "estimator"),
    ("controller", "controller"),
    ("inverse", "inverse"),
    ("guard", "guard"),
    ("amplifier", "amplifier"),
    ("recorder", "recorder"),
];
const TICKS: u64 = 8000;
/// Of the guard's ramp, of the amplifier's behind it, and of a coil whose amplifier is dead.
const GUARD_RAMP_TICKS: u64 = 101;
const WATCHDOG_TICKS: u64 = 100;
const DEAD_AMPLIFIER_TICKS: u64 = 20;
/// Ticks that were on their way when the fault happened.
const UNDER_WAY_TICKS: u64 = 4;

struct Case {
    name: &'static str,
    tick: u64,
    kind: &'static str,
}

/// The first killed, the next stopped, and so on through all processes; instants from a fixed seed.
fn cases() -> Vec<Case> {
    let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
    (0..50)
        .map(|index| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let name = PROCESSES[index % 7].0;
            // Nobody waits for the recorder until it is 4096 ticks behind: leave room for that.
            let last = if name == "recorder" { 3000 } else { TICKS - 200 };
            Case {
                name,
                tick: state % last,
                // Stopped for longer than anybody waits.
                kind: if (index / 7) % 2 == 0 { "Kill" } else { "Stop(600)" },
            }
        })
        .collect()
}

#[test]
fn whoever_dies_or_hangs_the_field_ends_safe() {
    let cases = cases();
    let next = std::sync::atomic::AtomicUsize::new(0);
    // Three at a time: most of a case is waiting.
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    run(case);
                }
            });
        }
    });
}

fn run(case: &Case) {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let node = PROCESSES.iter().find(|(name, _)| *name == case.name).unwrap().1;
    let fault = format!(
        "faults=[Process(from_tick: {}, node: {node}, kind: {})]",
        case.tick, case.kind
    );
    let out_text = out.to_string_lossy().into_owned();
    let arguments = ["run", "scenarios/milling.ron", "--out", &out_text];
    let quiet = (!cfg!(feature = "recorder")).then_some("--no-recording");
    let settings = [
        fault.as_str(),
        "duration_s=0.4",
        "expect.settling_s=0.1",
        "clock.receive_limit_s=1.5",
        "guard.ramp_time_s=0.005",
        "watchdog.ramp_time_s=0.005",
    ];
    let settings = settings.iter().flat_map(|setting| ["--set", *setting]);
    let launcher = start(&arguments.into_iter().chain(quiet).chain(settings).collect::<Vec<_>>());
    let prefix = format!("anhyst_{}_", launcher.id());
    let what = format!("{} {} at tick {}", case.name, case.kind, case.tick);
    let finished = Finished::wait(launcher, LIMIT).expect(3);
    assert!(
        finished.err.contains(&format!("{} ", case.name)),
        "{what}: {}",
        finished.err
    );
    assert_eq!(files_with(&prefix), Vec::<String>::new(), "{what}");
    assert_safe(case, &out, &what);
    #[cfg(feature = "recorder")]
    assert_readable(case, &out, &what);
}

/// Every tick before the fault is in the recording. Of a recorder that was killed itself, the file: ticks are written 4000 at a
/// time, and it died before.
#[cfg(feature = "recorder")]
fn assert_readable(case: &Case, out: &Path, what: &str) {
    let opened = anhyst_recorder::Recording::open(&out.join("recording.rrd"));
    let recording = opened.unwrap_or_else(|error| panic!("{what}: {error}"));
    if case.name == "recorder" || case.tick == 0 {
        return;
    }
    let tokens: Vec<anhyst_ipc::Measurement> = recording.tokens().unwrap_or_else(|error| panic!("{what}: {error}"));
    // The fault's own tick is the last that all nodes may have finished.
    let ticks = tokens.len() as u64;
    assert!(ticks >= case.tick, "{what}: the recording ends after {ticks} ticks");
    let in_order = (0..).zip(&tokens).all(|(tick, token)| token.tick == tick);
    assert!(in_order, "{what}: a tick is missing");
}

fn report(out: &Path, process: &str, what: &str) -> Value {
    let path = out.join("processes").join(format!("{process}.json"));
    let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{what}: {}: {error}", path.display()));
    serde_json::from_slice(&text).unwrap()
}

fn assert_safe(case: &Case, out: &Path, what: &str) {
    let witness = if case.name == "amplifier" {
        "plant-sim"
    } else {
        "amplifier"
    };
    let report = report(out, witness, what);
    let node = &report["nodes"][0];
    let field = node["field_a_per_m"]
        .as_f64()
        .unwrap_or_else(|| panic!("{what}: no field in {report}"));
    // The end of a lag is never quite reached: 1 A/m of 10 kA/m counts as safe.
    assert!(field.abs() <= 1.0, "{what}: {report}");
    let taken = node["ticks"].as_u64().unwrap() - case.tick;
    let most = UNDER_WAY_TICKS
        + match case.name {
            "amplifier" => DEAD_AMPLIFIER_TICKS,
            "guard" => WATCHDOG_TICKS,
            // What the recorder does not hear nobody misses for up to its credit; the plant notices first.
            "recorder" => 5000 + GUARD_RAMP_TICKS + WATCHDOG_TICKS,
            _ => GUARD_RAMP_TICKS + WATCHDOG_TICKS,
        };
    assert!(taken <= most, "{what}: safe after {taken} ticks, not {most}: {report}");
}

/// A process that stands still for less than anybody waits changes no bit.
#[test]
fn a_short_stop_changes_no_bit() {
    let root = tempfile::tempdir().unwrap();
    let short = [
        "--set",
        "duration_s=0.1",
        "--set",
        "expect.settling_s=0.05",
        "--no-recording",
    ];
    let digest = |name: &str, fault: &[&str]| {
        let out = root.path().join(name);
        let out_text = out.to_string_lossy().into_owned();
        let arguments = [&["run", "scenarios/milling.ron", "--out", &out_text], &short[..], fault].concat();
        let finished = Finished::run(&arguments, LIMIT);
        assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
        std::fs::read_to_string(out.join("digest.txt")).unwrap()
    };
    let stopped = "faults=[Process(from_tick: 700, node: inverse, kind: Stop(0.4))]";
    assert_eq!(digest("stopped", &["--set", stopped]), digest("undisturbed", &[]));
}

/// Faults of links are part of the scenario: the same bits embedded and in processes, also where tokens come late.
#[test]
fn injected_faults_have_the_same_bits_everywhere() {
    let root = tempfile::tempdir().unwrap();
    let faults = "faults=[Link(from_tick: 700, for_ticks: 3, channel: measurement, kind: Drop), \
        Link(from_tick: 900, for_ticks: 40, channel: estimate, kind: Delay(2)), \
        Link(from_tick: 1000, for_ticks: 300, channel: measurement, field: \"displacement_m\", kind: Noise(1e-7)), \
        Link(from_tick: 1400, for_ticks: 50, channel: safe_field, kind: Drop), \
        Link(from_tick: 1700, for_ticks: 5, channel: demand, kind: Nan)]";
    let folders = ["embedded", "processes"].map(|name| root.path().join(name));
    for (folder, more) in folders.iter().zip([&["--embedded"][..], &[]]) {
        let out_text = folder.to_string_lossy().into_owned();
        let arguments = [
            &[
                "run",
                "scenarios/milling.ron",
                "--no-recording",
                "--out",
                &out_text,
                "--set",
                faults,
            ],
            &["--set", "duration_s=0.15", "--set", "expect.settling_s=0.1"][..],
            more,
        ]
        .concat();
        let finished = Finished::run(&arguments, LIMIT);
        assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
    }
    anhyst_tests::assert_same(&folders[0], &folders[1]);
}
