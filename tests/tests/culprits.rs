//! Guards the name in the sentence about a lockstep run that failed: whoever ends, is ended or hangs is named, not those that
//! notice it. The foreign driver is this test's own executable, started again by the launcher's command.

use anhyst_ipc::{Channel, ExternalClock, ExternalNode, ExternalSettings, Observer, RawToken, Received};
use anhyst_tests::{Finished, LIMIT, PROCESSES, SharedMemory, anhyst, children, repository, start, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longer than any of these runs lives.
const DURATION: &str = "duration_s=300";
const TICKS: u64 = 6_000_000;

/// A long run, its resources and its folder.
struct Run {
    memory: SharedMemory,
    folder: tempfile::TempDir,
    launcher: Child,
}

impl Run {
    fn begin(more: &[&str]) -> Self {
        let memory = SharedMemory::unique();
        let folder = tempfile::tempdir().unwrap();
        let (out, root) = (folder.path().join("run"), memory.root.clone());
        let base = [
            "run",
            "scenarios/milling.ron",
            "--no-recording",
            "--set",
            DURATION,
            "--out",
            &out.to_string_lossy(),
            "--service-prefix",
            &memory.prefix,
            "--root",
            &root.to_string_lossy(),
        ];
        let launcher = start(&[&base, more].concat());
        Self {
            memory,
            folder,
            launcher,
        }
    }

    fn out(&self) -> std::path::PathBuf {
        self.folder.path().join("run")
    }

    /// Until the plant has come to tick 1000.
    fn wait_until_at_work(&mut self) {
        let mut observer = None;
        wait_for(&mut self.launcher, || {
            // The root appears with the first process.
            if observer.is_none() && self.memory.root.exists() {
                observer = Observer::open(&self.memory.prefix, &self.memory.root).ok();
            }
            observer.as_mut()?.tick_of("plant-sim").filter(|tick| *tick >= 1000)
        });
    }

    fn signal(&self, process: &str, signal: Signal) {
        let all = children(self.launcher.id());
        let (pid, _) = all.iter().find(|(_, subcommand)| subcommand == process).unwrap();
        kill_process(Pid::from_raw(*pid as i32).unwrap(), signal).unwrap();
    }

    /// Its sentence, after it has ended with status 3 and left nothing.
    fn failed(self) -> String {
        let finished = Finished::wait(self.launcher, LIMIT).expect(3);
        assert_eq!(self.memory.files(), Vec::<String>::new());
        finished.err
    }
}

/// The last node of a process's report, of a run that has ended.
fn node(out: &Path, process: &str) -> Value {
    let text = std::fs::read(out.join("processes").join(format!("{process}.json"))).unwrap();
    let report: Value = serde_json::from_slice(&text).unwrap();
    report["nodes"][0].clone()
}

fn assert_has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no \"{part}\" in: {text}");
    }
}

/// Not a test: the driver. It passes the field on until the tick at which it is to end, or until nobody speaks to it.
#[test]
#[ignore = "a driver that the other tests start"]
fn driver() {
    let Ok(prefix) = std::env::var("ANHYST_SERVICE_PREFIX") else {
        return;
    };
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let end_at = number("DRIVER_ENDS_AT_TICK", u64::MAX);
    let wrong_at = number("DRIVER_WRONG_AT_TICK", u64::MAX);
    let patience = Duration::from_millis(number("DRIVER_PATIENCE_MS", 20_000));
    let settings = ExternalSettings {
        process: "amplifier".into(),
        prefix,
        root: std::env::var("ANHYST_ROOT").unwrap().into(),
        processes: std::env::var("ANHYST_PROCESSES").ok(),
        reads: vec![Channel::SafeField],
        yields: 20,
        start_limit: Duration::from_secs(20),
    };
    let mut node = ExternalNode::open(settings, ExternalClock::Lockstep).unwrap_or_else(|error| {
        // The last words are what the launcher tells of it.
        eprintln!("the driver cannot begin: {error}");
        std::process::exit(1);
    });
    let (mut safe, mut coil) = ([0; 32], [0; 32]);
    let words = RawToken::words_of(Channel::SafeField);
    let last_words = loop {
        match node.receive(Channel::SafeField, patience, &mut safe[..words]) {
            Ok(Received::Token(tick)) if tick < end_at => {
                coil[0] = if tick == wrong_at { tick - 1 } else { tick };
                coil[2] = safe[2];
                if node
                    .send(Channel::CoilField, &coil[..RawToken::words_of(Channel::CoilField)])
                    .is_err()
                {
                    break "the run has gone";
                }
            }
            Ok(Received::Token(_)) => break "the fan has failed",
            _ => break "nobody speaks to the driver",
        }
    };
    drop(node);
    eprintln!("{last_words}");
    std::process::exit(number("DRIVER_STATUS", 4) as i32);
}

