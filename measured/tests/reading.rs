//! Guards the sentences with which a table is refused: value, limit, file, row and column, and what to do.

use std::fmt::Write as _;
use std::path::PathBuf;

use anhyst_measured::{MeasuredRun, Quantity, RunReadOptions};
use tempfile::TempDir;

/// Thirty rows of a loop; `row` writes each line from its number, the field (A/m) and the flux density (T).
fn table(header: &str, row: impl Fn(usize, f64, f64) -> String) -> String {
    let mut text = format!("{header}\n");
    for i in 0..30 {
        let phase = std::f64::consts::TAU * i as f64 / 29.0;
        let (field, flux) = (1000.0 * phase.cos(), 0.5 * (phase - 0.2).cos());
        writeln!(text, "{}", row(i, field, flux)).unwrap();
    }
    text
}

fn good() -> String {
    table("H_A_per_m,B_T", |_, field, flux| format!("{field},{flux}"))
}

fn read(text: &str, options: &RunReadOptions) -> Result<Vec<MeasuredRun>, String> {
    let folder = TempDir::new().unwrap();
    let file: PathBuf = folder.path().join("loop.csv");
    std::fs::write(&file, text).unwrap();
    MeasuredRun::read_loops(&file, options).map_err(|refusal| refusal.to_string())
}

fn mapped(mappings: &[&str]) -> RunReadOptions {
    RunReadOptions {
        mappings: mappings.iter().map(|text| text.parse().unwrap()).collect(),
        ..RunReadOptions::default()
    }
}

/// Every part must stand in the sentence.
fn assert_says(text: &str, options: &RunReadOptions, parts: &[&str]) {
    let sentence = read(text, options).expect_err("must be refused");
    for part in parts {
        assert!(sentence.contains(part), "\"{part}\" is missing in: {sentence}");
    }
}

#[test]
fn magnetization_is_flux_over_mu0_less_field_whatever_the_unit() {
    let plain = read(&good(), &RunReadOptions::default()).unwrap();
    let kilo = table("H_kA_per_m,B_mT,strain_ppm", |_, h, b| {
        format!("{},{},{}", h / 1e3, b * 1e3, b * 100.0)
    });
    let kilo = read(&kilo, &RunReadOptions::default()).unwrap();
    let named = table("raw,volt", |_, h, b| format!("{},{}", h / 50.0, b / 0.25));
    let named = read(&named, &mapped(&["field=raw*50", "flux = volt*0.25"])).unwrap();
    let first = |loops: &[MeasuredRun]| loops[0].series(Quantity::Magnetization).unwrap()[0];
    let expected = 0.5 * 0.2_f64.cos() / 1.25663706127e-6 - 1000.0;
    for loops in [&plain, &kilo, &named] {
        assert!(
            (first(loops) - expected).abs() < 1e-6 * expected,
            "{} instead of {expected}",
            first(loops)
        );
        assert!((loops[0].series(Quantity::Field).unwrap()[0] - 1000.0).abs() < 1e-9);
    }
    let strain = kilo[0].series(Quantity::Strain).unwrap()[0];
    assert!((strain - 0.5 * 0.2_f64.cos() * 1e-4).abs() < 1e-12, "{strain}");
    assert_eq!(plain[0].data_hash.len(), 16);
}

#[test]
fn loops_are_split_by_their_column_and_rows_are_dropped() {
    let body = |id: usize| table("", |_, h, b| format!("{id},{h},{b}")).trim_start().to_owned();
    let text = format!("loop_id,H_A_per_m,B_T\n{}{}", body(0), body(1));
    let options = RunReadOptions {
        drop_rows: vec!["27..30".parse().unwrap(), "58..".parse().unwrap()],
        ..RunReadOptions::default()
    };
    let loops = read(&text, &options).unwrap();
    assert_eq!(loops.iter().map(MeasuredRun::len).collect::<Vec<_>>(), [27, 28]);
    assert_eq!((loops[0].dropped_rows, loops[1].rows[0]), (5, 30));
}

#[test]
fn columns_that_are_missing_or_double_are_listed() {
    let nothing = RunReadOptions::default();
    assert_says(
        &table("current,B_T", |_, h, b| format!("{h},{b}")),
        &nothing,
        &[
            "loop.csv",
            "no column for the field",
            "\"current\", \"B_T\"",
            "field=HEADER",
        ],
    );
    assert_says(
        &table("H_A_per_m,strain", |_, h, b| format!("{h},{}", 1e-3 * b)),
        &nothing,
        &["neither flux density nor magnetization"],
    );
    let double = table("H_A_per_m,H_kA_per_m,B_T", |_, h, b| format!("{h},{},{b}", h / 1e3));
    assert_says(
        &double,
        &nothing,
        &["\"H_A_per_m\"", "\"H_kA_per_m\"", "both hold the field"],
    );
    assert_says(
        &good(),
        &mapped(&["field=H"]),
        &["no column \"H\"", "named for the field", "\"H_A_per_m\""],
    );
}

