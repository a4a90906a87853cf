//! Guards what leaves a run: each format is read back by our own door, with names, units and the same bits as the text.
#![cfg(feature = "recorder")]

use anhyst_measured::{MeasuredRun, Quantity, RunReadOptions};
use std::path::Path;
use std::process::Command;

fn anhyst(arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_anhyst"))
        .args(arguments)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn every_format_is_read_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let run = run.to_str().unwrap();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/milling.ron");
    let short = [
        "--set",
        "duration_s=0.25",
        "--set",
        "expect.settling_s=0.15",
        "--set",
        "expect.tolerance_m=None",
    ];
    anhyst(&[&["run", scenario, "--embedded", "--out", run][..], &short].concat());
    let read = |format: &str| {
        anhyst(&["export", run, "--format", format]);
        let file = Path::new(run).join(format!("run.{format}"));
        MeasuredRun::read(&file, &RunReadOptions::default()).unwrap_or_else(|error| panic!("{format}: {error}"))
    };
    let text = read("csv");
    for format in ["parquet", "mat", "mcap"] {
        let own = read(format);
        for quantity in [Quantity::FieldCommand, Quantity::Field, Quantity::Displacement] {
            let (one, other) = (text.series(quantity), own.series(quantity));
            assert!(one.is_some_and(|series| series.len() == 5000), "{quantity:?}");
            assert_eq!(one, other, "{format}: {quantity:?}");
        }
        assert_eq!(text.time_s, own.time_s, "{format}");
    }
}
