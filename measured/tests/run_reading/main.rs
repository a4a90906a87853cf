//! Guards the sentences with which a run is refused: file, row, line, column, value, limit and what to do. Nobody
//! should have to open the source to mend a file.

mod parquet_files;

use std::fmt::Write as _;
use std::path::PathBuf;

use anhyst_measured::{MeasuredRun, Quantity, RunReadOptions};
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

#[test]
fn a_run_is_read_in_si_units() {
    let run = read(&good(), &[]).unwrap();
    assert_eq!((run.len(), run.rows[99], run.lines.as_ref().unwrap()[0]), (100, 99, 2));
    assert!((run.tick_s.unwrap() - 1e-4).abs() < 1e-15);
    assert_eq!(run.inputs().collect::<Vec<_>>(), [Quantity::FieldCommand]);
    assert_eq!(run.outputs().collect::<Vec<_>>(), [Quantity::Displacement]);
    assert_eq!(run.series(Quantity::Field), None);
    assert_eq!(run.data_hash.len(), 16);
    let named = table("t_ms;u;Weg [µm];T", |i, h, x| {
        format!("{:.1};{};{};20,5", i as f64 * 0.1, h / 100.0, x * 1e6)
    });
    let words = ["command=u*100", "displacement_m=Weg [µm]", "temperature=T*1+273.15"];
    let same = read(&named, &words).unwrap();
    for quantity in [Quantity::FieldCommand, Quantity::Displacement] {
        let pairs = run.series(quantity).unwrap().iter().zip(same.series(quantity).unwrap());
        let largest = pairs
            .map(|(one, other)| (one - other).abs() / (one.abs() + 1e-9))
            .fold(0.0, f64::max);
        assert!(largest < 1e-9, "{quantity:?}: {largest}");
    }
    assert_eq!(same.series(Quantity::Temperature).unwrap()[7], 293.65);
    assert_eq!(same.column(Quantity::Displacement).unwrap().scale, 1e-6);
    assert!((same.tick_s.unwrap() - 1e-4).abs() < 1e-15);
}

#[test]
fn a_sweep_needs_no_time_and_flux_density_gives_magnetization() {
    let sweep = table("H_kA_per_m,B_T,strain_ppm", |_, h, x| {
        format!("{},{},{}", h / 1e3, x * 1e4, (x * 4e5).powi(2))
    });
    let run = read(&sweep, &[]).unwrap();
    assert_eq!((run.time_s.as_ref(), run.tick_s), (None, None));
    let outputs = [Quantity::Strain, Quantity::Magnetization, Quantity::FluxDensity];
    assert_eq!(run.outputs().collect::<Vec<_>>(), outputs);
    let of = |quantity: Quantity| run.series(quantity).unwrap()[20];
    let expected = of(Quantity::FluxDensity) / 1.25663706127e-6 - of(Quantity::Field);
    assert!((of(Quantity::Magnetization) / expected - 1.0).abs() < 1e-12);
}

#[test]
fn rows_are_chosen_and_dropped() {
    let run = read(&good(), &["rows 10..90", "drop 80..", "drop ..15"]).unwrap();
    assert_eq!(
        (run.rows[0], run.len(), run.dropped_rows, run.lines.unwrap()[0]),
        (15, 65, 35, 17)
    );
    assert!((run.time_s.unwrap()[0] - 15e-4).abs() < 1e-12);
    assert_says(
        &good(),
        &["rows 10..20"],
        &["run.csv: 10 of its 100 rows are kept", "at least 20", "--rows"],
    );
    // A bad line is cut off like any other row.
    let cut = with_row(99, "0.0099,1.0");
    assert_eq!(read(&cut, &["rows ..99"]).unwrap().len(), 99);
}

