//! Guards `anhyst tune`: a run that was tuned while it went on is the same run again from its folder, bit for bit; what is refused
//! changes nothing.

use anhyst_ipc::NodeId;
use anhyst_tests::{
    Finished, LIMIT, anhyst, assert_same, files_with, first_difference, folders, repository, start, summary, wait_for,
};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Killed when dropped, so that a failing test leaves nothing running.
struct Ended(Option<Child>);

impl Drop for Ended {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn tune(run: &Path, settings: &[&str]) -> Finished {
    let run = run.to_string_lossy();
    Finished::run(&[&["tune", &run, "--json"], settings].concat(), LIMIT)
}

fn changes(told: &Finished) -> Vec<Value> {
    serde_json::from_str(&told.out).unwrap_or_default()
}

fn embedded(scenario: &Path, out: &Path) {
    let (scenario, out) = (scenario.to_string_lossy(), out.to_string_lossy());
    let again = ["run", &scenario, "--embedded", "--no-recording", "--out", &out];
    Finished::run(&again, LIMIT).expect(0);
}

#[test]
fn a_tuned_run_is_the_same_run_again() {
    let (_root, [run, again, changed]) = folders();
    let out = run.to_string_lossy();
    // Long enough to be met while it goes on, on whatever machine.
    let long = ["--set", "duration_s=8.0", "--set", "expect.tolerance_m=25e-9"];
    let mut launched = Ended(Some(start(
        &[&["run", "scenarios/milling.ron", "--out", &out], &long[..]].concat(),
    )));
    let meeting = run.join("processes").join("meeting.json");
    let resources: Value = wait_for(launched.0.as_mut().unwrap(), || {
        serde_json::from_slice(&std::fs::read(&meeting).ok()?).ok()
    });
    let prefix = resources["prefix"].as_str().unwrap();

    let first = tune(
        &run,
        &["controller.feedback.kp=0.35", "controller.trajectory.amplitude=0.5"],
    )
    .expect(0);
    let first = changes(&first);
    assert_eq!(first.len(), 2, "{first:?}");
    assert_eq!(first[0]["tick"], first[1]["tick"], "both in one tick");
    let scenario = run.join("scenario.ron");
    let before = std::fs::read_to_string(&scenario).unwrap();
    let refused = tune(&run, &["expect.tolerance_m=24e-9", "controller.feedback.kp=3"]).expect(2);
    assert!(
        refused.err.contains("controller.feedback.kp = 3") && refused.err.contains("the least is 0.50"),
        "{}",
        refused.err
    );
    let refused = tune(&run, &["controller.trajectory.amplitude=5"]).expect(2);
    assert!(
        refused.err.contains("controller.trajectory.amplitude = 5: at "),
        "{}",
        refused.err
    );
    let refused = tune(&run, &["guard.field_limit_a_per_m=1e9"]).expect(2);
    assert!(
        refused.err.contains("what can: controller.feedback.kp,"),
        "{}",
        refused.err
    );
    assert_eq!(
        std::fs::read_to_string(&scenario).unwrap(),
        before,
        "what is refused changes nothing"
    );
    let tolerance = changes(&tune(&run, &["expect.tolerance_m=22e-9"]).expect(0));
    let last = changes(&tune(&run, &["controller.feedback.ki_per_s=1500"]).expect(0));
    let tick = |change: &[Value]| change[0]["tick"].as_u64().unwrap();
    assert!(tick(&first) < tick(&last) && tick(&first) % 64 == 0);

    Finished::wait(launched.0.take().unwrap(), LIMIT).expect(0);
    assert!(files_with(prefix).is_empty(), "{:?}", files_with(prefix));
    let told = summary(&run)["changes"].as_array().cloned().unwrap_or_default();
    for change in first.iter().chain(&tolerance).chain(&last) {
        assert!(told.contains(change), "{change} is not in {told:?}");
    }
    assert_eq!(told.len(), 4);

    // The folder's scenario is the tuned run; judged by the tolerance that was in force.
    embedded(&scenario, &again);
    assert_same(&run, &again);
    assert_eq!(summary(&run)["least"], summary(&again)["least"]);
    Finished::run(&["replay", &out, "--node", "controller"], LIMIT).expect(0);
    let over = tune(&run, &["controller.feedback.kp=0.3"]).expect(2);
    assert!(over.err.contains("it has ended, or is embedded"), "{}", over.err);

    // One unit in the last place of one value is another run, from the tick of its change on.
    let text = std::fs::read_to_string(&scenario).unwrap();
    let other = format!("value: {:?}", f64::from_bits(0.35_f64.to_bits() + 1));
    assert!(text.contains("value: 0.35,"));
    let elsewhere = run.join("other.ron");
    std::fs::write(&elsewhere, text.replace("value: 0.35", &other)).unwrap();
    embedded(&elsewhere, &changed);
    let difference = first_difference(&run, &changed);
    assert!(
        difference.is_some_and(|(node, from)| node == NodeId::Controller && from > tick(&first)),
        "{difference:?}"
    );
}

/// Guards the names by which a run is found: its folder's and its scenario's, whatever the folder is called.
#[test]
fn a_run_is_found_by_the_name_of_its_folder_or_scenario() {
    let root = tempfile::tempdir().unwrap();
    let there = |words: &[&str]| {
        let mut command = Command::new(anhyst());
        command.current_dir(root.path()).args(words);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let scenario = repository().join("scenarios/milling.ron");
    let long = ["--no-recording", "--set", "duration_s=600", "--out", "runs/cut2"];
    let run = there(&[&["run", scenario.to_str().unwrap()], &long[..]].concat());
    let mut launched = Ended(Some(run));
    let meeting = root.path().join("runs/cut2/processes/meeting.json");
    wait_for(launched.0.as_mut().unwrap(), || meeting.exists().then_some(()));
    let tuned = |name: &str| Finished::wait(there(&["tune", name, "controller.feedback.kp=0.35"]), LIMIT);
    for name in ["milling", "cut2", "runs/cut2"] {
        tuned(name).expect(0);
    }
    let refused = tuned("cut").expect(2);
    assert!(refused.err.contains("no run called cut goes on"), "{}", refused.err);
    let launched = launched.0.take().unwrap();
    kill_process(Pid::from_raw(launched.id() as i32).unwrap(), Signal::INT).unwrap();
    Finished::wait(launched, LIMIT).expect(3);
}

/// Guards the bounds: each sentence has the setting, its value and why not; a scenario's own changes are held to them, too.
#[test]
fn a_change_beyond_its_bounds_is_refused() {
    let check = |changes: &str, more: &[&str]| {
        let changes = format!("changes=[{changes}]");
        Finished::run(
            &[&["check", "scenarios/milling.ron", "--set", &changes], more].concat(),
            LIMIT,
        )
    };
    let one = |set: &str, value: &str| format!("(tick: 100, set: \"{set}\", value: {value})");
    let cases = [
        (
            one("controller.feedback.kp", "0.7"),
            "controller.feedback.kp = 0.7: |1 + L| would go down to",
        ),
        (one("controller.feedback.kp", "-1.0"), "-1 m/m is outside [0, 1000] m/m"),
        (one("controller.feedback.ki_per_s", "30000.0"), "outside [0, 20000] 1/s"),
        (
            one("controller.feedback.ki_per_s", "15000.0"),
            "the loop would be unstable",
        ),
        (one("controller.feedback.kd_s", "1e-4"), "is below one tick"),
        (
            one("controller.learning.on", "1.0"),
            "this scenario has no controller.learning",
        ),
        (
            one("controller.trajectory.amplitude", "-1.0"),
            "-1 times the stated one is outside [0, 100]",
        ),
        (
            one("controller.trajectory.amplitude", "4.5"),
            "the rod needs a quasi-static displacement of",
        ),
        (
            one("expect.tolerance_m", "0.0"),
            "0 m must be finite and greater than 0 m",
        ),
        (
            one("expect.tolerance_m", "1e-3"),
            "is more than the profile's own stroke",
        ),
        (
            one("guard.field_limit_a_per_m", "1.0"),
            "cannot be changed while a run goes on; what can:",
        ),
        (
            "(tick: 90000, set: \"expect.tolerance_m\", value: 1e-8)".into(),
            "tick 90000 is after the last, 89999",
        ),
        (
            [(200, "0.2"), (100, "0.3")]
                .map(|(tick, kp)| format!("(tick: {tick}, set: \"controller.feedback.kp\", value: {kp})"))
                .join(","),
            "tick 100 comes before 200",
        ),
    ];
    for (changes, sentence) in cases {
        let told = check(&changes, &[]).expect(2);
        assert!(told.err.contains(sentence), "{changes}: {}", told.err);
    }
    check(&one("controller.feedback.kp", "0.4"), &[]).expect(0);
    let learning = ["--set", "controller.learning=()"];
    check(&one("controller.learning.on", "0.0"), &learning).expect(0);
    let half = check(&one("controller.learning.on", "0.5"), &learning).expect(2);
    assert!(half.err.contains("it is on, 1, or off, 0"), "{}", half.err);
    // Without feedback there is no gain to change.
    let bare = check(
        &one("controller.feedback.kp", "0.4"),
        &["--set", "controller.feedback=None"],
    )
    .expect(2);
    assert!(
        bare.err.contains("this scenario has no controller.feedback"),
        "{}",
        bare.err
    );
}
