//! Guards the sentences that a user gets for a bad scenario: place, value, limit; exit status 2, nothing started.

use anhyst_tests::{Finished, LIMIT, folders, repository};
use std::path::Path;

/// miette may break a long sentence into lines: reads it as one.
fn one_line(finished: Finished) -> Finished {
    let words = finished.err.split_whitespace().filter(|word| *word != "│");
    let err = words.collect::<Vec<_>>().join(" ");
    Finished { err, ..finished }
}

fn check(text: &str, folder: &Path) -> Finished {
    let path = folder.join("bad.ron");
    std::fs::write(&path, text).unwrap();
    let finished = Finished::run(&["check", &path.to_string_lossy()], LIMIT).expect(2);
    assert_eq!(finished.out, "");
    one_line(finished)
}

#[test]
fn bad_scenarios_are_refused_with_place_value_and_limit() {
    let root = tempfile::tempdir().unwrap();
    let good = std::fs::read_to_string(repository().join("scenarios/milling.ron")).unwrap();
    let materials = root.path().join("materials");
    std::fs::create_dir(&materials).unwrap();
    let material = "materials/terfenol_nealis_smith.ron";
    std::fs::copy(
        repository().join("scenarios").join(material),
        root.path().join(material),
    )
    .unwrap();
    let line_of = |needle: &str| good.lines().position(|line| line.contains(needle)).unwrap() + 1;
    let cases: [(&str, &str, &str, &[&str]); 19] = [
        (
            "from_a_per_m: 6400.0",
            "from_a_per_m: 6100.0",
            "shape: Ramp",
            &["a = 6100 A/m is outside the estimator's range [6300, 7300] A/m"],
        ),
        (
            "settling_s: 0.5",
            "settling_s: 0.5, error_rms_m: NaN",
            "settling_s",
            &["error_rms_m", "NaN m must be finite"],
        ),
        (
            "sensors: (",
            "cut: Custom(spindle_rpm: 1e6, teeth: 2, entry_angle_deg: 0, exit_angle_deg: 180, cutting_coefficient_n_per_m2: 7e8, axial_depth_m: 1e-4, feed_per_tooth_m: 1e-4, heat_w: 0), sensors: (",
            "sensors: (",
            &["ticks, outside [8, 65536]"],
        ),
        (
            "lobes: [(1, 40e-6, 0.0)",
            "lobes: [(1, 4e-3, 0.0)",
            "trajectory:",
            &["the rod needs a quasi-static displacement of"],
        ),
        // A loop that stands still at the mean would hold it.
        (
            "lobes: [(1, 40e-6, 0.0), (3, 12e-6, 0.0)]",
            "mean_m: 30e-6, lobes: [(1, 15e-9, 0.0)]",
            "tolerance_m",
            &["0.00000002 m is more than the profile's own stroke, ±1.500e-8 m"],
        ),
        (
            "lobes: [(1, 40e-6, 0.0), (3, 12e-6, 0.0)]",
            "lobes: [(1, 40e-6, 0.0)], speed_changes: [(at_s: 5, rpm: 3600, over_s: 0.1)]",
            "trajectory:",
            &["speed_changes.0.at_s: 5 s is not before the run's end, 4.5 s"],
        ),
        (
            "Profile(spindle_rpm: 3000.0, lobes: [(1, 40e-6, 0.0), (3, 12e-6, 0.0)])",
            "Sweep(amplitude_m: 1e-6, from_hz: 10, to_hz: 6000, over_s: 2)",
            "trajectory:",
            &["trajectory.to_hz: frequency 6000 Hz must be above 0 Hz and at most 5000 Hz"],
        ),
        (
            "settling_s: 0.5",
            "settling_s: 0.5, overshoot: 0.1",
            "settling_s",
            &["expect.overshoot: this is for the trajectories Steps"],
        ),
        ("seed: 1,", "sede: 1,", "seed: 1,", &["sede", "is `seed` meant?"]),
        (
            "seed: 1,",
            "seed: \"one\",",
            "seed: 1,",
            &["seed: Expected integer: what is wanted is a whole number"],
        ),
        (
            "settling_s: 0.5",
            "settling_s: \"soon\"",
            "settling_s",
            &["expect.settling_s: Expected float: what is wanted is a number in s"],
        ),
        (
            "tick_s: 5e-5",
            "tick_s: NaN",
            "tick_s: 5e-5",
            &["NaN s is outside [0.000001, 1] s"],
        ),
        (
            "tick_s: 5e-5",
            "tick_s: -5e-5",
            "tick_s: 5e-5",
            &["-0.00005 s is outside"],
        ),
        (
            "start_a_per_m: 6800.0",
            "start_a_per_m: 6200.0",
            "start_a_per_m",
            &["6200 A/m is outside the range [6300, 7300] A/m"],
        ),
        (
            "terfenol_nealis_smith.ron",
            "no_such.ron",
            "no_such",
            &["no_such.ron does not exist"],
        ),
        (
            "materials/terfenol_nealis_smith.ron",
            "materials",
            "materials/",
            &["materials is a folder"],
        ),
        (
            "(1, 40e-6, 0.0)",
            "(1, 400e-6, 0.0)",
            "trajectory:",
            &["magnetization", "A/m"],
        ),
        ("members: 32", "members: 1", "members", &["2 to 512"]),
        (
            "displacement_noise_m: 10e-9",
            "displacement_noise_m: -10e-9",
            "displacement_noise_m",
            &["-"],
        ),
    ];
    for (from, to, at, says) in cases {
        assert!(good.contains(from), "{from}");
        let refused = check(&good.replacen(from, to, 1), root.path());
        let needle = if at.starts_with("no_such") { from } else { at };
        let place = format!("bad.ron:{}:", line_of(needle));
        assert!(refused.err.contains(&place), "no {place} in: {}", refused.err);
        for word in says {
            assert!(refused.err.contains(word), "no \"{word}\" in: {}", refused.err);
        }
    }
}