fn driver_command(variables: &str) -> String {
    let test = std::env::current_exe().unwrap();
    format!(
        "amplifier={variables} exec {} --exact driver --ignored --nocapture --test-threads=1",
        test.display()
    )
}

#[test]
fn a_driver_that_ends_is_named_with_its_words() {
    for status in [5, 0] {
        let command = driver_command(&format!("DRIVER_ENDS_AT_TICK=701 DRIVER_STATUS={status}"));
        let told = Run::begin(&["--external-command", &command]).failed();
        let sentence = format!("amplifier ended with exit status {status} at tick ");
        assert_has(&told, &[&sentence, "the fan has failed"]);
    }
}

/// Whoever reads it first ends; it has done nothing wrong.
#[test]
fn a_driver_that_repeats_a_tick_is_named() {
    let told = Run::begin(&["--external-command", &driver_command("DRIVER_WRONG_AT_TICK=701")]).failed();
    assert_has(
        &told,
        &[
            "amplifier sent a wrong tick at tick ",
            "expected coil_field of tick 701, but tick 700 came",
        ],
    );
}

/// Guards against advice to give a command, to someone who gave one.
#[test]
fn a_command_that_ends_before_it_takes_part_is_named() {
    let told = Run::begin(&["--external-command", "amplifier=echo not today >&2"]).failed();
    assert_has(&told, &["amplifier ended with exit status 0 at tick 0 ", "not today"]);
}

/// It gives up long before our processes do.
#[test]
fn a_driver_that_gives_up_because_another_hangs_is_not_blamed() {
    let command = driver_command("DRIVER_PATIENCE_MS=2000");
    let mut run = Run::begin(&["--external-command", &command]);
    run.wait_until_at_work();
    run.signal("controller", Signal::STOP);
    assert_has(&run.failed(), &["controller does not answer at tick "]);
}

#[test]
fn a_driver_that_gives_up_because_another_died_is_not_blamed() {
    let command = driver_command("DRIVER_PATIENCE_MS=2000");
    let mut run = Run::begin(&["--external-command", &command]);
    run.wait_until_at_work();
    run.signal("inverse", Signal::KILL);
    assert_has(&run.failed(), &["inverse was killed by signal 9 at tick "]);
}

/// Guards a machine that stands still, as a virtual one does that is paused: while nobody can send, nobody is late. All processes stand still for
/// twice as long as one waits for another.
#[test]
fn a_machine_that_stood_still_ends_no_run() {
    let mut run = Run::begin(&["--set", "duration_s=4"]);
    run.wait_until_at_work();
    let all = children(run.launcher.id());
    let all: Vec<Pid> = all.iter().filter_map(|(pid, _)| Pid::from_raw(*pid as i32)).collect();
    assert_eq!(all.len(), PROCESSES.len());
    for (signal, lasts_s) in [(Signal::STOP, 4.0), (Signal::CONT, 0.0)] {
        all.iter().for_each(|pid| kill_process(*pid, signal).unwrap());
        std::thread::sleep(Duration::from_secs_f64(lasts_s));
    }
    Finished::wait(run.launcher, LIMIT).expect(0);
}

