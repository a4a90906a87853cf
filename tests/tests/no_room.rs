//! Guards what a user is told when a disk or /dev/shm is full: the recorder names the disk at once and says what is left, nobody
//! else is blamed, and too small a /dev/shm is noticed before anything starts. Each run has a mount namespace of its own.

use anhyst_tests::{Finished, LIMIT, anhyst, repository};
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs milling.ron with a file system of `size` mounted at `mounted`; none where the system permits no mounts.
fn run_with(mounted: &Path, size: &str, out: &Path) -> Option<Finished> {
    let unshared = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-c", script]);
        command.current_dir(repository()).stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    };
    let mount = format!("mount -t tmpfs -o size={size} none {}", mounted.display());
    if !unshared(&mount).status().is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: this system permits no mounts");
        return None;
    }
    let run = format!(
        "{mount} && exec {} run scenarios/milling.ron --no-recording --set duration_s=0.1 --set expect.settling_s=0.05 --out {}",
        anhyst().display(),
        out.display()
    );
    let child = unshared(&run).spawn().unwrap();
    Some(Finished::wait(child, LIMIT))
}

#[test]
fn a_full_disk_is_named_by_the_recorder_with_what_is_left() {
    let root = tempfile::tempdir().unwrap();
    let Some(finished) = run_with(root.path(), "3m", &root.path().join("run")) else {
        return;
    };
    let finished = finished.expect(3);
    let sentence = finished.err.lines().next().unwrap();
    assert!(sentence.starts_with("recorder failed at tick "), "{sentence}");
    assert!(sentence.contains("MiB are left on its disk"), "{sentence}");
    assert!(!finished.err.contains("plant-sim"), "{}", finished.err);
}

/// Nothing was started, but the input is not to blame.
#[test]
fn a_disk_that_is_full_before_the_start_is_no_bad_input() {
    let root = tempfile::tempdir().unwrap();
    let Some(finished) = run_with(root.path(), "4k", &root.path().join("run")) else {
        return;
    };
    let finished = finished.expect(3);
    assert!(
        finished.err.contains("0.000 MiB are left on its disk"),
        "{}",
        finished.err
    );
}

#[test]
fn too_little_shared_memory_is_said_before_the_start() {
    let root = tempfile::tempdir().unwrap();
    let shared_memory = Path::new("/dev/shm");
    let Some(finished) = run_with(shared_memory, "1m", &root.path().join("small")) else {
        return;
    };
    let finished = finished.expect(3);
    assert!(finished.err.contains("/dev/shm has 1.000 MiB left"), "{}", finished.err);
    assert!(!finished.err.contains("recorded"), "{}", finished.err);
    assert!(!root.path().join("small").exists());
    // What is said to be needed is enough.
    let needed = anhyst_launch::resources::SHARED_MEMORY_BYTES.to_string();
    let enough = run_with(shared_memory, &needed, &root.path().join("enough")).unwrap();
    assert!(matches!(enough.code, Some(0 | 1)), "{}", enough.err);
}
