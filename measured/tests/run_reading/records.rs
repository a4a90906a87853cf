//! Guards what a record for laws is taken for: rows in the order of time, a time that begins anew, stamps of few digits, and quantities and
//! sizes that no actuator has.

use anhyst_measured::{MeasuredRun, Quantity};
use std::fmt::Write as _;
use tempfile::TempDir;

use super::options;

fn records(text: &str, words: &[&str]) -> Result<Vec<MeasuredRun>, String> {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("records.csv");
    std::fs::write(&file, text).unwrap();
    MeasuredRun::read_records(&file, &options(words)).map_err(|refusal| refusal.to_string())
}

/// Sixty rows of a wire: time (s), temperature (°C) and strain.
fn wire(order: impl Fn(usize) -> usize, time: impl Fn(usize) -> String) -> String {
    let mut text = String::from("time_s,temperature_C,strain\n");
    for row in (0..60).map(order) {
        let heat = (0.1 * row as f64).sin();
        writeln!(text, "{},{},{}", time(row), 60.0 + 30.0 * heat, 0.02 - 0.02 * heat).unwrap();
    }
    text
}

fn second(row: usize) -> String {
    format!("{:.1}", 0.5 * row as f64)
}

#[test]
fn rows_are_put_in_the_order_of_time_and_that_is_said() {
    let sorted = records(&wire(|row| row, second), &[]).unwrap();
    let shuffled = records(&wire(|row| 37 * row % 60, second), &[]).unwrap();
    assert!(sorted[0].doubts.is_empty(), "{:?}", sorted[0].doubts);
    assert_eq!(sorted[0].series(Quantity::Strain), shuffled[0].series(Quantity::Strain));
    assert_eq!(sorted[0].time_s, shuffled[0].time_s);
    assert!(
        shuffled[0].doubts[0].contains("sorted by column \"time_s\""),
        "{:?}",
        shuffled[0].doubts
    );
}

#[test]
fn a_time_that_begins_anew_begins_a_record() {
    let parts = records(&wire(|row| row, |row| second(row % 25)), &[]).unwrap();
    assert_eq!(parts.iter().map(MeasuredRun::len).collect::<Vec<_>>(), [25, 25, 10]);
    assert!(parts[0].doubts[0].contains("row 25 (line 27)"), "{:?}", parts[0].doubts);
    assert!(parts[1].doubts.is_empty());
    assert_eq!(parts[1].loop_id, "0 part 1");
}

#[test]
fn stamps_of_few_digits_are_spread_and_a_clock_need_not_be_even() {
    let coarse = records(&wire(|row| row, |row| format!("{}", row / 4)), &[]).unwrap();
    let time_s = coarse[0].time_s.as_ref().unwrap();
    assert!(
        time_s.windows(2).all(|pair| pair[1] > pair[0]) && time_s[59] == 14.0,
        "{time_s:?}"
    );
    let uneven = records(&wire(|row| row, |row| second(row * row)), &[]).unwrap();
    assert_eq!((uneven[0].time_s.as_ref().unwrap()[7], uneven[0].tick_s), (24.5, None));
    let still = records(&wire(|row| row, |_| "3".to_owned()), &[]).unwrap();
    assert_eq!(still[0].time_s, None);
}

/// A damper moves further than any actuator of ours; a stage that does has the wrong unit.
#[test]
fn sizes_are_doubted_where_an_actuator_is_driven() {
    let table = |header: &str| {
        let mut text = format!("{header}\n");
        for row in 0..60 {
            let phase = 0.1 * f64::from(row);
            writeln!(text, "{},{}", 30.0 * phase.sin(), 25.0 * (phase - 0.1).sin()).unwrap();
        }
        text
    };
    let damper = records(&table("displacement_mm,force_N"), &[]).unwrap();
    assert!(damper[0].doubts.is_empty(), "{:?}", damper[0].doubts);
    let stage = records(&table("voltage_V,displacement_mm"), &[]).unwrap();
    assert!(
        stage[0].doubts[0].contains("the displacement spans"),
        "{:?}",
        stage[0].doubts
    );
    let anything = records(&table("speed,torque"), &["input=speed", "output=torque"]).unwrap();
    assert_eq!(anything[0].series(Quantity::Input).unwrap()[1], 30.0 * 0.1_f64.sin());
    let refused = records(&table("speed,torque"), &[]).unwrap_err();
    assert!(
        refused.contains("no input column") && refused.contains("\"torque\""),
        "{refused}"
    );
}
