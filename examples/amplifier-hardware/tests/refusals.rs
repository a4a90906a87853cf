//! Guards what a user sees who starts the driver alone. That this test exists also makes cargo build the executable that the
//! tests across processes (`tests/`) start.

use std::process::Command;

#[test]
fn a_driver_without_a_run_says_what_it_needs() {
    let output = Command::new(env!("CARGO_BIN_EXE_anhyst-amplifier-hardware"))
        .args(["--device", "/nonexistent"])
        .env_clear()
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{error}");
    assert!(error.contains("ANHYST_TICK_S is not set"), "{error}");
}
