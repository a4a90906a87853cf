//! Guards the promise that another program, in another language, can take a node's place, and that the loop neither knows nor
//! cares: the same digest as ours with the same dynamics, a clear sentence when it does not come or fails, nothing left over.
//! A test is skipped, with the reason, only where an interpreter, a package or a compiler is missing.

use anhyst_ipc::{Channel, ExternalClock, ExternalNode, ExternalSettings, Received};
use anhyst_tests::{
    Finished, LIMIT, SharedMemory, anhyst, assert_same, c_amplifier, files_with, folders, iio_buffers, iio_device,
    python, spawn, summary,
};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

fn run(out: &Path, more: &[&str]) -> Finished {
    let out = out.to_string_lossy();
    let base = ["run", "scenarios/milling.ron", "--no-recording", "--out", &out];
    Finished::run(&[&base, more].concat(), LIMIT)
}

/// Runs to the end; whether the tolerance holds does not matter. The run's digest.
fn digest(out: &Path, more: &[&str]) -> String {
    let finished = run(out, more);
    let log = std::fs::read_to_string(out.join("processes/amplifier.log")).unwrap_or_default();
    assert!(
        matches!(finished.code, Some(0 | 1)),
        "{}\n{}\n{log}",
        finished.out,
        finished.err
    );
    anhyst_tests::digest(out)
}

/// The bar: one second of the milling scenario, every bit the same.
#[test]
fn a_python_amplifier_gives_the_same_digest() {
    let Some(python) = python() else { return };
    let (_root, [ours, theirs]) = folders();
    let second = ["--set", "duration_s=1"];
    let expected = digest(&ours, &second);
    let command = format!("amplifier={python} examples/amplifier-python/amplifier.py");
    let found = digest(&theirs, &[&second[..], &["--external-command", &command]].concat());
    assert_same(&ours, &theirs);
    assert_eq!(found, expected);
}

/// The same with limits and delay at work: their arithmetic is the same, too.
#[test]
fn a_python_amplifier_has_the_same_limits() {
    let Some(python) = python() else { return };
    let (_root, [ours, theirs]) = folders();
    let amplifier = "amplifier=(field_limit_a_per_m: 7000, slew_limit_a_per_m_s: 3e6, delay_ticks: 1)";
    let short = [
        "--set",
        "duration_s=0.2",
        "--set",
        "expect.settling_s=0.1",
        "--set",
        amplifier,
    ];
    let expected = digest(&ours, &short);
    let command = format!(
        "amplifier={python} examples/amplifier-python/amplifier.py --field-limit-a-per-m 7000 --slew-limit-a-per-m-s 3e6 --delay-ticks 1"
    );
    let found = digest(&theirs, &[&short[..], &["--external-command", &command]].concat());
    assert_same(&ours, &theirs);
    assert_eq!(found, expected);
}

/// A driver with dynamics of its own: told its constants, the loop keeps the scenario's tolerance, twice with the same bits.
#[test]
fn a_c_amplifier_takes_part() {
    let (root, [one, two]) = folders();
    let Some(amplifier) = c_amplifier(root.path()) else {
        return;
    };
    let command = format!("amplifier={}", amplifier.display());
    let more = [
        "--set",
        "duration_s=0.6",
        "--set",
        "amplifier=(bandwidth_hz: 2500, field_limit_a_per_m: 54e3, slew_limit_a_per_m_s: 168e6)",
        "--external-command",
        &command,
    ];
    let expected = digest(&one, &more);
    assert_eq!(digest(&two, &more), expected);
    let summary = summary(&one);
    assert_eq!(summary["held"], true, "{summary}");
}

/// Guards the coil: a guard that falls silent does not leave the last current in it.
#[test]
fn a_c_amplifier_goes_to_the_safe_field_when_the_guard_is_silent() {
    let root = tempfile::tempdir().unwrap();
    let Some(amplifier) = c_amplifier(root.path()) else {
        return;
    };
    let memory = SharedMemory::unique();
    let driver = Command::new(amplifier)
        .envs(memory.variables("amplifier", "guard,amplifier"))
        .env("ANHYST_START_LIMIT_S", "20")
        .env("AMPLIFIER_WATCHDOG_S", "0.3")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let settings = ExternalSettings {
        process: "guard".into(),
        prefix: memory.prefix.clone(),
        root: memory.root.clone(),
        processes: Some("guard,amplifier".into()),
        reads: vec![Channel::CoilField],
        yields: 20,
        start_limit: Duration::from_secs(20),
    };
    let mut guard = ExternalNode::open(settings, ExternalClock::Lockstep).unwrap();
    let (mut safe, mut coil) = ([0; 32], [0; 32]);
    for tick in 0..200 {
        safe[0] = tick;
        safe[2] = 5000.0_f64.to_bits();
        guard.send(Channel::SafeField, &safe).unwrap();
        let heard = guard.receive(Channel::CoilField, Duration::from_secs(10), &mut coil);
        assert_eq!(heard, Ok(Received::Token(tick)));
    }
    let field_a_per_m = f64::from_bits(coil[2]);
    assert!((field_a_per_m - 5000.0).abs() < 50.0, "{field_a_per_m} A/m");
    // Silence; the guard's process still lives.
    let finished = Finished::wait(driver, LIMIT).expect(3);
    assert!(
        finished
            .err
            .contains("no token from the guard: safe field reached after 0.0"),
        "{}",
        finished.err
    );
}

