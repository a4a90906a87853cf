//! Guards that a recording is enough to run any node again, bit for bit, and that the comparison can fail.

use anhyst_tests::{Finished, LIMIT};
use serde_json::Value;

#[test]
fn recorded_tokens_replay_every_node_and_a_change_is_found() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run");
    let out = out.to_string_lossy();
    let short = ["--set", "duration_s=0.3", "--set", "expect.settling_s=0.1"];
    let finished = Finished::run(
        &[&["run", "scenarios/milling.ron", "--out", &out], &short[..]].concat(),
        LIMIT,
    );
    assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
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
