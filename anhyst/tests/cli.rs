//! Guards the command line itself. That these tests exist also makes cargo build the executable that the tests across
//! processes (`tests/`) start.

use std::process::{Command, Output};

fn anhyst(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_anhyst"))
        .args(arguments)
        .output()
        .expect("the executable starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn help_names_every_process() {
    let output = anhyst(&["--help"]);
    assert!(output.status.success());
    let help = text(&output.stdout);
    // The first word of an indented line is a command's name; "run" alone is in half of all sentences.
    let listed: Vec<&str> = help
        .lines()
        .filter(|line| line.starts_with("  "))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    for name in [
        "run",
        "check",
        "graph",
        "compare",
        "replay",
        "view",
        "fit",
        "estimate",
        "paper",
        "laws",
        "doctor",
        "bridge",
        "completions",
    ] {
        assert!(listed.contains(&name), "no {name} in\n{help}");
    }
    for node in anhyst_ipc::NodeId::LOOP_ORDER {
        assert!(listed.contains(&node.name()), "no {node} in\n{help}");
    }
}

#[test]
fn completions_are_made_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = anhyst(&["completions", shell]);
        assert!(
            output.status.success() && text(&output.stdout).contains("plant-sim"),
            "{shell}"
        );
    }
}

#[test]
fn bad_arguments_end_with_status_2() {
    for arguments in [
        &["run"][..],
        &["run", "x.ron", "--set", "no_equals_sign"],
        &["no-such-command"],
    ] {
        assert_eq!(anhyst(arguments).status.code(), Some(2), "{arguments:?}");
    }
}
