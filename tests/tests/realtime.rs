//! Guards a loop that does not wait: whatever is late, dead or restarted, the field stays within its limit, the run comes to
//! its end, and what happened can be run again bit for bit. No figure of time is judged: machines are shared.

use anhyst_ipc::{CoilField, Demand, Estimate, FieldKind, MAX_FIELDS, Message, NodeId, SafeField, Truth};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Logs;
use anhyst_tests::{A_FEW, Finished, LIMIT, alone, children, files_with, start, summary_as_judged, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::Child;
use std::time::Duration;

const FIELD_LIMIT_A_PER_M: f64 = 30e3;

/// A run of 2 s at 1 kHz whose error is not judged.
fn begin(out: &Path, more: &[&str]) -> Child {
    let out = out.to_string_lossy();
    let given = [
        "run",
        "scenarios/realtime.ron",
        "--no-recording",
        "--json",
        "--out",
        &out,
        "--set",
        "placement=Separate",
        "--set",
        "tick_s=1e-3",
        "--set",
        "duration_s=2",
        "--set",
        "expect.tolerance_m=None",
    ];
    start(&[&given[..], more].concat())
}

/// A living process of the run, once its loop is at work.
fn process_at_work(launcher: &mut Child, out: &Path, name: &str) -> Pid {
    process_from(100, launcher, out, name)
}

/// The same, once the guard's log has got a record from `first` on.
fn process_from(first: u64, launcher: &mut Child, out: &Path, name: &str) -> Pid {
    let id = launcher.id();
    wait_for(launcher, || {
        let logs = Logs::open(&RunFolder::open(out)).ok()?;
        let guard = logs.of(NodeId::Guard).unwrap();
        (first..guard.ticks()).find(|tick| guard.record(*tick).is_some())?;
        let (pid, _) = children(id).into_iter().find(|(_, subcommand)| subcommand == name)?;
        Pid::from_raw(pid as i32)
    })
}

fn finite<M: Message>(token: &M) -> bool {
    let mut words = [0; MAX_FIELDS];
    token.write_words(&mut words);
    let mut numbers = M::FIELDS
        .iter()
        .zip(words)
        .filter(|(field, _)| field.kind == FieldKind::F64);
    numbers.all(|(_, word)| f64::from_bits(word).is_finite())
}

/// What must be so in every run: fields within the limit, no NaN, and nothing left in shared memory.
fn assert_safe(out: &Path, launcher: u32) {
    let logs = Logs::open(&RunFolder::open(out)).unwrap();
    let (guard, amplifier, plant) = (
        logs.of(NodeId::Guard).unwrap(),
        logs.of(NodeId::Amplifier).unwrap(),
        logs.of(NodeId::Plant).unwrap(),
    );
    let mut ticks = 0;
    let lived = (0..plant.ticks()).filter(|tick| plant.record(*tick).is_some()).count() as u64;
    for tick in 0..guard.ticks() {
        if let Some(safe) = guard.token::<SafeField>(tick) {
            assert!(
                finite(&safe) && safe.field_a_per_m.abs() <= FIELD_LIMIT_A_PER_M,
                "{safe:?}"
            );
            ticks += 1;
        }
        if let Some(coil) = amplifier.token::<CoilField>(tick) {
            assert!(
                finite(&coil) && coil.field_a_per_m.abs() <= FIELD_LIMIT_A_PER_M,
                "{coil:?}"
            );
        }
        // The plant's time has no holes.
        assert!(plant.token::<Truth>(tick).map_or(tick >= lived, |truth| finite(&truth)));
    }
    assert!(ticks > A_FEW, "only {ticks} ticks");
    assert_eq!(files_with(&format!("anhyst_{launcher}_")), Vec::<String>::new());
}

fn assert_replays(out: &Path) {
    let replayed = Finished::run(&["replay", &out.to_string_lossy(), "--json"], LIMIT).expect(0);
    let nodes: Vec<Value> = serde_json::from_str(&replayed.out).unwrap();
    assert_eq!(nodes.len(), 6);
    for node in nodes {
        assert!(
            node["same"] == true && node["ticks"].as_u64() > Some(A_FEW as u64),
            "{node}"
        );
    }
}

/// Flips the lowest bit of the last field that `node` sent in the first logged tick from `tick` on.
fn flip_a_bit(out: &Path, node: NodeId, mut tick: u64) -> u64 {
    let folder = RunFolder::open(out);
    let (words, logged) = {
        let logs = Logs::open(&folder).unwrap();
        let log = logs.of(node).unwrap();
        while log.record(tick).is_none() {
            tick += 1;
        }
        (log.layout().words(), tick)
    };
    let mut bytes = std::fs::read(folder.tokens(node.name())).unwrap();
    bytes[8 * (logged as usize + 1) * words - 8] ^= 1;
    std::fs::write(folder.tokens(node.name()), bytes).unwrap();
    logged
}

#[test]
fn a_real_time_run_replays_bit_for_bit_and_one_bit_is_found() {
    let _alone = alone();
    for pace in ["FreeRunning", "PacedByMeasurement"] {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("run");
        let launcher = begin(
            &out,
            &[
                "--set",
                &format!("clock.pace={pace}"),
                "--set",
                "clock.cpu_latency_us=0",
            ],
        );
        let id = launcher.id();
        let summary = summary_as_judged(&Finished::wait(launcher, LIMIT));
        assert_eq!(summary["ticks"], 2000, "{pace}");
        let realtime = &summary["realtime"];
        assert_eq!(realtime["processes"].as_array().unwrap().len(), 7);
        assert_eq!(realtime["restarts"].as_array().unwrap().len(), 0);
        // Timers, priority, memory and a core that is awake: granted, or refused with a reason.
        let [_, estimator] = &realtime["processes"][1].as_array().unwrap()[..] else {
            panic!("{realtime}");
        };
        let asked = estimator["asked"].as_array().unwrap();
        assert_eq!(asked.len(), 4, "{asked:?}");
        assert!(
            asked
                .iter()
                .all(|asked| asked["granted"] == asked["refused_because"].is_null()),
            "{asked:?}"
        );
        assert_safe(&out, id);
        assert_replays(&out);

        let tick = flip_a_bit(&out, NodeId::Inverse, 700);
        let found = Finished::run(&["replay", &out.to_string_lossy(), "--node", "inverse"], LIMIT).expect(1);
        let expected = format!("inverse: DIFFERS: tick {tick}, status of field_command");
        assert!(found.out.starts_with(&expected), "{}", found.out);
    }
}

/// The longest row of ticks without a record: the first, and one past the last.
fn longest_hole(has_record: impl Fn(u64) -> bool, ticks: u64) -> (u64, u64) {
    let (mut longest, mut first) = ((0, 0), 0);
    for tick in 0..ticks {
        if has_record(tick) {
            first = tick + 1;
        } else if tick + 1 - first > longest.1 - longest.0 {
            longest = (first, tick + 1);
        }
    }
    longest
}

/// Guards missed deadlines: a controller that stands still for 0.1 s is not waited for, and leaves out what has passed.
#[test]
fn a_stopped_controller_costs_ticks_and_nothing_else() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let mut launcher = begin(&out, &[]);
    let id = launcher.id();
    let controller = process_at_work(&mut launcher, &out, "controller");
    kill_process(controller, Signal::STOP).unwrap();
    std::thread::sleep(Duration::from_millis(100));
    kill_process(controller, Signal::CONT).unwrap();
    summary_as_judged(&Finished::wait(launcher, LIMIT));
    let logs = Logs::open(&RunFolder::open(&out)).unwrap();
    let (controller, inverse) = (logs.of(NodeId::Controller).unwrap(), logs.of(NodeId::Inverse).unwrap());
    let (first, last) = longest_hole(|tick| controller.record(tick).is_some(), controller.ticks());
    assert!(last - first >= 90, "the controller stood still from {first} to {last}");
    for tick in first..last {
        let heard = inverse.consumed::<Demand>(tick);
        assert!(heard.is_none_or(|demand| demand.tick < first), "at {tick}: {heard:?}");
    }
    assert_safe(&out, id);
    assert_replays(&out);
}

