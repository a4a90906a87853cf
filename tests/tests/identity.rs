//! Guards the promise that a run's bits do not depend on where and how it runs: processes, placement, start order, build.

use anhyst_tests::{Finished, LIMIT, assert_same, first_difference, folders, repository};
use std::path::Path;
use std::process::Command;

const SHORT: [&str; 4] = ["--set", "duration_s=0.2", "--set", "expect.settling_s=0.1"];

/// Runs the milling scenario, shortened; whether its tolerance holds so early does not matter here.
fn run(out: &Path, more: &[&str]) -> String {
    let out_text = out.to_string_lossy();
    let arguments = [
        &["run", "scenarios/milling.ron", "--no-recording", "--out", &out_text],
        &SHORT[..],
        more,
    ]
    .concat();
    let finished = Finished::run(&arguments, LIMIT);
    assert!(
        matches!(finished.code, Some(0 | 1)),
        "{}\n{}",
        finished.out,
        finished.err
    );
    digest(out)
}

fn digest(out: &Path) -> String {
    assert_eq!(anhyst_tests::summary(out)["ticks"], 4000);
    anhyst_tests::digest(out)
}

#[test]
fn processes_placement_and_start_order_change_no_bit() {
    let (_root, [embedded, separate, reversed, grouped]) = folders();
    let expected = run(&embedded, &["--embedded"]);
    let groups = r#"placement=Groups([[controller, inverse, guard], [plant, amplifier]])"#;
    for (folder, more) in [
        (&separate, &[][..]),
        (&reversed, &["--reverse-start"][..]),
        (&grouped, &["--set", groups][..]),
    ] {
        let digest = run(folder, more);
        assert_same(&embedded, folder);
        assert_eq!(digest, expected);
    }
}

#[test]
fn another_seed_changes_the_bits() {
    let (_root, [one, other]) = folders();
    assert_ne!(
        run(&one, &["--embedded"]),
        run(&other, &["--embedded", "--set", "seed=2"])
    );
    assert_eq!(
        first_difference(&one, &other).map(|(node, _)| node.name()),
        Some("plant-sim")
    );
}

/// The negative control: one flipped bit in one token is found, with its node and tick.
#[test]
fn one_ulp_in_one_node_is_found_and_named() {
    let (_root, [embedded, separate]) = folders();
    let expected = run(&embedded, &["--embedded"]);
    let flip = r#"faults=[Link(from_tick: 1234, channel: field_command, field: "field_a_per_m", kind: BitFlip(0))]"#;
    let digest = run(&separate, &["--set", flip]);
    assert_ne!(digest, expected);
    let failure = std::panic::catch_unwind(|| assert_same(&embedded, &separate)).unwrap_err();
    let sentence = failure.downcast_ref::<String>().unwrap();
    assert!(sentence.starts_with("inverse differs from tick 1234 on"), "{sentence}");
}

/// Debug and release builds differ in inlining and constant folding; tokens must not. The debug build leaves the recorder
/// out, which no token depends on.
#[test]
fn debug_and_release_builds_agree() {
    let (_root, [release, debug]) = folders();
    let build = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "-p", "anhyst", "--no-default-features"])
        .current_dir(repository())
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .status()
        .unwrap();
    assert!(build.success());
    let expected = run(&release, &["--embedded"]);
    let executable = anhyst_tests::anhyst().ancestors().nth(2).unwrap().join("debug/anhyst");
    let status = Command::new(executable)
        .args([
            "run",
            "scenarios/milling.ron",
            "--no-recording",
            "--embedded",
            "--json",
            "--out",
        ])
        .arg(&debug)
        .args(SHORT)
        .current_dir(repository())
        .stdout(std::process::Stdio::null())
        .status()
        .unwrap();
    assert!(matches!(status.code(), Some(0 | 1)), "{status}");
    assert_same(&release, &debug);
    assert_eq!(digest(&debug), expected);
}