#[test]
fn cells_that_are_no_numbers_say_where_they_stand() {
    let cases: [(&str, &[&str]); 5] = [
        (
            "0.0042,n/a,1e-6",
            &["\"field_command_A_per_m\"", "\"n/a\" is not a number"],
        ),
        ("0.0042,5,", &["\"displacement_m\"", "\"\" is not a number"]),
        (
            "0.0042,5,NaN",
            &["\"displacement_m\"", "the value is NaN", "must be finite"],
        ),
        ("0.0042,-inf,1e-6", &["the value is -inf", "must be finite"]),
        ("0.0042,5", &["it has 2 cells", "the header has 3"]),
    ];
    for (line, parts) in cases {
        let text = with_row(42, line);
        assert_says(&text, &[], parts);
        assert_says(&text, &[], &["run.csv, row 42 (line 44)", "--rows ..42 or --rows 43.."]);
    }
}

#[test]
fn time_must_run_evenly_without_gaps() {
    let timed = |at: &dyn Fn(usize) -> f64| table(HEADER, |i, h, x| format!("{},{h},{x}", at(i)));
    let gap = timed(&|i| (i + if i >= 30 { 25 } else { 0 } + if i >= 95 { 2 } else { 0 }) as f64 * 1e-4);
    let parts = [
        "row 30 (line 32)",
        "\"time_s\"",
        "from 0.0029",
        "to 0.0055",
        "25 samples are missing",
        "2 such gaps",
    ];
    assert_says(&gap, &[], &parts);
    assert_says(&gap, &[], &["--rows 30..95"]);
    assert_eq!(read(&gap, &["rows 30..95"]).unwrap().len(), 65);
    let unsorted = timed(&|i| if i == 50 { 1e-4 } else { i as f64 * 1e-4 });
    assert_says(
        &unsorted,
        &[],
        &[
            "row 50 (line 52)",
            "0.0001 s after 0.0049",
            "must increase",
            "Sort the rows",
        ],
    );
    let repeated = timed(&|i| (i / 2) as f64 * 1e-4);
    assert_says(
        &repeated,
        &[],
        &["row 1 (line 3)", "time 0 s", "row before", "50 rows", "more digits"],
    );
    let jitter = timed(&|i| (i as f64 + if i == 61 { 0.4637 } else { 0.0 }) * 1e-4);
    assert_says(
        &jitter,
        &[],
        &[
            "row 61 (line 63)",
            "off a uniform clock of 1.0",
            "at most 4.",
            "Resample",
        ],
    );
}

/// Small faults of the clock are mended and said; what stands between the gaps stays bit for bit.
#[test]
fn missing_rows_and_jitter_are_resampled_and_said() {
    let whole = read(&good(), &[]).unwrap();
    let of = |run: &MeasuredRun| run.series(Quantity::Displacement).unwrap().to_vec();
    let gapped = read(&good(), &["drop 33..34", "drop 50..52"]).unwrap();
    let repair = gapped.repair.as_ref().unwrap();
    assert_eq!((repair.filled.as_slice(), repair.gaps), ([33, 50, 51].as_slice(), 2));
    assert_eq!(
        repair.to_string(),
        "3 missing rows in 2 gaps were filled by interpolation"
    );
    assert_eq!((gapped.len(), gapped.rows[51], gapped.rows[52]), (100, 49, 52));
    for (sample, (one, other)) in of(&whole).iter().zip(of(&gapped)).enumerate() {
        let allowed = if repair.filled.contains(&sample) { 1e-7 } else { 0.0 };
        assert!((one - other).abs() <= allowed, "{sample}: {one} {other}");
    }
    // Stamps that jitter, and samples taken when their stamps say so.
    let wander = |i: usize| 0.4 * (i as f64 * 2.4).sin();
    let at = |i: usize| (i as f64 + wander(i)) * 1e-4;
    let stamps = read(&table(HEADER, |i, h, x| format!("{},{h},{x}", at(i))), &[]).unwrap();
    assert!(stamps.repair.as_ref().unwrap().restamped);
    assert_eq!(of(&stamps), of(&whole));
    let sampled = table(HEADER, |i, _, _| {
        let phase = std::f64::consts::TAU * (i as f64 + wander(i)) / 50.0;
        format!("{},{},{}", at(i), 1e4 * phase.sin(), 4e-5 * (phase - 0.1).sin())
    });
    let sampled = read(&sampled, &[]).unwrap();
    let repair = sampled.repair.as_ref().unwrap();
    assert!(
        !repair.restamped && repair.to_string().contains("interpolated to a uniform clock"),
        "{repair}"
    );
    let off = of(&whole)
        .iter()
        .zip(of(&sampled))
        .map(|(one, other)| (one - other).abs())
        .fold(0.0, f64::max);
    // 2 % of a tick, where 40 % were off: 5 µm a tick.
    assert!(off < 1e-7, "{off}");
}

