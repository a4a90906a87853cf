//! Guards the command line itself. That these tests exist also makes cargo build the executable that the tests across
//! processes (`tests/`) start.

use anhyst::cli::{GROUPS, command};
use anhyst::spelling;
use anhyst_model::EffectKind;
use std::collections::BTreeSet;
use std::path::Path;
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

/// Commands and options that this build may lack.
const BY_FEATURE: [&str; 9] = [
    "view",
    "export",
    "bridge",
    "--live",
    "--here",
    "--listen",
    "--connect",
    "--budget-us",
    "--run-name",
];

/// Guards the help: each command stands below one heading, and none is forgotten.
#[test]
fn the_help_groups_every_command() {
    let output = anhyst(&["--help"]);
    assert!(output.status.success());
    let help = text(&output.stdout);
    let mut listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
    for (heading, names) in GROUPS {
        let below = help.split_once(&format!("\n{heading}:\n")).expect(heading).1;
        let below = below.split("\n\n").next().unwrap();
        for name in names {
            let shown = below
                .lines()
                .any(|line| line.trim_start().starts_with(&format!("{name} ")));
            assert!(
                shown || BY_FEATURE.contains(name),
                "no {name} below {heading} in\n{help}"
            );
        }
    }
    listed.sort_unstable();
    let known = command();
    for own in known
        .get_subcommands()
        .filter(|own| !own.is_hide_set() && own.get_name() != "help")
    {
        assert!(
            listed.binary_search(&own.get_name()).is_ok(),
            "{} is in no group",
            own.get_name()
        );
    }
    for window in listed.windows(2) {
        assert_ne!(window[0], window[1], "in two groups");
    }
}

/// Every command with its long options, those of `study` as `study blind`.
fn options() -> Vec<(String, BTreeSet<String>)> {
    let mut found = Vec::new();
    let own = |command: &clap::Command| {
        let shown = command.get_arguments().filter(|argument| !argument.is_hide_set());
        let long = shown.filter_map(|argument| argument.get_long());
        let named = long.filter(|long| !["help", "version"].contains(long));
        named.map(|long| format!("--{long}")).collect()
    };
    for outer in command().get_subcommands() {
        if outer.has_subcommands() {
            let inner = outer.get_subcommands();
            found.extend(inner.map(|inner| (format!("{} {}", outer.get_name(), inner.get_name()), own(inner))));
        } else {
            found.push((outer.get_name().to_owned(), own(outer)));
        }
    }
    found
}

/// Guards docs/running.md: its table of commands has each of them with each of its options, below the help's headings, and no others.
#[test]
fn the_documented_commands_are_those_there_are() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/running.md");
    let running = std::fs::read_to_string(path).unwrap();
    let section = running
        .split_once("\n## Commands and options\n")
        .expect("the section")
        .1;
    let section = section.split("\n## ").next().unwrap();
    let mut documented: Vec<(String, BTreeSet<String>)> = Vec::new();
    let mut headings = Vec::new();
    for line in section.lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            headings.push(heading.to_owned());
        } else if let Some(row) = line.strip_prefix("| `") {
            let (name, rest) = row.split_once('`').unwrap();
            let options = rest
                .split('`')
                .skip(1)
                .step_by(2)
                .filter_map(|code| code.split([' ', '=']).next());
            let options = options
                .filter(|word| word.starts_with("--"))
                .map(str::to_owned)
                .collect();
            documented.push((name.to_owned(), options));
        }
    }
    assert_eq!(headings, GROUPS.map(|(heading, _)| heading));
    let known = options();
    for (name, own) in &known {
        let told = documented.iter().find(|(documented, _)| documented == name);
        let (_, told) = told.unwrap_or_else(|| panic!("{name} is not documented"));
        let missing: Vec<_> = own.difference(told).collect();
        assert!(missing.is_empty(), "{name}: {missing:?} are not documented");
        let gone = told
            .difference(own)
            .find(|option| !BY_FEATURE.contains(&option.as_str()));
        assert_eq!(gone, None, "{name}: documented, but not there");
    }
    for (name, _) in &documented {
        let there = known.iter().any(|(known, _)| known == name);
        assert!(
            there || BY_FEATURE.contains(&name.as_str()),
            "{name} is documented, but not there"
        );
    }
}

