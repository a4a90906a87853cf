//! Guards what a user sees when a process dies: exit status 3, the name, a readable recording, clean shared memory.

use anhyst_ipc::Truth;
use anhyst_recorder::Recording;
use anhyst_tests::{Finished, LIMIT, PROCESSES, children, files_with, folders, start, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

/// A long run at work, in a folder of its own.
struct LongRun {
    folder: tempfile::TempDir,
    out: PathBuf,
    prefix: String,
    launcher: Child,
}

impl LongRun {
    fn at_work() -> Self {
        let (folder, [out]) = folders();
        let long = ["run", "scenarios/milling.ron", "--set", "duration_s=600", "--out"];
        let mut launcher = start(&[&long[..], &[&out.to_string_lossy()]].concat());
        wait_until_recording(&mut launcher, &out.join("recording.rrd"));
        let prefix = format!("anhyst_{}_", launcher.id());
        assert!(!files_with(&prefix).is_empty());
        Self {
            folder,
            out,
            prefix,
            launcher,
        }
    }

    /// Its sentence, after it has ended with status 3, left nothing but its folder, and a recording that can be read.
    fn failed(self) -> String {
        let finished = Finished::wait(self.launcher, LIMIT).expect(3);
        assert_eq!(files_with(&self.prefix), Vec::<String>::new(), "{}", finished.err);
        assert_readable(&self.out);
        finished.err
    }
}

/// Whether the tolerance holds so early does not matter.
fn run_short(out: &Path, more: &[&str]) -> Child {
    let out = out.to_string_lossy();
    let short = [
        "--set",
        "duration_s=0.4",
        "--set",
        "expect.settling_s=0.1",
        "--no-recording",
    ];
    start(&[&["run", "scenarios/milling.ron", "--out", &out], &short[..], more].concat())
}

/// Waits until all seven processes live and the recording has grown beyond its head: the loop runs.
fn wait_until_recording(launcher: &mut Child, recording: &Path) {
    let id = launcher.id();
    wait_for(launcher, || {
        let size = std::fs::metadata(recording).map_or(0, |file| file.len());
        (children(id).len() == PROCESSES.len() && size > 400_000).then_some(())
    });
}

fn kill(pid: u32) {
    kill_process(Pid::from_raw(pid as i32).unwrap(), Signal::KILL).unwrap();
}

fn child(launcher: &Child, name: &str) -> u32 {
    let all = children(launcher.id());
    all.iter()
        .find(|(_, subcommand)| subcommand == name)
        .unwrap_or_else(|| panic!("no {name} among {all:?}"))
        .0
}

fn assert_readable(out: &Path) {
    let recording = Recording::open(&out.join("recording.rrd")).unwrap();
    let truth: Vec<Truth> = recording.tokens().unwrap();
    assert!(truth.len() >= 1000, "only {} ticks were recorded", truth.len());
    assert!(truth.iter().enumerate().all(|(tick, token)| token.tick == tick as u64));
}

#[test]
fn a_killed_process_ends_the_run_by_name() {
    for name in PROCESSES {
        let run = LongRun::at_work();
        kill(child(&run.launcher, name));
        let told = run.failed();
        assert!(
            told.contains(&format!("{name} was killed by signal 9 at tick ")),
            "{told}"
        );
    }
}

#[test]
fn a_run_after_a_killed_launcher_is_clean() {
    let mut run = LongRun::at_work();
    let orphans = children(run.launcher.id());
    kill(run.launcher.id());
    run.launcher.wait().unwrap();
    let begin = Instant::now();
    while orphans
        .iter()
        .any(|(pid, _)| Path::new(&format!("/proc/{pid}")).exists())
    {
        assert!(begin.elapsed() < LIMIT, "children outlive their launcher: {orphans:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_readable(&run.out);
    let finished = Finished::wait(run_short(&run.folder.path().join("again"), &[]), LIMIT);
    assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
    assert_eq!(files_with(&run.prefix), Vec::<String>::new());
}

#[test]
fn two_runs_side_by_side_do_not_meet() {
    let (_root, outs) = folders::<4>();
    let seeded = |run: usize, more: &[&str]| {
        let seed = format!("seed={}", run % 2 + 1);
        run_short(&outs[run], &[&["--set", &seed], more].concat())
    };
    for launcher in [0, 1].map(|run| seeded(run, &[])) {
        let finished = Finished::wait(launcher, LIMIT);
        assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
    }
    for run in [0, 1] {
        Finished::wait(seeded(run + 2, &["--embedded"]), LIMIT);
        anhyst_tests::assert_same(&outs[run + 2], &outs[run]);
    }
}

/// Guards against blaming the neighbour: a process that hangs says nothing, and the others complain about each other.
#[test]
fn a_frozen_process_is_named() {
    let run = LongRun::at_work();
    let guard = Pid::from_raw(child(&run.launcher, "guard") as i32).unwrap();
    kill_process(guard, Signal::STOP).unwrap();
    let told = run.failed();
    assert!(told.contains("guard does not answer at tick "), "{told}");
}

#[test]
fn an_interrupted_run_closes_its_recording() {
    let run = LongRun::at_work();
    kill_process(Pid::from_raw(run.launcher.id() as i32).unwrap(), Signal::INT).unwrap();
    let told = run.failed();
    assert!(told.contains("stopped on request at tick "), "{told}");
}

/// Guards the exit status of work within the launcher itself: a comparison, and a study that only computes.
#[test]
fn interrupted_work_without_processes_says_so() {
    let (_root, [compared, studied]) = folders();
    let (several, study) = (compared.to_string_lossy(), studied.to_string_lossy());
    let scenario = "scenarios/milling.ron";
    let several = ["run", scenario, scenario, "--set", "duration_s=600", "--out", &several];
    let study = ["study", "blind", "--out", &study];
    let rows = studied.join("runs.jsonl");
    for (words, begun) in [
        (&several[..], compared.join("1-milling/scenario.ron")),
        (&study, rows.clone()),
    ] {
        let mut launcher = start(words);
        wait_for(&mut launcher, || begun.exists().then_some(()));
        kill_process(Pid::from_raw(launcher.id() as i32).unwrap(), Signal::INT).unwrap();
        let finished = Finished::wait(launcher, LIMIT).expect(3);
        assert!(finished.err.contains("stopped on request"), "{}", finished.err);
    }
    // What was given up is no failed run: the study goes on with it.
    assert!(!std::fs::read_to_string(rows).unwrap().contains("panicked"));
}

/// Guards programs that start runs: with `--json` standard error is one object, also when a process fails or no run is there.
#[test]
fn failures_are_told_to_programs_as_json() {
    let (_root, [out]) = folders();
    let told = |words: &[&str], code: i32| -> serde_json::Value {
        let finished = Finished::run(words, LIMIT).expect(code);
        assert_eq!(finished.out, "");
        serde_json::from_str(&finished.err).unwrap_or_else(|error| panic!("{error}: {}", finished.err))
    };
    let path = out.to_string_lossy();
    let false_amplifier = ["--external-command", "amplifier=false", "--json", "--out", &path];
    let failed = told(&[&["run", "scenarios/milling.ron"], &false_amplifier[..]].concat(), 3);
    assert!(failed["message"].as_str().unwrap().contains("amplifier"), "{failed}");
    assert!(failed["help"].as_str().unwrap().contains(&*path), "{failed}");
    let absent = told(&["live", "no_such_run", "--json"], 2);
    assert!(absent["message"].as_str().unwrap().contains("no_such_run"), "{absent}");
}

/// Guards the verdict on what is no number: it gets from the recorder's process to the summary, which has it in JSON.
#[test]
fn an_error_that_is_no_number_is_not_held() {
    for (channel, kind) in [("demand", "Nan"), ("coil_field", "Infinite")] {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("run").to_string_lossy().into_owned();
        let fault = format!("faults=[Link(at_s: 0.1, for_ticks: 1, channel: {channel}, kind: {kind})]");
        let run = [
            "run",
            "scenarios/milling.ron",
            "--no-recording",
            "--json",
            "--out",
            &out,
        ];
        let settings = ["duration_s=0.2", "expect.settling_s=0.05", &fault];
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        let finished = Finished::run(&run.into_iter().chain(settings).collect::<Vec<_>>(), LIMIT).expect(1);
        let summary: serde_json::Value = serde_json::from_str(&finished.out).unwrap();
        assert_eq!(summary["held"], false);
        let wild = ["error_rms_m", "field_peak_a_per_m", "coil_field_peak_a_per_m"].map(|name| &summary[name]);
        assert!(wild.into_iter().any(serde_json::Value::is_null), "{channel}: {summary}");
        assert!(
            !finished.out.contains("\"NaN\"") && !finished.out.contains("\"inf\""),
            "{summary}"
        );
    }
}

/// Guards a long real-time run: a recorder that comes back goes on in a file of its own, with all that it has taken up, and what the dead
/// one wrote is kept.
#[test]
fn a_restarted_recorder_keeps_the_first_recording() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let mut launcher = start(&[
        "run",
        "scenarios/realtime.ron",
        "--set",
        "placement=Separate",
        "--set",
        "tick_s=5e-4",
        "--set",
        "duration_s=300",
        "--set",
        "recording.block_ticks=500",
        "--out",
        &out.to_string_lossy(),
    ]);
    let files = ["recording.rrd", "recording-2.rrd"].map(|name| out.join(name));
    wait_until_recording(&mut launcher, &files[0]);
    kill(child(&launcher, "recorder"));
    wait_until_recording(&mut launcher, &files[1]);
    kill_process(Pid::from_child(&launcher), Signal::INT).unwrap();
    let finished = Finished::wait(launcher, LIMIT).expect(3);
    assert!(finished.err.contains("stopped on request at tick "), "{}", finished.err);
    let ticks = files.map(|file| {
        let tokens: Vec<Truth> = Recording::open(&file).unwrap().tokens().unwrap();
        (tokens[0].tick, tokens[tokens.len() - 1].tick)
    });
    assert_eq!(ticks[0].0, 0, "{ticks:?}");
    assert!(ticks[1].0 > ticks[0].1, "{ticks:?}");
    assert!(ticks[1].1 > ticks[1].0, "{ticks:?}");
    // Beside other runs in real time it may be killed before it has come to the end; it says nothing then.
    if let Ok(report) = std::fs::read(out.join("processes/recorder.json")) {
        let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
        assert_eq!(Some(ticks[1].1 + 1), report["nodes"][0]["ticks"].as_u64(), "{ticks:?}");
    }
}
