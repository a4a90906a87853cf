//! Guards a run over two hosts: the bits of one host, nothing lost, and an end by name on both sides when something breaks.
//! Needs `cargo build --release -p anhyst --features bridge` and the feature `bridge` here.

use anhyst_ipc::{NodeId, combine};
use anhyst_tests::{Finished, Hosts, LIMIT, children, digest_history, files_with, start};
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::Child;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

const RIG: &str = "plant-sim,amplifier";
const REST: &str = "estimator,controller,inverse,guard,recorder";
/// One run at a time: each has nine processes.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Two hosts and the two folders of their results.
struct Rig {
    hosts: Hosts,
    _root: tempfile::TempDir,
    folders: [PathBuf; 2],
}

impl Rig {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        Self {
            hosts: Hosts::new(),
            folders: ["rig", "rest"].map(|name| root.path().join(name)),
            _root: root,
        }
    }

    fn start(&self, host: usize, here: &str, more: &[&str]) -> Child {
        let way = if host == 0 { "--listen" } else { "--connect" };
        let out = self.folders[host].to_string_lossy();
        let fixed = [
            "run",
            "scenarios/milling.ron",
            "--no-recording",
            "--out",
            &out,
            "--here",
            here,
        ];
        self.hosts
            .start(host, &[&fixed, &[way, &self.hosts.endpoint][..], more].concat())
    }

    fn both(&self, more: &[&str]) -> [Child; 2] {
        [self.start(0, RIG, more), self.start(1, REST, more)]
    }

    /// Waits until both bridges have measured the link, and then for the loop to run.
    fn wait_until_looping(&self, sides: &mut [Child; 2]) {
        let begin = Instant::now();
        while self
            .folders
            .iter()
            .any(|folder| !folder.join("processes/bridge.txt").is_file())
        {
            for side in sides.iter_mut() {
                assert!(
                    side.try_wait().unwrap().is_none(),
                    "a side ended before it was disturbed"
                );
            }
            assert!(begin.elapsed() < LIMIT, "the bridges do not meet");
            std::thread::sleep(Duration::from_millis(10));
        }
        std::thread::sleep(Duration::from_secs(2));
    }
}

fn kill(launcher: &Child, name: &str) {
    let all = children(launcher.id());
    let (pid, _) = all.iter().find(|(_, subcommand)| subcommand == name).unwrap();
    kill_process(Pid::from_raw(*pid as i32).unwrap(), Signal::KILL).unwrap();
}

fn finish(sides: [Child; 2]) -> [Finished; 2] {
    let prefixes = [sides[0].id(), sides[1].id()].map(|pid| format!("anhyst_{pid}_"));
    let finished = sides.map(|side| Finished::wait(side, LIMIT));
    for prefix in prefixes {
        assert_eq!(files_with(&prefix), Vec::<String>::new());
    }
    finished
}

