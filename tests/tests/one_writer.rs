//! Guards results, and the run itself: two runs into one folder at the same time would overwrite each other's, and of two under
//! one prefix the second would remove the shared memory of the first.

use anhyst_tests::{Finished, LIMIT, SharedMemory, files_with, start};
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

/// Killed when dropped, so that a failing test leaves nothing running.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn embedded<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let base = [
        "run",
        "scenarios/milling.ron",
        "--no-recording",
        "--embedded",
        "--out",
        out,
    ];
    [&base[..], more].concat()
}

/// The second is refused with one sentence and changes nothing; a run that was killed keeps nobody out.
#[test]
fn a_folder_takes_one_run_at_a_time() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("run");
    let out = folder.to_string_lossy().into_owned();
    // Longer than this test lives.
    let mut first = Ended(start(&embedded(&out, &["--set", "duration_s=2000"])));
    let scenario = folder.join("scenario.ron");
    let begin = Instant::now();
    while !std::fs::read_to_string(&scenario).is_ok_and(|text| text.contains("duration_s: 2000")) {
        assert!(begin.elapsed() < LIMIT, "the first run does not begin");
        std::thread::sleep(Duration::from_millis(5));
    }
    let before = listing(&folder);
    let short = ["--set", "duration_s=0.1", "--set", "expect.settling_s=0.05"];
    let second = Finished::run(&embedded(&out, &short), LIMIT).expect(2);
    let sentence = format!("another run writes to {out}: wait for its end, or give this one a folder of its own");
    assert!(second.err.contains(&sentence), "{}", second.err);
    let verify = [
        "verify-amplifier",
        "scenarios/amplifier.ron",
        "--out",
        &out,
        "--command",
        "exit 1",
    ];
    let third = Finished::run(&verify, LIMIT).expect(2);
    assert!(third.err.contains(&sentence), "{}", third.err);
    assert_eq!(listing(&folder), before);
    assert!(first.0.try_wait().unwrap().is_none(), "the first run goes on");
    drop(first);
    let fourth = Finished::run(&embedded(&out, &short), LIMIT);
    assert!(matches!(fourth.code, Some(0 | 1)), "{}", fourth.err);
}

#[test]
fn a_prefix_takes_one_run_at_a_time() {
    let memory = SharedMemory::unique();
    let folders = tempfile::tempdir().unwrap();
    let place = memory.root.to_string_lossy().into_owned();
    let run = |name: &str, duration: &str| {
        let out = folders.path().join(name).to_string_lossy().into_owned();
        let base = ["run", "scenarios/milling.ron", "--no-recording", "--set", duration];
        let names = ["--service-prefix", &memory.prefix, "--root", &place, "--out", &out];
        start(&[&base[..], &names].concat())
    };
    let mut first = run("first", "duration_s=2000");
    let begin = Instant::now();
    while !folders.path().join("first/processes/recorder.log").exists() {
        assert!(begin.elapsed() < LIMIT, "the first run does not begin");
        std::thread::sleep(Duration::from_millis(5));
    }
    let second = Finished::wait(run("second", "duration_s=1"), LIMIT).expect(2);
    let sentence = format!("--service-prefix {} is another run's", memory.prefix);
    assert!(second.err.contains(&sentence), "{}", second.err);
    assert!(!files_with(&memory.prefix).is_empty());
    assert!(first.try_wait().unwrap().is_none(), "the first run goes on");
    kill_process(Pid::from_child(&first), Signal::TERM).unwrap();
    let finished = Finished::wait(first, LIMIT).expect(3);
    assert!(finished.err.contains("stopped on request"), "{}", finished.err);
    assert_eq!(memory.files(), Vec::<String>::new());
}

/// Two comparisons at once would remove each other's results; what else lies in the folder is kept.
#[test]
fn a_comparison_has_its_folder_for_itself() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().to_string_lossy();
    let earlier = root.path().join("3-earlier");
    std::fs::create_dir(&earlier).unwrap();
    std::fs::write(root.path().join("notes"), "kept").unwrap();
    let short = ["--set", "duration_s=0.1", "--set", "expect.settling_s=0.05"];
    let twice = ["run", "scenarios/milling.ron", "scenarios/milling.ron", "--out", &out];
    let compare = [&twice[..], &short[..]].concat();
    let other = std::fs::File::open(root.path()).unwrap();
    other.try_lock().unwrap();
    let refused = Finished::run(&compare, LIMIT).expect(2);
    assert!(refused.err.contains("another run writes to"), "{}", refused.err);
    assert!(earlier.exists());
    drop(other);
    Finished::run(&compare, LIMIT).expect(0);
    assert!(!earlier.exists() && root.path().join("1-milling/summary.json").exists());
    let files = listing(root.path());
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["compare.html", "notes"]);
    assert_eq!(files[1].1, "kept");
}

/// Files of a folder with what is in them, but for the logs that grow.
fn listing(folder: &Path) -> Vec<(String, String)> {
    let entries = std::fs::read_dir(folder).unwrap().map(Result::unwrap);
    let mut files: Vec<_> = entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| {
            (
                entry.file_name().to_string_lossy().into_owned(),
                std::fs::read_to_string(entry.path()).unwrap(),
            )
        })
        .collect();
    files.sort();
    files
}