/// Guards the check of materials: a coupling that folds the anhysteretic curve is refused where it stands, with the product.
#[test]
fn an_unphysical_material_is_refused_in_its_own_file() {
    let root = tempfile::tempdir().unwrap();
    let folder = repository().join("scenarios");
    std::fs::create_dir(root.path().join("materials")).unwrap();
    let material = "materials/terfenol_nealis_smith.ron";
    let text = std::fs::read_to_string(folder.join(material)).unwrap();
    assert!(text.contains("coupling: -0.01"));
    std::fs::write(
        root.path().join(material),
        text.replace("coupling: -0.01", "coupling: 0.05"),
    )
    .unwrap();
    let scenario = std::fs::read_to_string(folder.join("milling.ron")).unwrap();
    let refused = check(&scenario, root.path());
    let line = text.lines().position(|line| line.contains("hysteresis: (")).unwrap() + 1;
    assert!(
        refused.err.contains(&format!("terfenol_nealis_smith.ron:{line}:")),
        "{}",
        refused.err
    );
    assert!(refused.err.contains("must stay below 1"), "{}", refused.err);
}

#[test]
fn missing_files_and_bad_settings_are_refused() {
    let refused = Finished::run(&["run", "scenarios/no_such.ron"], LIMIT).expect(2);
    assert!(
        refused.err.contains("scenarios/no_such.ron cannot be read"),
        "{}",
        refused.err
    );
    // What is in the program is named to who has no clone.
    for command in ["run", "check", "graph"] {
        let said = |file| one_line(Finished::run(&[command, file], LIMIT).expect(2)).err;
        let refused = said("elsewhere/milling.ron");
        assert!(refused.contains("in the program is built-in/milling.ron"), "{refused}");
        let refused = said("elsewhere/q.ron");
        assert!(!refused.contains("in the program"), "{refused}");
        let refused = said("built-in/q.ron");
        assert!(
            refused.contains("in the program are built-in/amplifier.ron, "),
            "{refused}"
        );
    }
    let refused = Finished::run(&["check", "scenarios/milling.ron", "--set", "plant.no.such=1"], LIMIT).expect(2);
    assert!(refused.err.contains("`no`"), "{}", refused.err);
}

