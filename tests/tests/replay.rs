//! Guards that a recording, in parts as well, is enough to run any node again, bit for bit, and that the comparison can fail.

use anhyst_tests::{Finished, LIMIT};
use serde_json::Value;

fn run(out: &str, more: &[&str]) {
    let settings = ["duration_s=0.3", "expect.settling_s=0.1", "recording.block_ticks=500"];
    let settings = settings.iter().chain(more).flat_map(|setting| ["--set", setting]);
    let run = ["run", "scenarios/milling.ron", "--out", out]
        .into_iter()
        .chain(settings);
    let finished = Finished::run(&run.collect::<Vec<_>>(), LIMIT);
    assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
}

/// Guards what a ring left out: it is said instead of taken for the run, and the table has the times of what is there.
#[test]
fn what_a_ring_left_out_is_told() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run").to_string_lossy().into_owned();
    // Far enough for no error beyond it.
    run(
        &out,
        &["recording.ring_s=0.05", "expect.tolerance_m=1e-5", "placement=Embedded"],
    );
    let refused = Finished::run(&["replay", &out], LIMIT).expect(2);
    assert!(refused.err.contains("goes on with tick 4000"), "{}", refused.err);
    Finished::run(&["export", &out], LIMIT).expect(0);
    let table = std::fs::read_to_string(root.path().join("run/run.csv")).unwrap();
    let first = table.lines().nth(1).unwrap();
    assert!(first.starts_with("0.2001,"), "{first}");
}

#[test]
fn recorded_tokens_replay_every_node_and_a_change_is_found() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let out = out.to_string_lossy();
    run(&out, &["recording.part_s=0.1"]);
    assert!(std::path::Path::new(&*out).join("recording-3.rrd").exists());
    let replayed = Finished::run(&["replay", &out, "--json"], LIMIT).expect(0);
    let nodes: Vec<Value> = serde_json::from_str(&replayed.out).unwrap();
    assert_eq!(nodes.len(), 6);
    assert!(
        nodes.iter().all(|node| node["same"] == true && node["ticks"] == 6000),
        "{}",
        replayed.out
    );

    // Another gain in the effective scenario: the controller answers otherwise, and only the controller.
    let scenario = std::path::Path::new(&*out).join("scenario.ron");
    let text = std::fs::read_to_string(&scenario).unwrap();
    assert!(text.contains("kp: 0.3"));
    std::fs::write(&scenario, text.replace("kp: 0.3", "kp: 0.31")).unwrap();
    let changed = Finished::run(&["replay", &out, "--node", "controller"], LIMIT).expect(1);
    assert!(changed.out.starts_with("controller: DIFFERS: tick "), "{}", changed.out);
    Finished::run(&["replay", &out, "--node", "guard"], LIMIT).expect(0);
}
