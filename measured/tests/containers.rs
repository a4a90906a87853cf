//! Files as other programs write them (`fixtures/write.py`): each holds the same run, and each must give it back, or be refused with a
//! sentence when it is torn or changed. Guards every format's reader, its units and its clock, and that no broken byte brings the
//! program down or takes memory that the file cannot justify.

use std::path::{Path, PathBuf};

use anhyst_measured::survey::Survey;
use anhyst_measured::{ColumnMapping, MeasuredRun, Quantity, RunReadOptions};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Broken files in the gate, over all fixtures.
const BROKEN_FILES: usize = 3000;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn read(name: &str, mappings: &[&str]) -> MeasuredRun {
    let mappings = mappings.iter().map(|mapping| mapping.parse::<ColumnMapping>().unwrap());
    let options = RunReadOptions {
        mappings: mappings.collect(),
        ..RunReadOptions::default()
    };
    MeasuredRun::read(&fixture(name), &options).unwrap_or_else(|refusal| panic!("{name}: {refusal}"))
}

fn near(name: &str, what: &str, value: f64, expected: f64, within: f64) {
    assert!(
        (value - expected).abs() <= within,
        "{name}: {what} is {value}, not {expected} within {within}"
    );
}

/// The run that `write.py` describes, every `step` samples of it.
fn holds_the_run(name: &str, run: &MeasuredRun, step: usize) {
    let samples = 400_usize.div_ceil(step);
    assert_eq!(run.len(), samples, "{name}");
    near(name, "tick", run.tick_s.unwrap(), 1e-4 * step as f64, 1e-9);
    let series = |quantity| {
        run.series(quantity)
            .unwrap_or_else(|| panic!("{name}: no {quantity:?}"))
    };
    for sample in 0..samples {
        let angle = 2.0 * std::f64::consts::PI * 50.0 * 1e-4 * (step * sample) as f64;
        near(
            name,
            "command",
            series(Quantity::FieldCommand)[sample],
            20e3 * angle.sin(),
            1e-6,
        );
        // Counts of 2 nm, and single precision.
        near(
            name,
            "displacement",
            series(Quantity::Displacement)[sample],
            40e-6 * (angle - 0.6).sin(),
            1.1e-9,
        );
    }
}

#[test]
fn every_format_gives_the_run_back() {
    for name in [
        "flat_v5.mat",
        "flat_v7.mat",
        "struct_v7.mat",
        "flat_v73.mat",
        "latest.h5",
        "records.h5",
        "records.npy",
        "stored.npz",
        "deflated.npz",
        "zstd.mcap",
        "run.parquet",
    ] {
        let run = read(name, &[]);
        holds_the_run(name, &run, 1);
        near(
            name,
            "temperature",
            run.series(Quantity::Temperature).unwrap()[7],
            294.65,
            1e-4,
        );
    }
    holds_the_run("lz4.mcap", &read("lz4.mcap", &[]), 4);
}

#[test]
fn units_beside_the_name_are_taken() {
    for name in ["units.h5", "plain.mf4", "deflated.mf4", "transposed.mf4"] {
        let run = read(name, &[]);
        holds_the_run(name, &run, 1);
        near(
            name,
            "temperature",
            run.series(Quantity::Temperature).unwrap()[7],
            294.65,
            1e-4,
        );
    }
    // Another rate, another table.
    let run = read("waveforms.tdms", &[]);
    holds_the_run("waveforms.tdms", &run, 1);
    assert!(run.series(Quantity::Temperature).is_none());
}

#[test]
fn a_channel_is_named_alone_or_with_its_group() {
    for mapping in [
        "displacement=displacement",
        "displacement=rig/displacement",
        "displacement=displacement [µm]",
    ] {
        holds_the_run(mapping, &read("units.h5", &[mapping]), 1);
    }
    // A matrix without names has numbers, and no clock.
    let run = read("plain.npy", &["command=column_0*1", "displacement=column_1*1"]);
    assert_eq!((run.len(), run.tick_s), (400, None));
    near(
        "plain.npy",
        "command",
        run.series(Quantity::FieldCommand).unwrap()[50],
        20e3,
        1.0,
    );
}