/// Guards old files: a flipped bit has another spelling, which is told, and `None` is what most of them say.
#[test]
fn an_old_flip_is_told_its_new_spelling() {
    let check = |fault| Finished::run(&["check", "scenarios/milling.ron", "--set", fault], LIMIT);
    let refused = check("fault=(node: inverse, tick: 100)").expect(2);
    let write = r#"faults: [Link(from_tick: 100, channel: field_command, field: "field_a_per_m", kind: BitFlip(0))]"#;
    assert!(refused.err.contains(write), "{}", refused.err);
    check("fault=None").expect(0);
}

/// Guards injected faults that would silently do nothing: of what an external process sends or is, after the run's end, of a
/// process in an embedded run; and amounts that are none.
#[test]
fn faults_that_would_do_nothing_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run").to_string_lossy().into_owned();
    let external = ["--external-command", "amplifier=true"];
    let measurement = |begin: &str, kind: &str| format!("Link({begin}, channel: measurement, kind: {kind})");
    let coil_field = "Link(from_tick: 5, channel: coil_field, kind: Nan)";
    let kill = |node: &str| format!("Process(from_tick: 5, node: {node}, kind: Kill)");
    let cases: [(&[&str], String, &[&str]); 15] = [
        (
            &external,
            coil_field.into(),
            &[
                "faults.0.channel: coil_field is sent by amplifier, which is external: an external process does not read",
                "inject on a link that it reads: safe_field",
            ],
        ),
        (
            &["--set", "external=[amplifier]"],
            coil_field.into(),
            &["faults.0.channel", "safe_field"],
        ),
        // What shares a process with an external node is external, too.
        (
            &[
                "--set",
                "placement=Groups([[plant, amplifier]])",
                "--set",
                "external=[amplifier]",
            ],
            measurement("from_tick: 5", "Nan"),
            &["faults.0.channel: measurement is sent by plant-sim"],
        ),
        (
            &external,
            kill("amplifier"),
            &["faults.0.node: amplifier is external", "safe_field"],
        ),
        (
            &[],
            measurement("at_s: 1.0", "Nan"),
            &["faults.0.at_s: 1 s is not before", "duration_s = 1 s"],
        ),
        (
            &[],
            measurement("at_s: 2", "Nan"),
            &["faults.0.at_s: 2 s is not before"],
        ),
        (
            &[],
            measurement("from_tick: 20000", "Nan"),
            &["faults.0.from_tick: tick 20000 is not before the end of the run, 20000 ticks"],
        ),
        (
            &[],
            kill("guard").replace('5', "20000"),
            &["faults.0.from_tick: tick 20000"],
        ),
        (
            &["--embedded"],
            kill("guard"),
            &["faults.0.node", "all nodes share one process"],
        ),
        (
            &[],
            measurement("at_s: 0.5", "GainStep(1e400)"),
            &["faults.0.kind: inf is no finite number"],
        ),
        (
            &[],
            measurement("at_s: 0.5", "Saturate(-1)"),
            &["faults.0.kind: -1 must be at least 0"],
        ),
        (
            &[],
            measurement("at_s: 0.5", "Noise(-1)"),
            &["faults.0.kind: -1 must be at least 0"],
        ),
        (
            &[],
            measurement("at_s: 0.5", "ClockJump(0)"),
            &["faults.0.kind: a jump by 0 ticks does nothing"],
        ),
        (
            &[],
            measurement("at_s: 0.5", "GainStep(1)"),
            &["faults.0.kind: a gain of 1 does nothing"],
        ),
        (
            &[],
            measurement("at_s: -1", "Nan"),
            &["-1 s is outside [0, 1000000000] s"],
        ),
    ];
    for (more, fault, says) in cases {
        let faults = format!("faults=[{fault}]");
        let base = ["run", "scenarios/milling.ron", "--no-recording", "--out", &out];
        let base = [&base[..], &["--set", "duration_s=1", "--set", &faults], more].concat();
        let refused = one_line(Finished::run(&base, LIMIT).expect(2));
        assert!(
            refused.err.contains("milling.ron (as changed by --set):"),
            "{}",
            refused.err
        );
        for sentence in says {
            assert!(refused.err.contains(sentence), "no \"{sentence}\" in: {}", refused.err);
        }
    }
    assert!(!Path::new(&out).exists(), "something was begun");
}

