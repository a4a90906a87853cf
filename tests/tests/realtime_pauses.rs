//! Guards a real-time loop against false ticks and pauses: nobody goes deaf, no run ends early, and whoever was held up knows
//! afterwards what was said meanwhile. No figure of time is judged: machines are shared.

use anhyst_ipc::{Channel, NodeId};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Logs;
use anhyst_tests::{A_FEW, Finished, LIMIT, alone, children, start, summary_as_judged, wait_for};
use rustix::process::{Pid, Signal, kill_process};

const SETTINGS: [&str; 4] = [
    "placement=Separate",
    "tick_s=1e-3",
    "duration_s=2",
    "expect.tolerance_m=None",
];

fn arguments<'a>(out: &'a str, more: &'a [&'a str]) -> Vec<&'a str> {
    let mut given = vec![
        "run",
        "scenarios/realtime.ron",
        "--no-recording",
        "--json",
        "--out",
        out,
    ];
    for setting in SETTINGS.iter().chain(more) {
        given.extend(["--set", setting]);
    }
    given
}

/// A token of tick 1001000 made its readers deaf until then; paced by it, they turned to that tick, which ended their run.
#[test]
fn a_false_tick_makes_nobody_deaf_and_ends_no_run() {
    let _alone = alone();
    for (pace, jump) in [
        ("FreeRunning", 1_000_000),
        ("PacedByMeasurement", 1_000_000),
        ("PacedByMeasurement", 40),
    ] {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("run");
        let fault = format!("Link(from_tick: 1000, for_ticks: 1, channel: measurement, kind: ClockJump({jump}))");
        let settings = [format!("clock.pace={pace}"), format!("faults=[{fault}]")];
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        let summary = summary_as_judged(&Finished::run(&arguments(&out.to_string_lossy(), &settings), LIMIT));
        assert_eq!(summary["ticks"], 2000, "{pace}");
        let logs = Logs::open(&RunFolder::open(&out)).unwrap();
        for node in [NodeId::Estimator, NodeId::Controller, NodeId::Guard] {
            let log = logs.of(node).unwrap();
            let mut inputs = log.layout().inputs.iter();
            let input = inputs.position(|channel| *channel == Channel::Measurement).unwrap();
            let mut heard: Vec<u64> = (1200..log.ticks())
                .filter_map(|tick| log.record(tick)?.consumed[input])
                .filter(|tick| *tick > 1100)
                .collect();
            heard.dedup();
            assert!(
                heard.len() > A_FEW,
                "{pace}, {jump}: {node} heard {} of 800",
                heard.len()
            );
        }
    }
}

/// An estimator that was held up for 40 ticks takes up what the plant has measured in them, and its log tells all that it
/// heard: fed with that, another one says the same.
#[test]
fn an_estimator_that_was_held_up_knows_what_was_said() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let given = out.to_string_lossy();
    let mut launcher = start(&arguments(&given, &[]));
    let id = launcher.id();
    let logs = || Logs::open(&RunFolder::open(&out)).ok();
    let estimator = wait_for(&mut launcher, || {
        last_answer(&logs()?, NodeId::Plant).filter(|tick| *tick > 600)?;
        let (pid, _) = children(id).into_iter().find(|(_, name)| name == "estimator")?;
        Pid::from_raw(pid as i32)
    });
    kill_process(estimator, Signal::STOP).unwrap();
    let held_from = last_answer(&logs().unwrap(), NodeId::Estimator).unwrap() + 2;
    let held_up = held_from..held_from + 40;
    wait_for(&mut launcher, || {
        last_answer(&logs()?, NodeId::Plant).filter(|tick| *tick >= held_up.end)
    });
    kill_process(estimator, Signal::CONT).unwrap();
    summary_as_judged(&Finished::wait(launcher, LIMIT));
    let logs = logs().unwrap();
    let log = logs.of(NodeId::Estimator).unwrap();
    for tick in held_up {
        let record = log.followed(tick).unwrap_or_else(|| panic!("nothing of tick {tick}"));
        assert_eq!((record.answered, record.consumed[0]), (false, Some(tick)));
    }
    Finished::run(&["replay", &given, "--node", "estimator"], LIMIT).expect(0);
}

/// The last tick that a node has answered so far.
fn last_answer(logs: &Logs, node: NodeId) -> Option<u64> {
    let log = logs.of(node).ok()?;
    (0..log.ticks()).rev().find(|tick| log.record(*tick).is_some())
}