#[test]
fn what_no_reader_knows_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        MeasuredRun::read(&file, &RunReadOptions::default())
            .unwrap_err()
            .to_string()
    };
    let mut old = std::fs::read(fixture("plain.mf4")).unwrap();
    old[8..12].copy_from_slice(b"3.30");
    assert!(refusal("old.mf4", &old).contains("MDF of a version before 4"));
    old[..8].copy_from_slice(b"UnFinMF ");
    assert!(refusal("torn.mf4", &old).contains("never finalised"));
    let npz = std::fs::read(fixture("stored.npz")).unwrap();
    assert!(refusal("run.xlsx", &npz).contains("call it .npz"));
    assert!(
        refusal(
            "objects.npy",
            b"\x93NUMPY\x01\x00\x40\x00{'descr': '|O', 'fortran_order': False, 'shape': (3,), }         \n"
        )
        .contains("objects")
    );
    let mut daqmx = std::fs::read(fixture("waveforms.tdms")).unwrap();
    daqmx[4] |= 1 << 7;
    assert!(refusal("daqmx.tdms", &daqmx).contains("DAQmx"));
}

/// A file with some of its bytes changed, or its end missing.
fn broken(bytes: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut below = |limit: usize| (random.next_u64() % limit.max(1) as u64) as usize;
    let changes = below(8);
    for _ in 0..changes {
        // Headers stand at the beginning more often than not.
        let reach = if below(2) == 0 {
            bytes.len().min(2048)
        } else {
            bytes.len()
        };
        let at = below(reach);
        match below(3) {
            0 => bytes[at] ^= 1 << below(8),
            1 => bytes[at] = below(256) as u8,
            // A size that is far too large.
            _ => bytes.iter_mut().skip(at).take(8).for_each(|byte| *byte = 0xff),
        }
    }
    if changes == 0 || below(3) == 0 {
        bytes.truncate(below(bytes.len()));
    }
    bytes
}

/// `ANHYST_BROKEN_FILES` says how many.
#[test]
fn a_broken_file_is_read_or_refused_in_one_sentence() {
    let count = std::env::var("ANHYST_BROKEN_FILES")
        .ok()
        .map_or(BROKEN_FILES, |count| count.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let entries = std::fs::read_dir(fixture(""))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries
        .filter(|path| path.extension().is_some_and(|ending| ending != "py"))
        .collect();
    files.sort();
    assert!(files.len() > 15, "{files:?}");
    let (mut refused, mut read) = (0, 0);
    for index in 0..count {
        let whole = &files[index % files.len()];
        let mut random = ChaCha8Rng::seed_from_u64(index as u64);
        let file = folder.path().join(whole.file_name().unwrap());
        let bytes = broken(&std::fs::read(whole).unwrap(), &mut random);
        // Stands there if the reader brings the test down.
        std::fs::write(&file, bytes).unwrap();
        let options = RunReadOptions::default();
        // What is listed before it is read must stand as much.
        if index % 4 == 0 {
            let survey = std::panic::catch_unwind(|| Survey::of(&file, &options));
            assert!(
                survey.is_ok(),
                "broken file {index} of {} brings the survey down",
                whole.display()
            );
        }
        match std::panic::catch_unwind(|| MeasuredRun::read(&file, &options)) {
            Ok(Ok(_)) => read += 1,
            Ok(Err(refusal)) => {
                refused += 1;
                let refusal = refusal.to_string();
                assert!(
                    !refusal.contains('\n') && refusal.len() < 2000,
                    "{index} {}: {refusal}",
                    file.display()
                );
            }
            Err(_) => panic!("broken file {index} of {} brings the reader down", whole.display()),
        }
    }
    // Half of the bytes are numbers, and any number is as good as another.
    assert!(
        refused > count / 4 && read > count / 20,
        "{refused} refused and {read} read of {count}"
    );
}