#[test]
fn values_are_refused_with_row_line_and_column() {
    let nothing = RunReadOptions::default();
    let spoilt = |word: &'static str| {
        table("H_A_per_m,B_T", move |i, h, b| {
            if i == 7 {
                format!("{h},{word}")
            } else {
                format!("{h},{b}")
            }
        })
    };
    assert_says(
        &spoilt("n/a"),
        &nothing,
        &["row 7 (line 9)", "column \"B_T\"", "\"n/a\" is not a number"],
    );
    assert_says(&spoilt(""), &nothing, &["row 7 (line 9)", "\"\" is not a number"]);
    assert_says(
        &spoilt("NaN"),
        &nothing,
        &["row 7 (line 9)", "column \"B_T\"", "the value is NaN", "finite"],
    );
    assert_says(
        &spoilt("5.2"),
        &nothing,
        &[
            "row 7 (line 9)",
            "5.2000e0 T",
            "3 T",
            "Is the unit right?",
            "flux=HEADER*SCALE",
        ],
    );
    let short = table(
        "H_A_per_m,B_T",
        |i, h, b| if i == 7 { h.to_string() } else { format!("{h},{b}") },
    );
    assert_says(
        &short,
        &nothing,
        &[
            "is not a table there",
            "1 cells",
            "the header has 2",
            "--drop-rows 7..8",
        ],
    );
}

#[test]
fn tables_that_are_no_loop_are_refused() {
    let nothing = RunReadOptions::default();
    let constant = table("H_A_per_m,B_T", |_, h, _| format!("{h},0.25"));
    // Found in the column itself: the magnetization made from a constant flux density is not constant.
    assert_says(&constant, &nothing, &["\"B_T\"", "0.25", "all 30 rows"]);
    let rows = RunReadOptions {
        drop_rows: vec!["12..".parse().unwrap()],
        ..RunReadOptions::default()
    };
    assert_says(&good(), &rows, &["loop 0", "12 rows", "at least 20"]);
    let shuffled = table("H_A_per_m,B_T", |i, h, b| {
        if i % 2 == 0 {
            format!("{h},{b}")
        } else {
            format!("{},{}", -h, -b)
        }
    });
    assert_says(
        &shuffled,
        &nothing,
        &["turns round", "in 30 rows", "at most 7", "\"H_A_per_m\""],
    );
    let back = table("time_s,H_A_per_m,B_T", |i, h, b| {
        format!("{},{h},{b}", if i == 9 { 0.5 } else { i as f64 })
    });
    assert_says(&back, &nothing, &["row 9 (line 11)", "\"time_s\"", "0.5 s after 8 s"]);
}

#[test]
fn units_that_cannot_be_are_suspected() {
    let nothing = RunReadOptions::default();
    // Flux density in gauss, called T.
    assert_says(
        &table("H_A_per_m,B_T", |_, h, b| format!("{h},{}", 1e4 * b)),
        &nothing,
        &["T", "3 T is never exceeded"],
    );
    // Strain in ppm, called strain.
    let ppm = table("H_A_per_m,B_T,strain", |_, h, b| format!("{h},{b},{}", 800.0 * b * b));
    assert_says(&ppm, &nothing, &["column \"strain\"", "0.02", "Is the unit right?"]);
    // 150 kA/m written in A/m, called kA/m.
    let field = table("H_kA_per_m,B_T", |_, h, b| format!("{},{b}", 150.0 * h));
    assert_says(
        &field,
        &nothing,
        &[
            "column \"H_kA_per_m\"",
            "1.5000e8 A/m",
            "10000000 A/m is never exceeded",
        ],
    );
    // A scale that contradicts the header.
    let kilo = table("H_kA_per_m,B_T", |_, h, b| format!("{},{b}", h / 1e3));
    assert_says(
        &kilo,
        &mapped(&["field=H_kA_per_m*1"]),
        &["its name says kA/m", "1000", "the scale is 1"],
    );
    // A coil wound the other way.
    let turned = table("H_A_per_m,B_T", |_, h, b| format!("{},{b}", -h));
    assert_says(
        &turned,
        &nothing,
        &["falls while the field rises", "\"H_A_per_m\" or \"B_T\""],
    );
    assert!(read(&turned, &mapped(&["field=H_A_per_m*-1"])).is_ok());
}

#[test]
fn words_on_the_command_line_are_explained() {
    use anhyst_measured::{ColumnMapping, RowRange};
    for text in ["field", "fields=H", "field=H*x", "field=*2", "field=H*0"] {
        let sentence = text.parse::<ColumnMapping>().unwrap_err().to_string();
        assert!(
            sentence.contains(&format!("\"{text}\"")) && sentence.contains("field=H_raw*1000"),
            "{sentence}"
        );
    }
    for text in ["1139", "5..5", "a.."] {
        assert!(text.parse::<RowRange>().unwrap_err().to_string().contains("1139.."));
    }
}