fn report(folder: &Path, process: &str) -> serde_json::Value {
    let path = folder.join("processes").join(format!("{process}.json"));
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// The amplifier hears nobody of the other host any more: its own watchdog has to bring the field to zero.
fn assert_safe(rig: &Rig) {
    let report = report(&rig.folders[0], "amplifier");
    let field = report["nodes"][0]["field_a_per_m"].as_f64().unwrap();
    // The end of a lag is never quite reached: 1 A/m of 10 kA/m counts as safe.
    assert!(field.abs() <= 1.0, "{report}");
}

#[test]
fn two_hosts_give_the_bits_of_one() {
    let _turn = alone();
    let rig = Rig::new();
    let length = ["--set", "duration_s=1"];
    let one = rig.folders[0].with_file_name("one");
    let out = one.to_string_lossy();
    let embedded = [
        "run",
        "scenarios/milling.ron",
        "--no-recording",
        "--embedded",
        "--out",
        &out,
    ];
    Finished::wait(start(&[&embedded[..], &length].concat()), LIMIT).expect(0);
    let finished = finish(rig.both(&length)).map(|side| side.expect(0));
    for side in &finished {
        println!("{}", side.out);
    }
    if rig.hosts.are_apart() {
        println!("a network lay between the two sides");
    }
    let mut nodes = Vec::new();
    for node in NodeId::SENDERS {
        let side = &rig.folders[usize::from(!RIG.split(',').any(|name| name == node.name()))];
        if let Some(tick) = digest_history(&one, node).first_difference(&digest_history(side, node)) {
            panic!("{node} differs from tick {tick} on");
        }
        let report = report(side, node.name());
        assert_eq!(report["nodes"][0]["ticks"], 20_000, "{node}");
        for link in report["nodes"][0]["links"].as_array().unwrap() {
            assert_eq!(link["lost"], 0, "{link}");
        }
        nodes.push((node.name(), report["nodes"][0]["digest"].as_u64().unwrap()));
    }
    let summary: serde_json::Value = serde_json::from_slice(&std::fs::read(one.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["digest"].as_str().unwrap(), combine(nodes));
    // The recorder, on the far side, has judged the same run.
    let verdict = &report(&rig.folders[1], "recorder")["verdict"];
    assert_eq!(verdict["error_max_m"], summary["error_max_m"]);
    assert!(verdict["error_max_m"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_killed_bridge_ends_both_sides_by_name() {
    let _turn = alone();
    let rig = Rig::new();
    let mut sides = rig.both(&["--set", "duration_s=600"]);
    rig.wait_until_looping(&mut sides);
    kill(&sides[1], "bridge");
    let [rig_side, rest] = finish(sides).map(|side| side.expect(3));
    assert!(rest.err.contains("bridge was killed by signal 9"), "{}", rest.err);
    // Whoever of that side notices first: the bridge misses the other one, the amplifier its commands.
    let named = [
        "estimator, controller, inverse, guard, recorder is silent",
        "guard is silent",
    ];
    assert!(
        named.iter().any(|words| rig_side.err.contains(words)),
        "{}",
        rig_side.err
    );
    assert_safe(&rig);
}

#[test]
fn a_killed_process_is_named_on_the_other_host() {
    let _turn = alone();
    let rig = Rig::new();
    let mut sides = rig.both(&["--set", "duration_s=600"]);
    rig.wait_until_looping(&mut sides);
    kill(&sides[1], "inverse");
    let [rig_side, rest] = finish(sides).map(|side| side.expect(3));
    assert!(rest.err.contains("inverse was killed by signal 9"), "{}", rest.err);
    assert!(rig_side.err.contains("inverse has died"), "{}", rig_side.err);
    assert_safe(&rig);
}

#[test]
fn sides_that_do_not_fit_are_refused() {
    let _turn = alone();
    for (here, more, words) in [
        (REST, &["--set", "seed=2"][..], "the other side has the scenario"),
        (REST, &["--set", "tick_s=1e-4"], "the other side has a tick of"),
        (
            "controller,inverse,guard,recorder",
            &[],
            "estimator runs on neither side",
        ),
        (
            "amplifier,estimator,controller,inverse,guard,recorder",
            &[],
            "amplifier runs on both sides",
        ),
    ] {
        let rig = Rig::new();
        let sides = [rig.start(0, RIG, &[]), rig.start(1, here, more)];
        for side in finish(sides) {
            let side = side.expect(3);
            assert!(side.err.contains(words), "no {words:?} in {}", side.err);
        }
    }
}

#[test]
fn a_link_that_is_slower_than_the_budget_is_refused_on_both_sides() {
    let _turn = alone();
    let rig = Rig::new();
    // No network answers within a microsecond.
    let sides = [rig.start(0, RIG, &["--budget-us", "1"]), rig.start(1, REST, &[])];
    for side in finish(sides) {
        let side = side.expect(3);
        assert!(side.err.contains("the budget is 1 µs"), "{}", side.err);
    }
}