/// Guards the options of `run`: what cannot be meant is told before anything begins.
#[test]
fn bad_options_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run").to_string_lossy().into_owned();
    let accented = root.path().join("wärme").to_string_lossy().into_owned();
    let file = root.path().join("file").to_string_lossy().into_owned();
    std::fs::write(&file, "").unwrap();
    let cases: [(&[&str], &str); 7] = [
        (&["--set", "=3"], "=3 has no name before '='"),
        (
            &["--set", "controller..kp=3"],
            "has no name before '=', or an empty one",
        ),
        (&["--external-command", "amplifier="], "has no command behind '='"),
        (
            &["--external-command", "amplifier=a", "--external-command", "amplifier=b"],
            "amplifier has two --external-command",
        ),
        (&["--root", &accented], "must be written in ASCII"),
        (&["--root", &file], "cannot be used: "),
        (
            &["--set", "clock=Realtime()", "--set", "tick_s=1e-6"],
            "tick_s: 0.000001 s in real time is outside [0.00001, 1]",
        ),
    ];
    for (more, sentence) in cases {
        let base = ["run", "scenarios/milling.ron", "--no-recording", "--out", &out];
        let refused = one_line(Finished::run(&[&base[..], more].concat(), LIMIT).expect(2));
        assert!(refused.err.contains(sentence), "no \"{sentence}\" in: {}", refused.err);
        assert!(!Path::new(&out).exists(), "{more:?}: something was begun");
    }
}

/// Guards processes by hand: names that `run` refuses are refused by the same sentence, and nothing is begun.
#[test]
fn a_node_refuses_the_names_that_a_run_refuses() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run").to_string_lossy().into_owned();
    let long = "x".repeat(80) + "_";
    for names in [
        ["--service-prefix", "a b/c"],
        ["--service-prefix", ""],
        ["--service-prefix", &long],
        ["--root", "README.md"],
    ] {
        let refused = |words: &[&str]| {
            let words = [words, &["scenarios/milling.ron", "--out", &out], &names].concat();
            Finished::run(&words, LIMIT).expect(2).err
        };
        let (run, node) = (refused(&["run"]), refused(&["node", "estimator"]));
        assert!(run.contains(names[0]), "{run}");
        // Of the length each tells its own.
        assert!(
            run == node || names[1] == long && node.contains("characters together"),
            "{node}"
        );
        assert!(!Path::new(&out).exists(), "{names:?}: something was begun");
    }
}

/// Guards options that would silently do nothing.
#[test]
fn options_that_cannot_apply_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("run").to_string_lossy().into_owned();
    let milling = "scenarios/milling.ron";
    let cases: [(&[&str], &str); 5] = [
        (
            &["run", milling, "--live", "9877", "--embedded", "--out", &out],
            "write --live=9877",
        ),
        (
            &["run", milling, "--embedded", "--dedicated-cores", "--out", &out],
            "--dedicated-cores is for processes",
        ),
        (
            &[
                "run",
                milling,
                "--set",
                "placement=Embedded",
                "--dedicated-cores",
                "--out",
                &out,
            ],
            "--dedicated-cores is for processes",
        ),
        (&["doctor", "--lockstep", milling, "--rate-hz", "500"], "--rate-hz"),
        (
            &["node", "estimator", milling, "--live=9877", "--out", &out],
            "--live is for the recorder's process, and this one is estimator",
        ),
    ];
    for (words, sentence) in cases {
        let refused = Finished::run(words, LIMIT).expect(2);
        assert!(refused.err.contains(sentence), "no \"{sentence}\" in: {}", refused.err);
    }
    assert!(!Path::new(&out).exists(), "something was begun");
}