/// A driver behind IIO files: 16 bits, its monitor tied to its output.
#[test]
fn an_amplifier_behind_iio_files_takes_part() {
    let (root, [out]) = folders();
    let device = iio_device(root.path()).unwrap();
    let driver = anhyst().with_file_name("anhyst-amplifier-hardware");
    let command = format!("amplifier={} --device {}", driver.display(), device.display());
    let more = [
        "--set",
        "duration_s=0.2",
        "--set",
        "expect.settling_s=0.1",
        "--external-command",
        &command,
    ];
    digest(&out, &more);
    let raw = std::fs::read_to_string(device.join("out_voltage0_raw")).unwrap();
    assert_eq!(raw.trim(), "32768", "the output is at zero after the run");
}

/// A driver behind triggered buffers: a sample out, a sample in, and both buffers off at the end. Its monitor may be of a tick before.
#[test]
fn an_amplifier_behind_iio_buffers_takes_part() {
    let (root, [out]) = folders();
    let board = iio_buffers(root.path()).unwrap();
    let driver = anhyst().with_file_name("anhyst-amplifier-hardware");
    let [dac, adc] = ["dac", "adc"].map(|name| root.path().join(name));
    // In lockstep a tick takes no time, and a sample some.
    let command = format!(
        "amplifier={} --buffered --device {} --input-device {} --streams {} --stale-ticks 1000000 --following-time-s 10",
        driver.display(),
        dac.display(),
        adc.display(),
        board.streams.display()
    );
    let settings = ["duration_s=0.2", "expect.settling_s=0.1", "expect.tolerance_m=None"];
    let mut more: Vec<&str> = settings.iter().flat_map(|setting| ["--set", *setting]).collect();
    more.extend(["--set", "guard.monitors.coil=Off", "--external-command", &command]);
    digest(&out, &more);
    for device in [&dac, &adc] {
        assert_eq!(std::fs::read_to_string(device.join("buffer/enable")).unwrap(), "0");
    }
    let raw = board.last.load(Ordering::Relaxed);
    assert_eq!(raw, 0, "the output is at zero after the run");
}

/// A plant of somebody else's, here ours by hand: two channels, and the digest is still that of the run.
#[test]
fn a_whole_plant_can_be_external() {
    let (_root, [ours, theirs]) = folders();
    let short = ["--set", "duration_s=0.2", "--set", "expect.settling_s=0.1"];
    let expected = digest(&ours, &short);
    let command = format!(
        "plant={} node plant-sim {run}/scenario.ron --out {run}/theirs --service-prefix $ANHYST_SERVICE_PREFIX --root $ANHYST_ROOT",
        anhyst().display(),
        run = theirs.display()
    );
    let found = digest(&theirs, &[&short[..], &["--external-command", &command]].concat());
    assert_same(&ours, &theirs);
    assert_eq!(found, expected);
}

#[test]
fn nobody_coming_is_said_in_time_and_leaves_nothing() {
    let (_root, [out]) = folders();
    let memory = SharedMemory::unique();
    let root = memory.root.to_string_lossy().into_owned();
    let begin = Instant::now();
    let more = [
        "--external",
        "amplifier",
        "--start-limit-s",
        "1",
        "--service-prefix",
        &memory.prefix,
        "--root",
        &root,
    ];
    let finished = run(&out, &more).expect(3);
    assert!(begin.elapsed() < LIMIT);
    let sentence = "amplifier is external, and nobody came within 1 s";
    assert!(finished.err.contains(sentence), "{}", finished.err);
    let told = format!("ANHYST_SERVICE_PREFIX={} ANHYST_ROOT={root}", memory.prefix);
    assert!(finished.err.contains(&told), "{}", finished.err);
    assert_eq!(files_with(&memory.prefix), Vec::<String>::new());
    assert!(!memory.root.exists());
}

#[test]
fn a_command_that_fails_is_named_with_its_words() {
    let (_root, [out]) = folders();
    let command = "amplifier=echo the board is not there >&2; exit 4";
    let finished = run(&out, &["--external-command", command]).expect(3);
    let sentence = "amplifier ended with exit status 4 at tick 0";
    assert!(finished.err.contains(sentence), "{}", finished.err);
    assert!(finished.err.contains("the board is not there"), "{}", finished.err);
}

/// Guards what cleaning up may meet: prefixes that others' files could begin with, and what cannot be external at all.
#[test]
fn what_cannot_be_external_is_refused() {
    let (_root, [out]) = folders();
    for (more, sentence) in [
        (&["--external", "recorder"][..], "the recorder judges the run"),
        (
            &["--external", "amplifier", "--embedded"],
            "an embedded run has one process",
        ),
        (&["--external", "amplifyer"], "is no node"),
        (&["--service-prefix", "anhyst_"], "files that begin with it are removed"),
    ] {
        let finished = run(&out, more).expect(2);
        assert!(finished.err.contains(sentence), "{more:?}: {}", finished.err);
    }
}

/// Guards a user who starts the same driver twice: the second says so, with the status of a process that could not take part.
#[test]
fn a_second_python_amplifier_is_told_that_the_place_is_taken() {
    let Some(python) = python() else { return };
    let memory = SharedMemory::unique();
    let start = || {
        spawn(
            Command::new(&python)
                .arg("examples/amplifier-python/amplifier.py")
                .envs(memory.variables("amplifier", "guard,amplifier"))
                .env("ANHYST_START_LIMIT_S", "60"),
        )
    };
    let mut first = start();
    let since = Instant::now();
    // The first has the place when its status is there.
    while !memory.files().iter().any(|name| name.contains("blackboard")) {
        assert!(since.elapsed() < LIMIT, "no status in {:?}", memory.files());
        std::thread::sleep(Duration::from_millis(20));
    }
    let second = Finished::wait(start(), LIMIT);
    first.kill().unwrap();
    first.wait().unwrap();
    let second = second.expect(3);
    assert!(
        second.err.contains("another process is there as amplifier"),
        "{}",
        second.err
    );
    assert!(!second.err.contains("Traceback"), "{}", second.err);
}
