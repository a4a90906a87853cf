//! Guards the sentences about units: a wrong one is suspected, the right one named, and what is said can be pasted.

use anhyst_measured::Quantity;

use super::{HEADER, assert_says, good, read, table, time};

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

/// A dead channel is said to be dead before anybody guesses at its unit.
#[test]
fn a_constant_field_is_no_question_of_units() {
    let dead = table("time_s,H_A_per_m,displacement_m", |i, _, x| {
        format!("{},5,{x}", time(i))
    });
    assert_says(&dead, &[], &["row 0", "5 A/m in all 100 rows", "field=-"]);
}

/// A row of units below the names is no row of data, and its units count; old names still ask for the columns.
#[test]
fn a_row_of_units_joins_the_header() {
    let text = table("Time,Field_command,Displacement\n[s],[kA/m],[um]", |i, h, x| {
        format!("{},{},{}", time(i), h / 1e3, x * 1e6)
    });
    let whole = read(&good(), &[]).unwrap();
    for columns in [&[][..], &["displacement=Displacement"]] {
        let run = read(&text, columns).unwrap();
        for quantity in [Quantity::FieldCommand, Quantity::Displacement] {
            let [own, other] = [&run, &whole].map(|run| run.series(quantity).unwrap()[15]);
            assert!((own / other - 1.0).abs() < 1e-12, "{quantity:?}: {own} and {other}");
        }
        assert_eq!(run.len(), 100);
    }
    assert_says(&text.replace("[um]", "parsec"), &[], &["Displacement [parsec]"]);
    let torn = table("time_s,field_command_A_per_m,displacement_m\ns,kA/m,3", |i, h, x| {
        format!("{},{h},{x}", time(i))
    });
    assert_says(&torn, &[], &["row 0 (line 2)"]);
}