/// The ticks of a node's second process.
fn ticks_of_the_second(logs: &Logs, node: NodeId) -> Vec<u64> {
    let log = logs.of(node).unwrap();
    (0..log.ticks())
        .filter(|tick| log.record(*tick).is_some_and(|record| record.start_number == 1))
        .collect()
}

/// Kills a process of a run like this, and checks what must hold however long the next one takes to come.
fn kill_one(name: &str, at_tick: u64, out: &Path, settings: &[&str]) -> Value {
    let settings: Vec<&str> = settings.iter().flat_map(|setting| ["--set", *setting]).collect();
    let mut launcher = begin(out, &settings);
    let id = launcher.id();
    let pid = process_from(at_tick, &mut launcher, out, name);
    kill_process(pid, Signal::KILL).unwrap();
    let finished = Finished::wait(launcher, LIMIT);
    let told = format!("{name} was killed by signal 9 at tick ");
    assert!(
        finished.err.contains(&told) && finished.err.contains("started again"),
        "{}",
        finished.err
    );
    let summary = summary_as_judged(&finished);
    let restarts = summary["realtime"]["restarts"].as_array().unwrap();
    assert_eq!(restarts.len(), 1, "{restarts:?}");
    assert_eq!(restarts[0]["process"], name);
    assert_safe(out, id);
    assert_replays(out);
    summary
}