/// Guards who knew the program before: each old spelling is refused with the one that there is now, and that one is known.
#[test]
fn old_spellings_are_refused_with_the_new_ones() {
    let refused = |arguments: &[&str]| {
        let output = anhyst(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert_eq!(text(&output.stdout), "", "{arguments:?}");
        let said = text(&output.stderr);
        assert_eq!(said.lines().count(), 1, "{said}");
        said
    };
    let known = options();
    for (old, new) in spelling::COMMANDS {
        let said = refused(&[old, "scenarios/milling.ron", "--out", "x"]);
        assert!(
            said.contains(&format!("`anhyst {old}` is now `anhyst {new}`")),
            "{said}"
        );
        let first = new.split(' ').next().unwrap();
        assert!(command().find_subcommand(first).is_some(), "{new}");
    }
    for (command, old, new) in spelling::OPTIONS {
        let words: Vec<&str> = command.split(' ').chain([old, "1"]).collect();
        let said = refused(&words);
        assert!(
            said.contains(&format!("{old} of `anhyst {command}` is now {new}")),
            "{said}"
        );
        let (_, own) = known.iter().find(|(name, _)| name == command).unwrap();
        assert!(own.contains(new) && !own.contains(old), "{command}: {own:?}");
    }
    assert!(refused(&["study", "--singles", "3"]).contains("`anhyst study` is now `anhyst study blind`"));
    let bare = anhyst(&["study"]);
    assert_eq!(bare.status.code(), Some(2));
    for study in ["  blind", "  laws", "  paper"] {
        assert!(text(&bare.stderr).contains(study), "{}", text(&bare.stderr));
    }
}

/// Guards what is not built in: it is not offered, and who asks for it is told what it needs.
#[test]
#[cfg(not(feature = "bridge"))]
fn what_is_not_built_in_is_not_offered() {
    for arguments in [&["bridge", "x.ron"][..], &["run", "x.ron", "--here", "plant-sim"]] {
        let output = anhyst(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let said = text(&output.stderr);
        assert!(said.contains("cargo feature `bridge`"), "{said}");
    }
    assert!(!text(&anhyst(&["run", "--help"]).stdout).contains("--here"));
}

/// Guards names: another one is refused with those that there are, and the one that is likely meant.
#[test]
fn a_wrong_name_is_answered_with_the_choices() {
    for (arguments, choices, nearest) in [
        (
            &["node", "estimater", "x.ron"][..],
            "plant-sim, estimator, controller",
            "'estimator'",
        ),
        (
            &["replay", "x", "--node", "gard"],
            "plant-sim, estimator, controller",
            "'guard'",
        ),
        (
            &["fit", "x.csv", "--curve", "langevine"],
            "both, langevin, ising",
            "'langevin'",
        ),
        (
            &["study", "laws", "--law", "foldet"],
            "folded, gauss-newton",
            "'folded'",
        ),
        (
            &["study", "laws", "--excitation", "miling"],
            "ramp, sine, milling",
            "'milling'",
        ),
    ] {
        let output = anhyst(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let said = text(&output.stderr);
        assert!(said.contains(choices) && said.contains(nearest), "{said}");
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

    // `| head` reads a part of it.
    let mut unread = Command::new(env!("CARGO_BIN_EXE_anhyst"))
        .args(["completions", "bash"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    drop(unread.stdout.take());
    assert!(unread.wait().unwrap().success());
}

#[test]
fn bad_arguments_end_with_status_2() {
    for arguments in [
        &["run"][..],
        &["run", "x.ron", "--set", "no_equals_sign"],
        &["run", "x.ron", "y.ron", "--external", "amplifier"],
        &["fit"],
        &["fit", "x.csv", "--data", "y.csv"],
        &["estimate", "--model", "m.ron", "--data", "d.csv", "--settle-s", "-1"],
        &["doctor", "--set", "seed=1"],
        &["doctor", "--lockstep", "x.ron", "--duration-s", "0"],
        &["no-such-command"],
    ] {
        assert_eq!(anhyst(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

/// Guards the scenario that is read: no result is written over it, whoever writes one.
#[test]
fn no_result_is_written_over_the_scenario_that_is_read() {
    let root = tempfile::tempdir().unwrap();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let folder = root.path().join("own");
    let scenario = folder.join("scenario.ron");
    for own in [&folder, &root.path().join("materials")] {
        std::fs::create_dir(own).unwrap();
    }
    let material = "materials/piezo_stage_preisach.ron";
    std::fs::copy(shipped.join(material), root.path().join(material)).unwrap();
    std::fs::copy(shipped.join("piezo/open_loop.ron"), &scenario).unwrap();
    let before = std::fs::read(&scenario).unwrap();
    let (read, out) = (scenario.to_string_lossy(), folder.to_string_lossy());
    for command in [
        &["run"][..],
        &["commission"],
        &["bench"],
        &["doctor", "--lockstep"],
        &["doctor", "--realtime"],
        &["verify-amplifier"],
    ] {
        let refused = anhyst(&[command, &[&read, "--out", &out]].concat());
        assert_eq!(refused.status.code(), Some(2), "{command:?}");
        let said = text(&refused.stderr);
        assert!(said.contains("would be written over it"), "{command:?}: {said}");
        assert_eq!(std::fs::read(&scenario).unwrap(), before, "{command:?}");
    }
}

/// Guards amounts below zero, which clap takes for options where they are no bare numbers.
#[test]
fn an_amount_below_zero_is_told_with_what_is_wanted() {
    let refused = anhyst(&["new", "negative", "--no-questions", "--stroke", "-20um"]);
    assert_eq!(refused.status.code(), Some(2));
    let said = text(&refused.stderr);
    assert!(
        said.contains("--stroke -20um: give a positive number with its unit, m"),
        "{said}"
    );
}

/// Guards a law that was fitted with a lag beside it: its model has the lag, a scenario that takes the law says its own, and no constant of the
/// domain wall law is estimated of it.
#[test]
fn a_fitted_law_is_the_whole_of_what_was_fitted() {
    let folder = tempfile::tempdir().unwrap();
    let law = folder.path().join("law.ron");
    let words = "(input: Voltage, output: Displacement, start: Rest, input_extent: (0.0, 100.0), reaction: (delay_s: 1e-3, lag_s: 2e-3), \
         model: (offset: 0.0, slope: 3e-7, laws: [Plays(groups: [(warp: Straight, radii: [10.0], weights: [3e-7])])]))";
    std::fs::write(&law, words).unwrap();
    let model = anhyst_scenario::load_model(&law).unwrap();
    let values: Vec<(EffectKind, f64)> = model.effects.iter().map(|own| (own.kind(), own.values()[0])).collect();
    assert_eq!(
        values,
        [(EffectKind::EddyCurrent, 2e-3), (EffectKind::SensorDelay, 1e-3)]
    );
    let told = format!("material=File({:?})", law.display().to_string());
    let scenario = anhyst_scenario::load(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/piezo/sine.ron"),
        &[told.parse().unwrap()],
    );
    assert!(scenario.unwrap().effects.is_empty());
    let path = law.display().to_string();
    let refused = anhyst(&["estimate", "--model", &path, "--data", "nothing.csv"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("a law of its own, which has no such constant"));
}

/// Guards a stage that only pushes: a motion to where no input of its law takes it is refused, whatever the law would do beyond.
#[test]
fn a_motion_that_a_law_does_not_reach_is_refused() {
    let stage = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/piezo/sine.ron");
    let refused = anhyst(&["check", stage, "--set", "controller.trajectory.mean_m=-25e-6"]);
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
    let said = text(&refused.stderr);
    assert!(
        said.contains("fitted to, 0 to 100 V, the actuator gives 0.0000e0 to 6.0611e-5 m"),
        "{said}"
    );
}
