//! Guards what a good file becomes: SI units, chosen rows, dialects of text.

use anhyst_measured::Quantity;

use super::{assert_says, good, read, read_bytes, table, time, with_row};

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

/// Guards files of instruments, which write what was measured, and how, above the header.
#[test]
fn a_title_above_the_header_is_passed_over() {
    let table = table("t [ms];H [A/m];Weg [µm]", |i, h, x| {
        format!("{:.1};{h};{}", i as f64 * 0.1, x * 1e6).replace('.', ",")
    });
    let words = ["time=t [ms]", "command=H [A/m]", "displacement=Weg [µm]"];
    let plain = read(&table, &words).unwrap();
    for title in [
        "Rig 7, 3 May, gain 2\n",
        "Model;DSO-X\n\nRate;10000;Hz;\n",
        "\"one; line\"\n",
    ] {
        let titled = read(&format!("{title}{table}"), &words).unwrap();
        assert_eq!(
            titled.series(Quantity::Displacement),
            plain.series(Quantity::Displacement),
            "{title}"
        );
        let above = title.lines().count() as u64;
        assert_eq!(titled.lines.unwrap()[0], 2 + above, "{title}");
    }
    // Rows with a remark are no title.
    let remarks = with_row(0, "0,0,0,begins");
    assert!(read(&remarks, &[]).is_err_and(|refusal| refusal.contains("line 2")));
}
