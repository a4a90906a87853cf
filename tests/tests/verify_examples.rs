//! Guards the examples: whoever copies one starts from an amplifier that `anhyst verify-amplifier` passes, with the limits that
//! its description states. No bound here is on time: the latency limit is ten seconds.

use anhyst_tests::{Finished, LIMIT, anhyst, c_amplifier, files_with, iio_device, python, start};
use serde_json::Value;
use std::path::Path;

/// Verifies against `amplifier`, the stated constants. Passed checks, and names of those that were not judged.
fn passes(amplifier: &str, command: &str) -> (usize, Vec<String>) {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_string_lossy().into_owned();
    let constants = format!("amplifier={amplifier}");
    let base = ["verify-amplifier", "scenarios/amplifier.ron", "--out", &folder];
    let limits = ["--silence-s", "4", "--latency-limit-s", "10", "--start-limit-s", "60"];
    let given = ["--command", command, "--set", &constants];
    let launcher = start(&[&base[..], &limits, &given].concat());
    let prefix = format!("anhyst_{}_", launcher.id());
    let finished = Finished::wait(launcher, LIMIT).expect(0);
    assert_eq!(files_with(&prefix), Vec::<String>::new(), "after {command}");
    let text = std::fs::read(Path::new(&folder).join("amplifier.json")).unwrap();
    let report: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(report["passed"], true, "{}", finished.out);
    let skipped = report["not_judged"].as_array().unwrap().iter();
    let names = skipped.map(|skipped| skipped["name"].as_str().unwrap().to_owned());
    (report["checks"].as_array().unwrap().len(), names.collect())
}

#[test]
fn the_python_amplifier_passes() {
    let Some(python) = python() else { return };
    let constants = "(bandwidth_hz: 3000, field_limit_a_per_m: 30e3, slew_limit_a_per_m_s: 40e6)";
    let command = format!(
        "exec {python} examples/amplifier-python/amplifier.py --bandwidth-hz 3000 --field-limit-a-per-m 30e3 --slew-limit-a-per-m-s 40e6"
    );
    assert_eq!(passes(constants, &command), (23, Vec::new()));
}

/// Stated: 9000/m · 6 A, and 9000/m · (24 V − 1.2 Ω · 6 A)/0.9 mH.
#[test]
fn the_c_amplifier_passes() {
    let root = tempfile::tempdir().unwrap();
    let Some(amplifier) = c_amplifier(root.path()) else {
        return;
    };
    let constants = "(bandwidth_hz: 2500, field_limit_a_per_m: 54e3, slew_limit_a_per_m_s: 168e6)";
    assert_eq!(
        passes(constants, &format!("exec {}", amplifier.display())),
        (23, Vec::new())
    );
    // Another coil, supply and bandwidth: those of scenarios/amplifier.ron.
    let constants = "(bandwidth_hz: 3000, field_limit_a_per_m: 30e3, slew_limit_a_per_m_s: 40e6)";
    let options = "--bandwidth-hz 3000 --field-per-current-per-m 10e3 --current-limit-a 3 --resistance-ohm 2 --inductance-h 0.9e-3 --supply-v 9.6";
    assert_eq!(
        passes(constants, &format!("exec {} {options}", amplifier.display())),
        (23, Vec::new())
    );
}

/// Stated: 9000/m · 1 A/V · 5 V, and the same with 20 kV/s. Files have no lag.
#[test]
fn the_amplifier_behind_iio_files_passes() {
    let root = tempfile::tempdir().unwrap();
    let device = iio_device(root.path()).unwrap();
    let driver = anhyst().with_file_name("anhyst-amplifier-hardware");
    let command = format!("exec {} --device {}", driver.display(), device.display());
    let constants = "(field_limit_a_per_m: 45e3, slew_limit_a_per_m_s: 180e6)";
    assert_eq!(
        passes(constants, &command),
        (22, vec!["bandwidth_not_above".to_owned()])
    );
    let raw = std::fs::read_to_string(device.join("out_voltage0_raw")).unwrap();
    assert_eq!(
        raw.trim(),
        "32768",
        "the output is at zero after the controller's death"
    );
}
