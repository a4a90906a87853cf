//! Guards the documents that are made from the message types: they must be what the types say today.

use anhyst_conformance::interface;
use std::path::Path;

/// Fails unless the file is `expected`, and says how to make it.
fn assert_current(file: &str, expected: &str, option: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    let found = std::fs::read_to_string(path).unwrap_or_default();
    if found.trim_end() == expected.trim_end() {
        return;
    }
    let differs = found.lines().zip(expected.lines()).position(|(a, b)| a != b);
    let line = differs.map_or(found.lines().count().min(expected.lines().count()), |line| line) + 1;
    panic!("{file} is stale from line {line} on: anhyst interface {option} > {file}");
}

#[test]
fn documents_are_what_the_types_say() {
    assert_current("docs/interface.md", &interface::markdown(), "");
    assert_current("driver/include/anhyst.h", &interface::c_header(), "--c-header");
    let python = "examples/amplifier-python/anhyst_interface.py";
    assert_current(python, &interface::python(), "--python");
}

/// Guards the JSON for other generators: every channel with its readers, every variable.
#[test]
fn the_json_has_channels_wires_and_variables() {
    let json: serde_json::Value = serde_json::from_str(&interface::json().unwrap()).unwrap();
    assert_eq!(json["channels"].as_array().unwrap().len(), 7);
    let wires = json["wires"].as_array().unwrap();
    let reads = |wire: &serde_json::Value| wire["channel"] == "safe_field" && wire["reader"] == "amplifier";
    assert_eq!(wires.iter().filter(|wire| reads(wire)).count(), 1);
    assert_eq!(json["variables"][1][0], "ANHYST_SERVICE_PREFIX");
}
