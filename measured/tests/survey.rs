//! What a file holds, told before it is read: guards that every format's channels are listed with rate and ranges, that the options which
//! are proposed for foreign names read the file in SI units, and that what cannot be known is asked for instead of guessed.

use std::path::{Path, PathBuf};

use anhyst_measured::survey::{Survey, SurveyedTable};
use anhyst_measured::{ColumnMapping, MeasuredRun, Quantity, RunReadOptions};
use tempfile::TempDir;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn options(words: &[String]) -> RunReadOptions {
    let mappings = words.iter().map(|word| word.parse::<ColumnMapping>().unwrap());
    RunReadOptions {
        mappings: mappings.collect(),
        ..RunReadOptions::default()
    }
}

fn table(survey: Survey) -> SurveyedTable {
    survey.tables.into_iter().find(|table| table.read).unwrap()
}

/// 400 rows at 10 kHz: a drive of amplitude 1 at 50 Hz, an answer 0.4 rad behind, as text under two headers.
struct Rig {
    folder: TempDir,
}

impl Rig {
    fn new(header: &str, row: impl Fn(f64, f64, f64) -> String) -> Self {
        let folder = TempDir::new().unwrap();
        let mut text = format!("{header}\n");
        for index in 0..400 {
            let time_s = f64::from(index) * 1e-4;
            let angle = 2.0 * std::f64::consts::PI * 50.0 * time_s;
            text += &(row(time_s, angle.sin(), (angle - 0.4).sin()) + "\n");
        }
        std::fs::write(folder.path().join("rig.csv"), text).unwrap();
        Rig { folder }
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("rig.csv")
    }

    fn survey(&self, words: &[&str]) -> SurveyedTable {
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        table(Survey::of(&self.file(), &options(&words)).unwrap())
    }

    /// Read as it is proposed.
    fn read(&self) -> (SurveyedTable, MeasuredRun) {
        let survey = self.survey(&[]);
        let run = MeasuredRun::read(&self.file(), &options(&survey.columns));
        let run = run.unwrap_or_else(|refusal| panic!("{:?}: {refusal}", survey.columns));
        (survey, run)
    }
}

fn peak(run: &MeasuredRun, quantity: Quantity) -> f64 {
    let series = run.series(quantity).unwrap_or_else(|| panic!("no {quantity:?}"));
    series.iter().fold(0.0, |peak, value| value.abs().max(peak))
}

#[test]
fn every_format_is_listed() {
    for (name, rows) in [
        ("flat_v5.mat", 400),
        ("flat_v73.mat", 400),
        ("units.h5", 400),
        ("records.npy", 400),
        ("deflated.npz", 400),
        ("waveforms.tdms", 400),
        ("transposed.mf4", 400),
        ("zstd.mcap", 400),
        ("lz4.mcap", 100),
        ("run.parquet", 400),
    ] {
        let table = table(Survey::of(&fixture(name), &RunReadOptions::default()).unwrap());
        let clock = table.clock.unwrap_or_else(|| panic!("{name}: no clock"));
        let rate_hz = 1e4 * f64::from(rows) / 400.0;
        assert!(
            (clock.rate_hz() / rate_hz - 1.0).abs() < 1e-6,
            "{name}: {}",
            clock.rate_hz()
        );
        assert_eq!(
            (table.rows, clock.gaps, clock.backward),
            (rows as usize, 0, 0),
            "{name}"
        );
        let most = |quantity: &str| {
            let channel = table.channels.iter().find(|own| own.quantity == Some(quantity));
            let channel = channel.unwrap_or_else(|| panic!("{name}: no {quantity}"));
            channel.most * channel.scale + channel.offset
        };
        assert!(
            (most("command") / 20e3 - 1.0).abs() < 3e-3,
            "{name}: {}",
            most("command")
        );
        assert!(
            (most("displacement") / 40e-6 - 1.0).abs() < 3e-3,
            "{name}: {}",
            most("displacement")
        );
        assert!(table.columns.is_empty(), "{name}: {:?}", table.columns);
        assert!(
            table.uses[0].reads && table.uses[1].reads && !table.uses[2].reads,
            "{name}: {:?}",
            table.uses
        );
    }
}

/// Guards against an inch that is read as a metre.
#[test]
fn a_unit_that_is_not_known_wants_a_scale() {
    let rig = Rig::new("time_s,field_A_per_m,displacement_in", |time_s, drive, answer| {
        format!("{time_s},{},{}", 1e4 * drive, 1e-3 * answer)
    });
    let table = rig.survey(&[]);
    assert!(
        table.columns.iter().all(|own| !own.starts_with("displacement")),
        "{:?}",
        table.columns
    );
    let said = table.remarks.join("\n");
    assert!(said.contains("--column 'displacement=displacement_in*SCALE'"), "{said}");
    let read = |word: &str| MeasuredRun::read(&rig.file(), &options(&[word.to_owned()]));
    let refused = read("displacement=displacement_in").unwrap_err().to_string();
    assert!(refused.contains("names the unit in, which is not known"), "{refused}");
    assert!(read("displacement=displacement_in*0.0254").is_ok());
}

