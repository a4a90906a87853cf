//! Guards `anhyst bench`: in one run it measures every row, each in units of the same run's `tanh`, and what has a floor has it.

use std::collections::BTreeMap;
use std::process::Command;

const ROWS: [&str; 24] = [
    "tanh",
    "anhysteretic curve",
    "step",
    "step with five sensitivities",
    "inverse step",
    "bank of 32",
    "bank of 33",
    "bank of 64",
    "bank of 256",
    "bank of 1024",
    "bank of 64, plain",
    "rod of 8 elements",
    "Prandtl-Ishlinskii, 12 plays",
    "Preisach, 24 rows, inverse",
    "Bouc-Wen",
    "plant",
    "estimator",
    "controller",
    "inverse",
    "guard",
    "amplifier",
    "tick, all blocks in one process, no recording",
    "tick of processes that answer with zeros",
    "tick of the processes",
];

#[test]
fn every_row_is_measured_in_one_run() {
    let folder = std::env::temp_dir().join(format!("anhyst-bench-test-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_anhyst"))
        .current_dir(&folder)
        .arg("bench")
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/milling.ron"))
        .args(["--turns", "1", "--ticks", "500", "--json"])
        .output()
        .expect("the executable starts");
    std::fs::remove_dir_all(&folder).expect("the folder can be removed");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let measured: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(["AVX-512", "AVX2", "plain"].contains(&measured["instructions"].as_str().expect("a name")));
    let rows = measured["rows"].as_array().expect("rows");
    let by_name: BTreeMap<&str, &serde_json::Value> = rows
        .iter()
        .map(|row| (row["name"].as_str().expect("a name"), row))
        .collect();
    assert_eq!(by_name.len(), rows.len(), "a name that is there twice");
    for name in ROWS {
        let row = by_name
            .get(name)
            .unwrap_or_else(|| panic!("no {name} in {:?}", by_name.keys()));
        for number in ["median_ns", "least_ns", "tanh", "least_tanh"] {
            let value = row[number].as_f64().unwrap_or_default();
            assert!(value > 0.0, "{name}: {number} is {}", row[number]);
        }
        // A floor that is named is known: all that it is made of was measured, too.
        assert_eq!(row["floor_is"] == "", row["floor_tanh"].is_null(), "{row}");
    }
    assert_eq!(by_name["tanh"]["tanh"], 1.0);
    assert!(by_name["tick of the processes"]["times_real_time"].as_f64() > Some(0.0));
}
