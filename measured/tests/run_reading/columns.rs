//! Guards the sentences about columns and rows that cannot be used.

use anhyst_measured::Quantity;

use super::{assert_says, good, read, table, time, with_row};

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
fn loops_one_after_another_are_no_run() {
    let loops = table("loop_id,H_A_per_m,B_T", |i, h, x| format!("{},{h},{}", i / 60, x * 1e4));
    assert_says(
        &loops,
        &[],
        &["row 60 (line 62)", "loop 1 begins after loop 0", "--rows 0..60"],
    );
    assert_eq!(read(&loops, &["rows 0..60"]).unwrap().len(), 60);
}