/// Ours, as somebody starts it in another terminal.
fn by_hand(run: &Run) -> Child {
    let scenario = run.out().join("scenario.ron");
    let begin = Instant::now();
    while !(scenario.exists() && run.memory.root.exists()) {
        assert!(begin.elapsed() < LIMIT, "no run to take part in");
        std::thread::sleep(Duration::from_millis(20));
    }
    Command::new(anhyst())
        .current_dir(repository())
        .args([
            "node",
            "amplifier",
            &scenario.to_string_lossy(),
            "--out",
            &run.out().to_string_lossy(),
        ])
        .args(["--service-prefix", &run.memory.prefix])
        .args(["--root", &run.memory.root.to_string_lossy()])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn a_killed_driver_that_somebody_else_started_is_named() {
    let mut run = Run::begin(&["--external", "amplifier"]);
    let mut amplifier = by_hand(&run);
    run.wait_until_at_work();
    amplifier.kill().unwrap();
    amplifier.wait().unwrap();
    let told = run.failed();
    assert_has(
        &told,
        &["amplifier does not answer at tick ", "but amplifier is silent"],
    );
    assert!(!told.contains("plant-sim does not answer"), "{told}");
}

/// It leaves in good order; who speaks to it notices only that a reader is gone.
#[test]
fn a_driver_that_somebody_else_ended_is_named() {
    let mut run = Run::begin(&["--external", "amplifier"]);
    let mut amplifier = by_hand(&run);
    run.wait_until_at_work();
    kill_process(Pid::from_child(&amplifier), Signal::TERM).unwrap();
    let told = run.failed();
    amplifier.wait().unwrap();
    assert_has(&told, &["amplifier does not answer at tick "]);
}

/// Whatever process somebody tells to end: it is named, the run ends then and not at its last tick, and the field is safe.
#[test]
fn one_of_ours_that_is_told_to_end_is_named() {
    for name in PROCESSES {
        let mut run = Run::begin(&[]);
        run.wait_until_at_work();
        run.signal(name, Signal::TERM);
        let (out, folder) = (run.out(), tempfile::tempdir().unwrap());
        // The folder outlives the run, for its reports.
        let kept = std::mem::replace(&mut run.folder, folder);
        let told = run.failed();
        let sentence = format!("{name} was told to end at tick ");
        assert_has(&told, &[&sentence, "stopped on request at tick "]);
        let amplifier = node(&out, "amplifier");
        assert!(amplifier["ticks"].as_u64() < Some(TICKS), "{name}: {amplifier}");
        let field_a_per_m = amplifier["field_a_per_m"].as_f64().unwrap();
        assert!(field_a_per_m.abs() <= 1.0, "{name}: {amplifier}");
        drop(kept);
    }
}

/// Who died is what a user must know; that files are left comes besides.
#[test]
fn a_failing_clean_up_does_not_hide_who_died() {
    let mut run = Run::begin(&[]);
    run.wait_until_at_work();
    // A folder cannot be removed as a file is.
    let in_the_way = format!("/dev/shm/{}in_the_way", run.memory.prefix);
    std::fs::create_dir(&in_the_way).unwrap();
    run.signal("inverse", Signal::KILL);
    let finished = Finished::wait(run.launcher, LIMIT).expect(3);
    std::fs::remove_dir(&in_the_way).unwrap();
    let parts = [
        "inverse was killed by signal 9 at tick ",
        "the run's shared memory could not be removed",
    ];
    assert_has(&finished.err, &parts);
    assert_eq!(run.memory.files(), Vec::<String>::new());
}

/// Guards against a child whose launcher died before the child could bind itself to it.
#[test]
fn a_process_without_its_launcher_ends_at_once() {
    let memory = SharedMemory::unique();
    let folder = tempfile::tempdir().unwrap();
    let (out, root) = (folder.path().to_string_lossy(), memory.root.to_string_lossy());
    let place = ["--out", &out, "--service-prefix", &memory.prefix, "--root", &root];
    let start = [
        "node",
        "guard",
        "scenarios/milling.ron",
        "--end-with-launcher",
        "4294967",
    ];
    let finished = Finished::run(&[&start[..], &place].concat(), LIMIT).expect(3);
    assert_has(&finished.err, &["the launcher with process number 4294967 has gone"]);
}
