//! Guards the other half of the promise: the plant can be somebody else's, alone or with its amplifier. In lockstep it gives
//! the same bits twice; in real time it has the only timer, and the loop follows. No figure of time is judged, nor the error:
//! the example's rod is not the one that the controller believes in.

use anhyst_ipc::{Measurement, NodeId};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Logs;
use anhyst_tests::{A_FEW, Finished, LIMIT, alone, files_with, python, start, summary_as_judged};
use serde_json::Value;
use std::path::Path;

const FIELD_LIMIT_A_PER_M: f64 = 30e3;
/// Alone: what is external, and where nodes are placed.
const ALONE: (&str, &str) = ("plant", "placement=Separate");
const WITH_AMPLIFIER: (&str, &str) = ("plant-sim+amplifier", "placement=Groups([[plant, amplifier]])");

/// Runs a scenario to its end with the plant in Python; the summary.
fn run(out: &Path, scenario: &str, (process, placement): (&str, &str), settings: &[&str], python: &str) -> Value {
    let command = format!("{process}=exec {python} examples/plant-python/plant.py");
    let out = out.to_string_lossy();
    let mut arguments = vec!["run", scenario, "--no-recording", "--json", "--out", &out];
    for setting in [placement, "expect.tolerance_m=None"].iter().chain(settings) {
        arguments.extend(["--set", setting]);
    }
    arguments.extend(["--external-command", &command]);
    let launcher = start(&arguments);
    let id = launcher.id();
    let summary = summary_as_judged(&Finished::wait(launcher, LIMIT));
    assert_eq!(files_with(&format!("anhyst_{id}_")), Vec::<String>::new());
    let peak = summary["field_peak_a_per_m"].as_f64().unwrap();
    assert!(peak > 0.0 && peak <= FIELD_LIMIT_A_PER_M, "{peak} A/m");
    assert!(summary["error_max_m"].as_f64().is_some_and(f64::is_finite), "{summary}");
    summary
}

#[test]
fn in_lockstep_a_python_plant_gives_the_same_bits_twice() {
    let _alone = alone();
    let Some(python) = python() else { return };
    let root = tempfile::tempdir().unwrap();
    for (index, kind) in [ALONE, WITH_AMPLIFIER].into_iter().enumerate() {
        let [one, two] = [1, 2].map(|turn| {
            let out = root.path().join(format!("{index}-{turn}"));
            let settings = ["duration_s=0.2", "expect.settling_s=0.1"];
            run(&out, "scenarios/milling.ron", kind, &settings, &python)
        });
        assert_eq!(one["lost_tokens"], 0);
        assert_eq!(one["ticks"], 4000);
        assert_eq!(one["digest"], two["digest"]);
    }
}

/// Guards the timer of the foreign plant: nobody else has one, and the run comes to its end.
#[test]
fn in_real_time_a_python_plant_has_the_timer() {
    let _alone = alone();
    let Some(python) = python() else { return };
    let root = tempfile::tempdir().unwrap();
    for (pace, kind) in [("PacedByMeasurement", ALONE), ("FreeRunning", WITH_AMPLIFIER)] {
        let out = root.path().join(pace);
        let clock = format!("clock=Realtime(pace: {pace})");
        let settings = [
            &clock,
            "tick_s=2e-3",
            "duration_s=1",
            "controller.trajectory=Profile(spindle_rpm: 3000.0, lobes: [(1, 40e-6, 0.0)])",
            "controller.feedback=(kp: 0.05, ki_per_s: 50.0)",
        ];
        let summary = run(&out, "scenarios/realtime.ron", kind, &settings, &python);
        assert_eq!(summary["ticks"], 500);
        let seen = summary["realtime"]["external"].as_array().unwrap();
        let of_the_guard = |seen: &&Value| seen["channel"] == "measurement" && seen["reader"] == "guard";
        let guard = seen.iter().find(of_the_guard).unwrap();
        assert!(guard["late_ticks"].is_u64(), "{guard}");
        let foreign: &[NodeId] = if kind == ALONE {
            &[NodeId::Plant]
        } else {
            &[NodeId::Plant, NodeId::Amplifier]
        };
        let logs = Logs::open_but(&RunFolder::open(&out), foreign).unwrap();
        let log = logs.of(NodeId::Guard).unwrap();
        let taken = (0..log.ticks()).filter_map(|tick| log.consumed::<Measurement>(tick));
        let mut ticks: Vec<u64> = taken.map(|measurement| measurement.tick).collect();
        ticks.dedup();
        assert!(ticks.len() > A_FEW, "{} measurements reached the guard", ticks.len());
        let replayed = Finished::run(&["replay", &out.to_string_lossy(), "--json"], LIMIT).expect(0);
        let nodes: Vec<Value> = serde_json::from_str(&replayed.out).unwrap();
        assert!(
            !nodes.is_empty() && nodes.iter().all(|node| node["same"] == true),
            "{nodes:?}"
        );
        assert!(replayed.err.contains("plant-sim was external"), "{}", replayed.err);
    }
}