#[test]
fn foreign_names_with_units_are_proposed() {
    let rig = Rig::new(
        "Timestamp [ms];Drive voltage (V);PosX_um;pos_ref_um;Rod temp [°C]",
        |time_s, drive, answer| {
            format!(
                "{};{};{};{};21.5",
                1e3 * time_s,
                60.0 * drive,
                12.0 * answer,
                13.0 * drive
            )
        },
    );
    let (survey, run) = rig.read();
    assert!((run.tick_s.unwrap() - 1e-4).abs() < 1e-12);
    assert!(
        (peak(&run, Quantity::Voltage) / 60.0 - 1.0).abs() < 1e-3,
        "{:?}",
        survey.columns
    );
    assert!(
        (peak(&run, Quantity::Displacement) / 12e-6 - 1.0).abs() < 1e-3,
        "{:?}",
        survey.columns
    );
    assert_eq!(run.series(Quantity::Temperature).unwrap()[3], 294.65);
}

#[test]
fn a_unit_that_no_name_says_is_told_by_the_size() {
    let rig = Rig::new("t,I_coil,position", |time_s, drive, answer| {
        format!("{time_s},{},{}", 2.0 * drive, 9.0 * answer)
    });
    let (survey, run) = rig.read();
    // Nine metres it is not; nearest to what is usual are nine micrometres.
    assert!(
        (peak(&run, Quantity::Displacement) / 9e-6 - 1.0).abs() < 1e-3,
        "{:?}",
        survey.columns
    );
    let doubt = survey.channels[2].because.as_ref().unwrap();
    assert!(doubt.contains("by its size in µm: look whether it is"), "{doubt}");
}

/// Two columns that nobody has named: the one that comes behind is what answers, whichever stands first and whichever way up.
#[test]
fn without_a_name_what_comes_behind_is_the_answer() {
    for (header, sign) in [("one,two", 1.0), ("two,one", 1.0), ("one,two", -1.0), ("two,one", -1.0)] {
        let rig = Rig::new(header, |_, drive, answer| match header {
            "one,two" => format!("{drive},{}", sign * answer),
            _ => format!("{},{drive}", sign * answer),
        });
        let survey = rig.survey(&[]);
        assert_eq!(survey.columns, ["input=one", "output=two"], "{header} {sign}");
        assert!(survey.uses[1].reads, "{:?}", survey.uses);
    }
}

#[test]
fn what_cannot_be_known_is_asked_for() {
    let rig = Rig::new("sample,H [A/m],laser [V]", |time_s, drive, answer| {
        format!("{},{},{}", (time_s * 1e4).round(), 2e4 * drive, 3.0 * answer)
    });
    let survey = rig.survey(&[]);
    let says = |words: &str| survey.remarks.iter().any(|remark| remark.contains(words));
    assert!(says("--column 'time=sample*TICK'"), "{:?}", survey.remarks);
    assert!(says("--column 'displacement=laser [V]*SCALE'"), "{:?}", survey.remarks);
    assert!(!survey.uses[0].reads);
    // A law needs no unit.
    assert!(survey.uses[1].reads, "{:?}", survey.uses);
    // Answered, it is a run.
    let answered = rig.survey(&["time=sample*1e-4", "displacement=laser [V]*4e-6"]);
    assert!(answered.uses[0].reads, "{:?}", answered.uses);
    assert!((answered.clock.unwrap().step_s - 1e-4).abs() < 1e-12);
}

#[test]
fn gaps_holes_and_a_sign_are_told() {
    let rig = Rig::new(
        "time_s,field_command_A_per_m,displacement_um,note",
        |time_s, drive, answer| {
            let late_s = if time_s > 0.02 { 0.01 } else { 0.0 };
            let note = if time_s > 0.01 { "n/a" } else { "1" };
            format!("{},{},{},{note}", time_s + late_s, 2e4 * drive, -20.0 * answer)
        },
    );
    let survey = rig.survey(&[]);
    let clock = survey.clock.as_ref().unwrap();
    assert_eq!((clock.gaps, clock.missing, clock.listed[0].row), (1, 100, 201));
    assert_eq!(
        (survey.channels[3].not_numbers, survey.channels[3].first_not_number),
        (299, Some(101))
    );
    assert!(survey.uses[0].says.contains("--rows 0..201"), "{}", survey.uses[0].says);
    let part = RunReadOptions {
        rows: Some("0..201".parse().unwrap()),
        ..RunReadOptions::default()
    };
    let part = table(Survey::of(&rig.file(), &part).unwrap());
    let sign = part.remarks.iter().find(|remark| remark.contains("other sign"));
    assert!(
        sign.is_some_and(|remark| remark.contains("displacement=displacement_um*")),
        "{:?}",
        part.remarks
    );
    // What is advised is what is proposed.
    let turned = part
        .columns
        .iter()
        .any(|own| own.starts_with("displacement=displacement_um*-"));
    assert!(turned, "{:?}", part.columns);
}

