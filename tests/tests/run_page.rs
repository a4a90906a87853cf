//! Guards what a run tells of its error over frequency, against the linear loop: two ways that share no code.

use anhyst_scenario::load;
use anhyst_tests::{Finished, LIMIT, folders, repository};
use serde_json::Value;

/// A PID that works alone leaves |S|·amplitude of each harmonic of its reference. The simulation has hysteresis and its inverse, the
/// prediction neither; that leaves some per cent.
#[test]
fn the_lines_of_the_error_are_those_of_the_sensitivity() {
    let (_root, [run]) = folders();
    let out = run.to_string_lossy();
    let settings = [
        "duration_s=2.5",
        "expect.tolerance_m=None",
        "controller.feedforward=false",
        "plant.shape=Constant(a_per_m: 6800.0)",
    ];
    let set = settings.iter().flat_map(|setting| ["--set", setting]);
    let base = [
        "run",
        "scenarios/milling.ron",
        "--embedded",
        "--no-recording",
        "--json",
        "--out",
        &out,
    ];
    let told = Finished::run(&base.into_iter().chain(set).collect::<Vec<_>>(), LIMIT).expect(0);
    let summary: Value = serde_json::from_str(&told.out).unwrap();
    let lines = summary["error_lines"].as_array().unwrap();
    let shape = load(&repository().join("scenarios/milling.ron"), &[])
        .unwrap()
        .loop_shape()
        .unwrap();
    for (line, (harmonic, amplitude_m)) in lines.iter().zip([(1, 40e-6), (3, 12e-6)]) {
        let frequency_hz = 50.0 * f64::from(harmonic);
        let left_m = shape.points(frequency_hz, 2)[0].sensitivity * amplitude_m;
        let found_m = line["amplitude_m"].as_f64().unwrap();
        assert_eq!(line["harmonic"], harmonic, "{line}");
        assert!(
            (line["frequency_hz"].as_f64().unwrap() - frequency_hz).abs() < 0.1,
            "{line}"
        );
        assert!((found_m / left_m - 1.0).abs() < 0.05, "{line}: {left_m:e} m expected");
    }
    for line in lines {
        assert!(line["amplitude_m"].as_f64().is_some_and(|own| own > 0.0), "{line}");
    }
    let page = std::fs::read_to_string(run.join("report.html")).unwrap();
    for section in ["<h2>Spectrum</h2>", "<h2>Loop</h2>", "harmonic 3", "delay margin"] {
        assert!(page.contains(section), "{section} is not on the page");
    }
}

/// Guards the name of what an amplifier says wrongly: it is the first that did not hold, before what the others see of it.
#[test]
fn a_field_that_is_no_number_is_the_amplifiers() {
    let (_root, [run]) = folders();
    let out = run.to_string_lossy();
    let fault = r#"faults=[Link(at_s: 0.3, for_ticks: 3, channel: coil_field, field: "field_a_per_m", kind: Nan)]"#;
    let settings = ["duration_s=0.4", "expect.settling_s=0.2", fault];
    let set = settings.iter().flat_map(|setting| ["--set", setting]);
    let base = ["run", "scenarios/milling.ron", "--embedded", "--out", &out];
    let told = Finished::run(&base.into_iter().chain(set).collect::<Vec<_>>(), LIMIT).expect(1);
    let sentence = "NOT held: coil_field_not_finite: the amplifier said a field that is no finite number in 3 ticks, first in tick 6000";
    assert!(told.out.starts_with(sentence), "{}", told.out);
}
