//! Guards the rooms of ARCHITECTURE.md: who may know whom.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

#[test]
fn rooms_know_only_what_they_may() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(anhyst_tests::repository())
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let name = |value: &serde_json::Value| value["name"].as_str().unwrap().to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    let known: BTreeMap<String, BTreeSet<String>> = packages
        .iter()
        .map(|package| {
            let dependencies = package["dependencies"].as_array().unwrap().iter();
            // A test may know the witness: that is what it is for, and it is in nothing that is shipped.
            let shipped = |own: &&serde_json::Value| own["kind"] != "dev" || own["name"] != "anhyst-witness";
            let dependencies = dependencies.filter(shipped).map(name);
            (
                name(package),
                dependencies.filter(|dependency| ours.contains(dependency)).collect(),
            )
        })
        .collect();
    let may: [(&str, &[&str]); 23] = [
        ("anhyst-model", &[]),
        ("anhyst-ipc", &[]),
        ("anhyst-plant-sim", &["anhyst-model", "anhyst-ipc"]),
        ("anhyst-estimator", &["anhyst-model", "anhyst-ipc"]),
        ("anhyst-inverse", &["anhyst-model", "anhyst-ipc"]),
        ("anhyst-controller", &["anhyst-model", "anhyst-ipc"]),
        ("anhyst-guard", &["anhyst-ipc"]),
        ("anhyst-recorder", &["anhyst-ipc", "anhyst-report"]),
        ("anhyst-measured", &[]),
        ("anhyst-identify", &["anhyst-model", "anhyst-measured"]),
        (
            "anhyst-diagnosis",
            &["anhyst-model", "anhyst-measured", "anhyst-identify", "anhyst-report"],
        ),
        ("anhyst-report", &[]),
        ("anhyst-driver", &["anhyst-ipc"]),
        ("anhyst-amplifier-hardware", &["anhyst-ipc"]),
        ("anhyst-bridge", &["anhyst-ipc"]),
        (
            "anhyst-scenario",
            &[
                "anhyst-measured",
                "anhyst-identify",
                "anhyst-model",
                "anhyst-ipc",
                "anhyst-plant-sim",
                "anhyst-estimator",
                "anhyst-inverse",
                "anhyst-controller",
                "anhyst-guard",
            ],
        ),
        (
            "anhyst-launch",
            &[
                "anhyst-ipc",
                "anhyst-plant-sim",
                "anhyst-estimator",
                "anhyst-inverse",
                "anhyst-controller",
                "anhyst-guard",
                "anhyst-scenario",
                "anhyst-recorder",
                "anhyst-report",
            ],
        ),
        (
            "anhyst-conformance",
            &[
                "anhyst-model",
                "anhyst-ipc",
                "anhyst-report",
                "anhyst-scenario",
                "anhyst-launch",
            ],
        ),
        (
            "anhyst-studies",
            &[
                "anhyst-model",
                "anhyst-controller",
                "anhyst-plant-sim",
                "anhyst-estimator",
                "anhyst-recorder",
                "anhyst-measured",
                "anhyst-identify",
                "anhyst-diagnosis",
                "anhyst-report",
                "anhyst-launch",
                "anhyst-witness",
            ],
        ),
        (
            "anhyst-sweep",
            &[
                "anhyst-ipc",
                "anhyst-identify",
                "anhyst-report",
                "anhyst-scenario",
                "anhyst-launch",
            ],
        ),
        ("anhyst-fmu", &["anhyst-ipc", "anhyst-scenario"]),
        (
            "anhyst-python",
            &[
                "anhyst",
                "anhyst-model",
                "anhyst-ipc",
                "anhyst-estimator",
                "anhyst-measured",
                "anhyst-identify",
                "anhyst-scenario",
                "anhyst-launch",
                "anhyst-recorder",
            ],
        ),
        ("anhyst-witness", &[]),
    ];
    for (room, allowed) in may {
        let allowed: BTreeSet<String> = allowed.iter().map(|name| (*name).to_owned()).collect();
        let too_much: Vec<&String> = known[room].difference(&allowed).collect();
        assert!(too_much.is_empty(), "{room} may not know {too_much:?}");
    }
    assert_eq!(
        known.len(),
        may.len() + 2,
        "a new crate has no room here: {:?}",
        known.keys()
    );
}
