//! Guards the readers of files: a scenario or a data file that is torn, scrambled or full of absurd numbers is refused with a
//! sentence or runs without a number that is none; nothing panics. Has caught: a text of one `#!`, a torn string, and a
//! million brackets, each of which ended the program.

use anhyst_ipc::{CoilField, Connections, NodeId, SafeField};
use anhyst_launch::assemble;
use anhyst_measured::{MeasuredRun, RunReadOptions};
use anhyst_scenario::{Scenario, load, wires};
use anhyst_tests::repository;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use std::path::Path;

/// One change of a text.
#[derive(Debug, Clone)]
enum Tear {
    /// The n-th number becomes another.
    Number(Index, &'static str),
    /// Bytes are lost from here on.
    Cut(Index),
    /// A line is lost.
    Line(Index),
    /// Something is written in between.
    Insert(Index, &'static str),
}

const ABSURD: [&str; 18] = [
    "NaN",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e300",
    "1e30",
    "1e12",
    "-1",
    "1",
    "18446744073709551615",
    "9223372036854775808",
    "0.5",
    "1e-9",
];
const PIECES: [&str; 14] = [
    "(", ")", "[", "{", "}", "\"", "\\", "#!", "/*", ",", ":", "é", "\u{0}", ", None",
];

fn tears() -> impl Strategy<Value = Vec<Tear>> {
    let tear = prop_oneof![
        6 => (any::<Index>(), select(&ABSURD)).prop_map(|(at, number)| Tear::Number(at, number)),
        1 => any::<Index>().prop_map(Tear::Cut),
        1 => any::<Index>().prop_map(Tear::Line),
        1 => (any::<Index>(), select(&PIECES)).prop_map(|(at, piece)| Tear::Insert(at, piece)),
    ];
    prop::collection::vec(tear, 1..4)
}

/// Where numbers stand: digits that do not continue a name.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let bytes = text.as_bytes();
    let part = |byte: u8| byte.is_ascii_digit() || b".e-+".contains(&byte);
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let inside_name = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
        if (bytes[at].is_ascii_digit() || bytes[at] == b'-') && !inside_name {
            let length = bytes[at..].iter().take_while(|byte| part(**byte)).count();
            found.push(at..at + length);
            at += length;
        } else {
            at += 1;
        }
    }
    found
}