/// Labels of two columns that changed places are told from units that were left out.
#[test]
fn swapped_columns_are_suspected() {
    let swapped = table("time_s,displacement_um,H_A_per_m", |i, h, x| {
        format!("{},{h},{}", time(i), x * 1e6)
    });
    assert_says(
        &swapped,
        &[],
        &[
            "reaches 3.9",
            "swapped with column \"displacement_um\"",
            "field=displacement_um*1 and displacement=H_A_per_m*1e-6",
        ],
    );
    let words = ["field=displacement_um*1", "displacement=H_A_per_m*1e-6"];
    let run = read(&swapped, &words).unwrap();
    assert!((run.series(Quantity::Field).unwrap()[12] / 1e4 - 1.0).abs() < 0.01);
}

/// 3 kHz written with four decimals is uniform: the last digit jitters, not the clock.
#[test]
fn rounded_times_are_uniform() {
    let text = table(HEADER, |i, h, x| format!("{:.4},{h},{x}", i as f64 / 3000.0));
    assert!((read(&text, &[]).unwrap().tick_s.unwrap() * 3000.0 - 1.0).abs() < 1e-3);
}

#[test]
fn wrong_units_are_suspected_and_the_right_ones_named() {
    let plain = |scale: f64| table(HEADER, move |i, h, x| format!("{},{h},{}", time(i), x * scale));
    let says = [
        "row ",
        "\"displacement_m\"",
        "spans 7.9",
        "at most 5e-3 m",
        "looks like µm",
    ];
    assert_says(&plain(1e6), &[], &says);
    assert_says(
        &plain(1e6),
        &[],
        &["displacement=displacement_m*1e-6", "displacement=displacement_m*1"],
    );
    assert_says(&plain(1e9), &[], &["looks like nm"]);
    assert_says(&plain(1e-9), &[], &["at least 1e-10 m", "no displacement sensor"]);
    // The sentence's advice works, although the column's name says m; a scale that makes it worse does not.
    let run = read(&plain(1e6), &["displacement=displacement_m*1e-6"]).unwrap();
    assert!((run.series(Quantity::Displacement).unwrap()[15] - 4e-5 * (1.88495559_f64 - 0.1).sin()).abs() < 1e-9);
    assert_says(
        &good(),
        &["displacement=displacement_m*1e-6"],
        &["its name says m", "the scale is 0.000001"],
    );
    let field = table("time_s,H,displacement_m", |i, h, x| {
        format!("{},{},{x}", time(i), h / 667.0)
    });
    assert_says(
        &field,
        &["field=H"],
        &["field reaches 1.4", "at least 5e1 A/m", "kA/m", "field=H*1000"],
    );
    let meant = read(&field, &["field=H*1"]).unwrap();
    assert!(meant.series(Quantity::Field).unwrap()[12] < 15.0);
    let warm = table("time_s,H_A_per_m,displacement_m,temperature_K", |i, h, x| {
        format!("{},{h},{x},20.4", time(i))
    });
    let parts = [
        "temperature goes down to 2.04",
        "at least 1.5e2 K",
        "°C",
        "temperature=temperature_K*1+273.15",
    ];
    assert_says(&warm, &[], &parts);
    let run = read(&warm, &["temperature=temperature_K*1+273.15"]).unwrap();
    assert!((run.series(Quantity::Temperature).unwrap()[3] - 293.55).abs() < 1e-9);
    let slow = table(HEADER, |i, h, x| format!("{:.1},{h},{x}", i as f64 * 0.1));
    assert_says(
        &slow,
        &[],
        &[
            "the time between samples is 1.0",
            "at most 4.9e-2 s",
            "ms",
            "time=time_s*0.001",
        ],
    );
    assert!((read(&slow, &["time=time_s*0.001"]).unwrap().tick_s.unwrap() - 1e-4).abs() < 1e-12);
    assert!((read(&slow, &["time=time_s*1"]).unwrap().tick_s.unwrap() - 0.1).abs() < 1e-9);
    let ppm = table("H_A_per_m,strain", |_, h, x| format!("{h},{}", x * 2e7));
    assert_says(
        &ppm,
        &[],
        &["strain reaches 7.9", "at most 2e-2 m/m", "ppm", "strain=strain*1e-6"],
    );
    let gauss = table("H_A_per_m,B_T", |_, h, x| format!("{h},{}", x * 2e8));
    assert_says(
        &gauss,
        &[],
        &["flux density reaches 7.9", "at most 3e0 T", "G", "flux=B_T*1e-4"],
    );
    // Physics is not silenced by a scale.
    assert_says(&gauss, &["flux=B_T*1"], &["3 T is never exceeded"]);
}