/// Guards options that give a scenario too little time: the option is named, and the least that it says is taken where one less is not.
#[test]
fn too_short_a_measurement_is_refused_with_the_least() {
    let milling = "scenarios/milling.ron";
    let doctor = |words: &[&str]| {
        Finished::run(&[&["doctor", "--lockstep", milling], words].concat(), LIMIT)
            .expect(2)
            .err
    };
    let refused = doctor(&["--duration-s", "1"]);
    // Three turns, each longer than its 0.5 s of settling.
    assert!(
        refused.contains("--duration-s: 1 s is too short") && refused.contains("at least 1.501 s"),
        "{refused}"
    );
    assert!(doctor(&["--duration-s=-1"]).contains("-1 s is outside [0.001, 86400] s"));
    // What is refused for something else is told as that.
    assert!(doctor(&["--set", "expect.settling_s=9"]).contains("expect.settling_s"));
    let (_root, [folder]) = folders();
    let out = folder.to_string_lossy();
    let bench = |ticks: &str| {
        Finished::run(
            &["bench", milling, "--turns", "1", "--out", &out, "--ticks", ticks],
            LIMIT,
        )
    };
    let refused = bench("100").expect(2).err;
    assert!(refused.contains("--ticks: 100 are too few"), "{refused}");
    let least: u64 = refused.split("at least ").nth(1).unwrap().trim().parse().unwrap();
    assert!(bench(&(least - 1).to_string()).expect(2).err.contains("too few"));
    bench(&least.to_string()).expect(0);
}

/// Guards two traps of editors: a mark before the text is no part of it, whichever file it is; and a file whose text is one long line
/// does not fill the screen when it is refused.
#[test]
fn marks_and_long_lines_do_no_harm() {
    let root = tempfile::tempdir().unwrap();
    std::fs::create_dir(root.path().join("materials")).unwrap();
    for file in ["milling.ron", "materials/terfenol_nealis_smith.ron"] {
        let text = std::fs::read_to_string(repository().join("scenarios").join(file)).unwrap();
        std::fs::write(root.path().join(file), format!("\u{feff}{text}")).unwrap();
    }
    let scenario = root.path().join("milling.ron");
    Finished::run(&["check", &scenario.to_string_lossy()], LIMIT).expect(0);
    let text = std::fs::read_to_string(&scenario).unwrap();
    let lobes = format!("lobes: [{}", "(1, 1e-9, 0.0), ".repeat(300));
    let refused = check(
        &text.replace("lobes: [", &lobes).replace("seed: 1", "seed: x"),
        root.path(),
    );
    assert!(refused.err.len() < 3000, "{}", refused.err.len());
    // The model's reader is the scenario's.
    let model = root.path().join("model.ron");
    let nominal = std::fs::read_to_string(repository().join("scenarios/models/nominal.ron")).unwrap();
    std::fs::write(
        &model,
        format!(
            "\u{feff}{}",
            nominal.replace("damping_per_s: 7889.9", "damping_per_s: low")
        ),
    )
    .unwrap();
    let data = root.path().join("run.csv");
    std::fs::write(&data, "time_s\n").unwrap();
    let arguments = ["--model", &model.to_string_lossy(), "--data", &data.to_string_lossy()];
    for command in ["estimate", "diagnose"] {
        let refused = one_line(Finished::run(&[&[command][..], &arguments].concat(), LIMIT).expect(2));
        let sentence = "rod.damping_per_s: Expected float: what is wanted is a number in 1/s";
        assert!(refused.err.contains(sentence), "{command}: {}", refused.err);
    }
}