/// Guards restarts: what dies comes back, is heard again by those who knew the old one, and the run ends well.
#[test]
fn killed_estimators_and_inverses_come_back() {
    let _alone = alone();
    for (name, node, reader) in [
        ("estimator", NodeId::Estimator, NodeId::Inverse),
        ("inverse", NodeId::Inverse, NodeId::Guard),
    ] {
        let root = tempfile::tempdir().unwrap();
        // How long a process takes to start is a matter of the machine.
        let came_back = [4, 20, 100].into_iter().any(|duration_s| {
            let out = root.path().join(format!("{duration_s}"));
            kill_one(name, 100, &out, &[&format!("duration_s={duration_s}")]);
            let logs = Logs::open(&RunFolder::open(&out)).unwrap();
            let again = ticks_of_the_second(&logs, node);
            if node == NodeId::Estimator && !again.is_empty() {
                let first = logs.of(node).unwrap().token::<Estimate>(again[0]);
                assert!(first.unwrap().shape_a_per_m > 0.0);
            }
            let channel = logs.of(node).unwrap().layout().outputs[0];
            let reader = logs.of(reader).unwrap();
            let mut inputs = reader.layout().inputs.iter();
            let input = inputs.position(|input| *input == channel).unwrap();
            let mut heard: Vec<u64> = (0..reader.ticks())
                .filter_map(|tick| reader.record(tick)?.consumed[input])
                .filter(|tick| again.contains(tick))
                .collect();
            heard.dedup();
            heard.len() > A_FEW
        });
        assert!(came_back, "no second {name} was heard");
    }
}

/// Guards the verdict on a run that was not seen as a whole: it counts what nobody saw, and forgets nothing that the dead saw.
#[test]
fn a_killed_recorder_comes_back_and_says_what_it_has_not_seen() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let settings = [
        "duration_s=4",
        // Judged from the first tick: so there is always something that was not seen.
        "expect.settling_s=0",
        "faults=[Link(from_tick: 300, for_ticks: 3, channel: measurement, kind: Nan)]",
    ];
    let summary = kill_one("recorder", 2500, &root.path().join("run"), &settings);
    assert!(summary["unjudged_ticks"].as_u64() > Some(0), "{summary}");
    assert!(summary["first_event_name"].is_string(), "{summary}");
    assert!(summary["first_event_tick"].as_u64() < Some(2000), "{summary}");
}

