//! Guards a real-time loop against false ticks and pauses: nobody goes deaf, no run ends early, and whoever was held up knows
//! afterwards what was said meanwhile. No figure of time is judged: machines are shared.

use anhyst_ipc::{Channel, Connections, Discipline, Estimate, Measurement, NodeId, SafeField};
use anhyst_launch::assemble;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Logs;
use anhyst_scenario::{load, wires};
use anhyst_tests::{A_FEW, Finished, LIMIT, alone, children, repository, start, summary_as_judged, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::time::Duration;

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

/// What an estimator says that was held up for 30 ms is what one says that has heard all that plant and guard have sent.
#[test]
fn an_estimator_that_was_held_up_knows_what_was_said() {
    let _alone = alone();
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let given = out.to_string_lossy();
    let mut launcher = start(&arguments(&given, &[]));
    let id = launcher.id();
    let estimator = wait_for(&mut launcher, || {
        let logs = Logs::open(&RunFolder::open(&out)).ok()?;
        let guard = logs.of(NodeId::Guard).ok()?;
        (600..guard.ticks()).find(|tick| guard.record(*tick).is_some())?;
        let (pid, _) = children(id).into_iter().find(|(_, name)| name == "estimator")?;
        Pid::from_raw(pid as i32)
    });
    kill_process(estimator, Signal::STOP).unwrap();
    std::thread::sleep(Duration::from_millis(30));
    kill_process(estimator, Signal::CONT).unwrap();
    summary_as_judged(&Finished::wait(launcher, LIMIT));
    let held_up = says_what_one_says_that_hears_all(&out);
    assert!(held_up >= 20, "{held_up} ticks were left out");
    Finished::run(&["replay", &given, "--node", "estimator"], LIMIT).expect(0);
}

/// Compares the estimates of a run with those of an estimator that answers every tick; how many the run's left out.
fn says_what_one_says_that_hears_all(out: &Path) -> usize {
    let scenario = load(
        &repository().join("scenarios/realtime.ron"),
        &SETTINGS.map(|setting| setting.parse().unwrap()),
    );
    let mut connections = Connections::new(NodeId::LOOP_ORDER, wires(), None).with_discipline(Discipline::AsFed);
    let mut stage = assemble::stage(NodeId::Estimator, &scenario.unwrap(), &mut connections).unwrap();
    let (mut measurements, mut fields) = (connections.sender().unwrap(), connections.sender().unwrap());
    let logs = Logs::open(&RunFolder::open(out)).unwrap();
    let [plant, guard, own] = [NodeId::Plant, NodeId::Guard, NodeId::Estimator].map(|node| logs.of(node).unwrap());
    let (mut left_out, mut said) = (0, 0);
    for tick in 0..own.ticks() {
        let record = own.record(tick);
        // What was late for a tick that it answered is the run's affair; of one that it left out it hears what there was.
        let [measured_at, given_at] = match &record {
            Some(record) => [record.consumed[0], record.consumed[1]],
            None => [Some(tick), (0..tick).rev().find(|given| guard.record(*given).is_some())],
        };
        if let Some(measurement) = measured_at.and_then(|at| plant.token::<Measurement>(at)) {
            measurements.send(measurement).unwrap();
        }
        if let Some(field) = given_at.and_then(|at| guard.token::<SafeField>(at)) {
            fields.send(field).unwrap();
        }
        stage.tick(tick).unwrap();
        if record.is_some() {
            let (one, other): (Estimate, Estimate) = (own.token(tick).unwrap(), connections.last().unwrap());
            assert_eq!(
                Estimate { sent_ns: 0, ..one },
                Estimate { sent_ns: 0, ..other },
                "tick {tick}"
            );
            said += 1;
        } else {
            left_out += 1;
        }
    }
    assert!(said > A_FEW);
    left_out
}