fn boundary(text: &str, at: Index) -> usize {
    let mut byte = at.index(text.len() + 1);
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

fn torn(text: &str, tears: &[Tear]) -> String {
    let mut text = text.to_owned();
    for tear in tears {
        match tear {
            Tear::Number(at, number) => {
                let found = numbers(&text);
                if !found.is_empty() {
                    text.replace_range(found[at.index(found.len())].clone(), number);
                }
            }
            Tear::Cut(at) => text.truncate(boundary(&text, *at)),
            Tear::Line(at) => {
                let lines: Vec<&str> = text.lines().collect();
                if !lines.is_empty() {
                    let lost = at.index(lines.len());
                    text = lines
                        .iter()
                        .enumerate()
                        .filter(|(line, _)| *line != lost)
                        .map(|(_, line)| format!("{line}\n"))
                        .collect();
                }
            }
            Tear::Insert(at, piece) => text.insert_str(boundary(&text, *at), piece),
        }
    }
    text
}

/// A short cut with everything in it that a scenario can say about safety.
fn healthy_scenario() -> String {
    let text = std::fs::read_to_string(repository().join("scenarios/milling.ron")).unwrap();
    let material = repository().join("scenarios/materials/terfenol_nealis_smith.ron");
    text.replace("materials/terfenol_nealis_smith.ron", &material.to_string_lossy())
        .replace("duration_s: 4.5", "duration_s: 0.2")
        .replace("settling_s: 0.5", "settling_s: 0.1")
        .replace(
            "guard: (field_limit_a_per_m: 30e3),",
            "watchdog: (silent_ticks: 3, ramp_time_s: 0.01),
    faults: [Link(at_s: 0.001, for_ticks: 4, channel: measurement, field: \"displacement_m\", kind: Offset(1e-6))],
    guard: (field_limit_a_per_m: 30e3, slew_limit_a_per_m_s: 1e8, ramp_time_s: 0.01, jump_limit_m: 1e-5,
        monitors: (tracking: (error_limit_m: 1e-5, after_ticks: 5, settling_s: 0.01), hold_at_most_s: 0.05,
            estimate: (range_a_per_m: (6200, 7400), uninformed_ticks: 100), reset_at_s: [0.01]),
        reactions: {displacement_jump: (reaction: Hold, way_back: AfterHealth(for_s: 0.01))}),",
        )
}

/// A few ticks of what was accepted: it must not be dangerous either.
fn run(scenario: &Scenario) {
    let mut connections = Connections::new(NodeId::LOOP_ORDER, wires(), None);
    connections.accept_any_tick(assemble::late_channels(scenario).unwrap());
    let mut stages: Vec<_> = NodeId::SENDERS
        .into_iter()
        .map(|node| assemble::stage(node, scenario, &mut connections).unwrap())
        .collect();
    let limit = scenario.guard.acting_field_limit_a_per_m();
    for tick in 0..scenario.ticks().min(40) {
        stages.iter_mut().for_each(|stage| stage.tick(tick).unwrap());
        let (safe, coil): (SafeField, CoilField) = (connections.last().unwrap(), connections.last().unwrap());
        assert!(safe.field_a_per_m.abs() <= limit, "{safe:?}");
        assert!(coil.field_a_per_m.is_finite(), "{coil:?}");
    }
}

fn try_scenario(folder: &Path, text: &str) -> bool {
    let path = folder.join("torn.ron");
    std::fs::write(&path, text).unwrap();
    match load(&path, &[]) {
        Ok(scenario) => {
            run(&scenario);
            true
        }
        Err(refusal) => {
            assert!(!refusal.to_string().is_empty());
            false
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn torn_scenarios_are_refused_or_harmless(tears in tears()) {
        let folder = tempfile::tempdir().unwrap();
        try_scenario(folder.path(), &torn(&healthy_scenario(), &tears));
    }

    #[test]
    fn random_bytes_are_no_scenario(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("random.ron");
        std::fs::write(&path, &bytes).unwrap();
        prop_assert!(load(&path, &[]).is_err());
    }

    #[test]
    fn torn_data_files_are_refused_or_read(tears in tears(), of_run in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("data.csv");
        let text = if of_run { run_table() } else { loop_table() };
        std::fs::write(&path, torn(&text, &tears)).unwrap();
        read_data(&path);
    }

    #[test]
    fn random_bytes_are_no_data(bytes in prop::collection::vec(any::<u8>(), 0..400), parquet in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(if parquet { "data.parquet" } else { "data.csv" });
        std::fs::write(&path, &bytes).unwrap();
        read_data(&path);
    }
}

fn read_data(path: &Path) {
    if let Err(refusal) = MeasuredRun::read_loops(path, &RunReadOptions::default()) {
        assert!(!refusal.to_string().is_empty());
    }
    match MeasuredRun::read(path, &RunReadOptions::default()) {
        Ok(run) => assert!(run.time_s.is_none_or(|times| times.iter().all(|time| time.is_finite()))),
        Err(refusal) => assert!(!refusal.to_string().is_empty()),
    }
}

fn run_table() -> String {
    let rows = (0..60).map(|row| {
        let t = f64::from(row) * 1e-4;
        format!("{t},{},{}\n", 1e4 * (600.0 * t).sin(), 1e-5 * (600.0 * t).sin())
    });
    "time_s,field_a_per_m,displacement_m\n".to_owned() + &rows.collect::<String>()
}

fn loop_table() -> String {
    let rows = (0..200).map(|row| {
        let field = 1e4 * (f64::from(row) * 0.05).sin();
        format!("{field},{}\n", 5.0 * field)
    });
    "field_a_per_m,magnetization_a_per_m\n".to_owned() + &rows.collect::<String>()
}

/// The generators must reach both ends, or the tests above prove nothing.
#[test]
fn the_healthy_files_are_good() {
    let folder = tempfile::tempdir().unwrap();
    assert!(try_scenario(folder.path(), &healthy_scenario()));
    assert!(!try_scenario(folder.path(), &"(".repeat(1_000_000)));
    assert!(!try_scenario(folder.path(), "#!"));
    let path = folder.path().join("data.csv");
    std::fs::write(&path, run_table()).unwrap();
    MeasuredRun::read(&path, &RunReadOptions::default()).unwrap();
    std::fs::write(&path, loop_table()).unwrap();
    MeasuredRun::read_loops(&path, &RunReadOptions::default()).unwrap();
}