/// Guards against a drive that is called x: letters alone count where both sides have one, else the one that comes first drives.
#[test]
fn letters_alone_do_not_say_who_drives() {
    for (header, proposed) in [
        ("t,x,y", ["input=x", "output=y"]),
        ("A,B,C", ["input=B", "output=C"]),
        ("t,u,x", ["voltage=u", "displacement=x*1e-6"]),
    ] {
        let rig = Rig::new(header, |time_s, drive, answer| {
            format!("{time_s},{},{}", 50.0 * drive, 20.0 * answer)
        });
        let columns = rig.survey(&[]).columns;
        let has = |own: &str| columns.iter().any(|column| column == own);
        assert!(proposed.iter().all(|own| has(own)), "{header}: {columns:?}");
    }
}

/// Guards a log with a few cells that are no numbers: its columns are told all the same, and what is proposed reads it.
#[test]
fn rows_with_a_torn_cell_are_proposed_to_be_left_out() {
    let rig = Rig::new("t_ms,drive (kA/m),gauge [um]", |time_s, drive, answer| {
        let row = (time_s * 1e4).round();
        let answer = match row {
            57.0 | 58.0 => "NaN".to_owned(),
            200.0 => String::new(),
            _ => (9.0 * answer).to_string(),
        };
        format!("{},{},{answer}", 1e3 * time_s, 20.0 * drive)
    });
    let survey = rig.survey(&[]);
    assert_eq!(survey.drop_rows, ["57..59", "200..201"]);
    assert_eq!(
        (survey.channels[2].left_out, survey.channels[2].first_not_number),
        (3, Some(57))
    );
    assert!(survey.uses[0].reads, "{:?}", survey.uses);
    let reading = RunReadOptions {
        drop_rows: survey.drop_rows.iter().map(|own| own.parse().unwrap()).collect(),
        ..options(&survey.columns)
    };
    let run = MeasuredRun::read(&rig.file(), &reading).unwrap();
    assert!((peak(&run, Quantity::Displacement) / 9e-6 - 1.0).abs() < 2e-3);
    // Where half of a column is missing it is no column of numbers.
    let gauge = |time_s: f64, _: f64, answer: f64| {
        let late = if time_s > 0.02 {
            "n/a".to_owned()
        } else {
            answer.to_string()
        };
        format!("{time_s},{late}")
    };
    assert!(Rig::new("time_s,gauge", gauge).survey(&[]).drop_rows.is_empty());
}

/// Guards what is pasted: a header that is not there is refused, and a scale beside a unit that the header names is not proposed again.
#[test]
fn what_is_named_wrongly_is_not_proposed() {
    let rig = Rig::new("time_s,field_A_per_m,displacement_um", |time_s, drive, answer| {
        format!("{time_s},{},{}", 2e4 * drive, 9.0 * answer)
    });
    let refused = Survey::of(&rig.file(), &options(&["field=nosuch".to_owned()])).unwrap_err();
    assert!(refused.to_string().contains("no column \"nosuch\""), "{refused}");
    let survey = rig.survey(&["field=field_A_per_m*1000"]);
    assert_eq!(survey.columns, ["field=field_A_per_m"]);
    assert!(survey.uses[0].reads, "{:?}", survey.uses);
}

/// Guards what a command is promised: without a field `estimate` reads nothing.
#[test]
fn a_voltage_is_nothing_for_estimate() {
    let rig = Rig::new("time_s,voltage_V,displacement_um", |time_s, drive, answer| {
        format!("{time_s},{},{}", 60.0 * drive, 9.0 * answer)
    });
    let survey = rig.survey(&[]);
    let of = |command: &str| survey.uses.iter().find(|own| own.commands == command).unwrap();
    assert!(of("diagnose").reads && !of("estimate").reads, "{:?}", survey.uses);
}

#[test]
fn what_is_no_table_is_refused_as_by_the_reader() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("torn.mf4");
    let whole = std::fs::read(fixture("plain.mf4")).unwrap();
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let refusal = |file: &Path| Survey::of(file, &RunReadOptions::default()).unwrap_err().to_string();
    let read = MeasuredRun::read(&file, &RunReadOptions::default())
        .unwrap_err()
        .to_string();
    assert_eq!(refusal(&file), read);
    assert!(read.contains("torn.mf4: is no MDF4 file that can be read"), "{read}");
}