/// Guards against a process that neither ends nor goes on. Nobody waits for it: the field is safe, and the launcher notices.
#[test]
fn a_process_that_hangs_is_named_and_the_field_is_safe() {
    let _alone = alone();
    for (name, pace) in [
        ("controller", "FreeRunning"),
        ("guard", "FreeRunning"),
        ("plant-sim", "FreeRunning"),
        ("plant-sim", "PacedByMeasurement"),
        ("controller", "PacedByMeasurement"),
        ("controller", "so late that the others come to the end"),
    ] {
        let (pace, duration) = match pace.starts_with("so late") {
            true => ("FreeRunning", "duration_s=1.8"),
            false => (pace, "duration_s=60"),
        };
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("run");
        let mut launcher = begin(&out, &["--set", duration, "--set", &format!("clock.pace={pace}")]);
        let id = launcher.id();
        let pid = process_at_work(&mut launcher, &out, name);
        kill_process(pid, Signal::STOP).unwrap();
        let finished = Finished::wait(launcher, LIMIT).expect(3);
        let told = format!("{name} stood still for ");
        assert!(finished.err.contains(&told), "{pace}: {}", finished.err);
        assert!(!finished.err.contains("started again"), "{}", finished.err);
        assert_safe(&out, id);
        let logs = Logs::open(&RunFolder::open(&out)).unwrap();
        let amplifier = logs.of(NodeId::Amplifier).unwrap();
        let last = (0..amplifier.ticks())
            .rev()
            .find_map(|tick| amplifier.token::<CoilField>(tick));
        assert!(last.unwrap().field_a_per_m.abs() <= 1.0, "{name}, {pace}: {last:?}");
    }
}

/// Guards the same where the run can go on.
#[test]
fn an_estimator_that_hangs_is_started_again() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let came_back = [8, 30, 120].into_iter().any(|duration_s| {
        let out = root.path().join(format!("{duration_s}"));
        let mut launcher = begin(&out, &["--set", &format!("duration_s={duration_s}")]);
        let id = launcher.id();
        let pid = process_at_work(&mut launcher, &out, "estimator");
        kill_process(pid, Signal::STOP).unwrap();
        let finished = Finished::wait(launcher, LIMIT);
        let summary = summary_as_judged(&finished);
        let restarts = summary["realtime"]["restarts"].as_array().unwrap();
        assert_eq!(restarts.len(), 1, "{restarts:?}");
        let how = restarts[0]["how"].as_str().unwrap();
        assert!(how.starts_with("stood still for "), "{how}");
        assert_safe(&out, id);
        assert_replays(&out);
        let logs = Logs::open(&RunFolder::open(&out)).unwrap();
        ticks_of_the_second(&logs, NodeId::Estimator).len() > A_FEW
    });
    assert!(came_back, "no second estimator worked");
}

/// Guards the limits of it: what the loop cannot do without ends the run by name.
#[test]
fn a_killed_guard_ends_the_run() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let mut launcher = begin(&out, &["--set", "duration_s=60"]);
    let id = launcher.id();
    let guard = process_at_work(&mut launcher, &out, "guard");
    kill_process(guard, Signal::KILL).unwrap();
    let finished = Finished::wait(launcher, LIMIT).expect(3);
    assert!(
        finished.err.contains("guard was killed by signal 9 at tick "),
        "{}",
        finished.err
    );
    assert_eq!(files_with(&format!("anhyst_{id}_")), Vec::<String>::new());
}

#[test]
fn one_process_keeps_time_too() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let launcher = begin(&out, &["--embedded"]);
    let finished = Finished::wait(launcher, LIMIT);
    summary_as_judged(&finished);
    // It cannot have taken less than the time that it lasts.
    assert!(finished.took >= Duration::from_secs(2), "{:?}", finished.took);
    assert_replays(&out);
}