#[test]
fn columns_are_missing_doubled_constant_or_not_wanted() {
    let one_sided = table("time_s,temperature_K,displacement_m", |i, _, x| {
        format!("{},293,{x}", time(i))
    });
    assert_says(
        &one_sided,
        &[],
        &[
            "no input column",
            "voltage_V",
            "\"temperature_K\"",
            "command=HEADER*SCALE",
        ],
    );
    let blind = table("time_s,current_A,disp", |i, h, x| format!("{},{h},{x}", time(i)));
    assert_says(
        &blind,
        &[],
        &["no output column", "strain", "\"disp\"", "displacement=HEADER*SCALE"],
    );
    let row = |i: usize, h: f64, x: f64| format!("{},{h},{x},{h}", time(i));
    let twice = table("time_s,H_A_per_m,displacement_m,H_A_per_m", row);
    assert_says(&twice, &[], &["\"H_A_per_m\" stands there 2 times", "Rename"]);
    assert_says(&twice, &["field=H_A_per_m"], &["\"H_A_per_m\" stands there 2 times"]);
    let two = table("time_s,H_A_per_m,displacement_m,field_A_per_m", row);
    assert_says(
        &two,
        &[],
        &[
            "\"H_A_per_m\" and \"field_A_per_m\" both hold the field",
            "field=HEADER",
        ],
    );
    assert!(read(&two, &["field=H_A_per_m"]).is_ok());
    assert_says(
        &good(),
        &["field=H"],
        &["no column \"H\"", "named for the field", "\"displacement_m\""],
    );
    assert_says(
        &good(),
        &["field=a", "field=b"],
        &["field is named twice", "\"a\"", "\"b\""],
    );
    let dead = table("time_s,H_A_per_m,displacement_m,current_A", |i, h, x| {
        format!("{},{h},{x},0.5", time(i))
    });
    assert_says(&dead, &[], &["\"current_A\"", "0.5 A in all 100 rows", "current=-"]);
    assert_eq!(read(&dead, &["current=-"]).unwrap().series(Quantity::Current), None);
    let steady = table("time_s,H_A_per_m,displacement_m,force_N", |i, h, x| {
        format!("{},{h},{x},0", time(i))
    });
    assert!(read(&steady, &[]).is_ok(), "a steady force is a fact, not a fault");
}

