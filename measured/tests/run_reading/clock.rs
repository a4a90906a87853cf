//! Guards the clock: a uniform one is recognised however its stamps are written, small faults are mended and said, others refused.

use anhyst_measured::{MeasuredRun, Quantity};

use super::{HEADER, assert_says, good, read, table};

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

/// 3 kHz written with four decimals is uniform: the last digit jitters, not the clock.
#[test]
fn rounded_times_are_uniform() {
    let text = table(HEADER, |i, h, x| format!("{:.4},{h},{x}", i as f64 / 3000.0));
    assert!((read(&text, &[]).unwrap().tick_s.unwrap() * 3000.0 - 1.0).abs() < 1e-3);
}

/// Dates and times of day are seconds since the first row, across midnight only with a date; what is none has its place.
#[test]
fn instants_are_a_clock() {
    let whole = read(&good(), &[]).unwrap();
    type Named = (&'static str, fn(usize) -> String);
    let instants: [Named; 3] = [
        ("time", |i| format!("2024-02-29T23:59:59.99{:02}Z", i)),
        ("Timestamp", |i| match i {
            0..50 => format!("2024/02/29 23:59:59.{:04}", 9950 + i),
            _ => format!("2024/03/01 00:00:00.{:04}", i - 50),
        }),
        ("time_s", |i| format!("12:00:00.{:04}", i)),
    ];
    for (name, at) in &instants {
        let header = HEADER.replace("time_s", name);
        let run = read(&table(&header, |i, h, x| format!("{},{h},{x}", at(i))), &[]).unwrap();
        assert!(
            (run.tick_s.unwrap() - 1e-4).abs() < 1e-12,
            "{name}: {}",
            run.tick_s.unwrap()
        );
        assert_eq!(run.series(Quantity::Displacement), whole.series(Quantity::Displacement));
    }
    let broken = table(&HEADER.replace("time_s", "time"), |i, h, x| {
        let at = if i == 7 { "yesterday".into() } else { instants[0].1(i) };
        format!("{at},{h},{x}")
    });
    assert_says(&broken, &[], &["row 7", "yesterday"]);
}
