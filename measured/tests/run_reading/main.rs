//! Guards the sentences with which a run is refused: file, row, line, column, value, limit and what to do. Nobody
//! should have to open the source to mend a file.

mod clock;
mod columns;
mod files;
mod parquet_files;
mod records;
mod units;
mod what_is_read;

use std::fmt::Write as _;
use std::path::PathBuf;

use anhyst_measured::{MeasuredRun, RunReadOptions};
use tempfile::TempDir;

const HEADER: &str = "time_s,field_command_A_per_m,displacement_m";

/// A hundred rows at 10 kHz; `row` writes each line from its number, the command (A/m) and the displacement (m).
fn table(header: &str, row: impl Fn(usize, f64, f64) -> String) -> String {
    let mut text = format!("{header}\n");
    for i in 0..100 {
        let phase = std::f64::consts::TAU * i as f64 / 50.0;
        writeln!(text, "{}", row(i, 1e4 * phase.sin(), 4e-5 * (phase - 0.1).sin())).unwrap();
    }
    text
}

fn time(i: usize) -> String {
    format!("{:.4}", i as f64 * 1e-4)
}

fn good() -> String {
    table(HEADER, |i, h, x| format!("{},{h},{x}", time(i)))
}

/// The good table with one line replaced.
fn with_row(row: usize, line: &'static str) -> String {
    table(HEADER, move |i, h, x| {
        if i == row {
            line.to_owned()
        } else {
            format!("{},{h},{x}", time(i))
        }
    })
}

fn options(words: &[&str]) -> RunReadOptions {
    let mut options = RunReadOptions::default();
    for word in words {
        match (word.strip_prefix("rows "), word.strip_prefix("drop ")) {
            (Some(range), _) => options.rows = Some(range.parse().unwrap()),
            (_, Some(range)) => options.drop_rows.push(range.parse().unwrap()),
            _ => options.mappings.push(word.parse().unwrap()),
        }
    }
    options
}

fn read_bytes(name: &str, bytes: &[u8], words: &[&str]) -> Result<MeasuredRun, String> {
    let folder = TempDir::new().unwrap();
    let file: PathBuf = folder.path().join(name);
    std::fs::write(&file, bytes).unwrap();
    MeasuredRun::read(&file, &options(words)).map_err(|refusal| refusal.to_string())
}

fn read(text: &str, words: &[&str]) -> Result<MeasuredRun, String> {
    read_bytes("run.csv", text.as_bytes(), words)
}

/// Every part must stand in the sentence.
fn assert_says(text: &str, words: &[&str], parts: &[&str]) {
    let sentence = read(text, words).map(|_| ()).expect_err("must be refused");
    for part in parts {
        assert!(sentence.contains(part), "\"{part}\" is missing in: {sentence}");
    }
}