/// A dead channel is said to be dead before anybody guesses at its unit.
#[test]
fn a_constant_field_is_no_question_of_units() {
    let dead = table("time_s,H_A_per_m,displacement_m", |i, _, x| {
        format!("{},5,{x}", time(i))
    });
    assert_says(&dead, &[], &["row 0", "5 A/m in all 100 rows", "field=-"]);
}

/// The command line hands refusals on as boxed errors.
#[test]
fn refusals_can_be_boxed_and_sent() {
    fn boxed<T: std::error::Error + Send + Sync + 'static>() {}
    boxed::<anhyst_measured::MeasuredError>();
}

#[test]
fn loops_one_after_another_are_no_run() {
    let loops = table("loop_id,H_A_per_m,B_T", |i, h, x| format!("{},{h},{}", i / 60, x * 1e4));
    assert_says(
        &loops,
        &[],
        &["row 60 (line 62)", "loop 1 begins after loop 0", "--rows 0..60"],
    );
    assert_eq!(read(&loops, &["rows 0..60"]).unwrap().len(), 60);
}

#[test]
fn files_that_are_no_tables_say_what_they_look_like() {
    let refusal = |name: &str, bytes: &[u8]| read_bytes(name, bytes, &[]).map(|_| ()).expect_err("must be refused");
    assert!(refusal("run.csv", b" \n\n").contains("run.csv: is empty"));
    assert!(refusal("run.csv", b"PK\x03\x04abc").contains("Excel"));
    assert!(refusal("run.csv", b"\x89HDF\r\n").contains("HDF5"));
    assert!(refusal("run.csv", b"\xff\xfet\0i\0").contains("UTF-16"));
    assert!(refusal("run.csv", b"a,b\n1,\0\x01\x02").contains("binary"));
    assert!(refusal("run.parquet", b"nonsense").contains("does not begin with PAR1"));
    assert!(refusal("run.csv", b"PAR1 and no more").contains("is not a Parquet file that can be read"));
    assert!(refusal("run.csv", b"0,1,2\n3,4,5\n").contains("has no header"));
    let header_only = format!("{HEADER}\n");
    assert!(refusal("run.csv", header_only.as_bytes()).contains("0 of its 0 rows"));
    let missing = MeasuredRun::read("nowhere/run.csv".as_ref(), &options(&[]))
        .unwrap_err()
        .to_string();
    assert!(missing.contains("nowhere/run.csv cannot be read"), "{missing}");
}

#[test]
fn dialects_of_text_are_read() {
    let plain = read(&good(), &[]).unwrap();
    let tabs = good().replace(',', "\t").replace('\n', "\r\n");
    let semicolons = good().replace(',', ";").replace('.', ",");
    let trailing = good().replace('\n', ",\n").replacen(",\n", "\n", 1);
    let commented = format!("# rig 7, 3 MPa\n{}", good());
    let marked = format!("\u{feff}{}", good());
    for (index, text) in [tabs, semicolons, trailing, marked].iter().enumerate() {
        let run = read(text, &[]).unwrap_or_else(|refusal| panic!("dialect {index}: {refusal}"));
        assert_eq!(
            run.series(Quantity::Displacement),
            plain.series(Quantity::Displacement),
            "dialect {index}"
        );
    }
    assert_eq!(read(&commented, &[]).unwrap().lines.unwrap()[0], 3);
    // Latin-1, as instruments write µ.
    let mut latin_1 = b"time_s;H_A_per_m;displacement_\xb5m\n".to_vec();
    let micrometres = table("", |i, h, x| format!("{};{h};{}", time(i), x * 1e6));
    latin_1.extend(micrometres.trim_start().bytes());
    let run = read_bytes("run.csv", &latin_1, &[]).unwrap();
    assert_eq!(run.column(Quantity::Displacement).unwrap().scale, 1e-6);
}
