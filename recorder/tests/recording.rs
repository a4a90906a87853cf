//! What is recorded can be read back: every tick, every bit, whatever the end of the run was like.

use anhyst_ipc::{
    Block, CoilField, Demand, Estimate, FieldCommand, MAX_FIELDS, Measurement, Message, Now, SafeField, Truth,
    status_word,
};
use anhyst_recorder::{
    EventName, Level, Recorder, RecorderError, RecorderSettings, Recording, RunInfo, each_stretch, read_tokens,
};
use std::path::{Path, PathBuf};

/// Not a whole number of µs, and ns that have to be rounded: time stamps must still give the ticks back.
const TICK_S: f64 = 1.0 / 19_999.0;
const TICKS: u64 = 50_000;

fn info(path: PathBuf) -> RunInfo {
    RunInfo {
        path,
        realtime: false,
        run_id: "test-run".into(),
        name: "test".into(),
        notes: String::new(),
        tick_s: TICK_S,
        tolerance_m: 1e-6,
        settling_time_s: 0.1,
        period_s: None,
        parameter_range: [6300.0, 7300.0],
        material: [7.65e5, 4000.0, 0.18],
        scales: anhyst_recorder::Scales::default(),
        field_limit_a_per_m: 40e3,
        lowest_field_a_per_m: -40e3,
        events: vec![EventName {
            number: 7,
            text: "seven happened".into(),
            level: Level::Error,
        }],
    }
}

/// A token with every bit pattern that a careless copy would damage: NaN payloads, −0, subnormals, infinities, all 64 flags.
fn token<M: Message>(tick: u64) -> M {
    const HARD: [u64; 6] = [
        0x7FF8_0000_DEAD_BEEF,
        0xFFF0_0000_0000_0001,
        1 << 63,
        1,
        0x7FF0_0000_0000_0000,
        0xFFF0_0000_0000_0000,
    ];
    let mut words = [0; MAX_FIELDS];
    for ((at, word), field) in (0u64..).zip(&mut words).zip(M::FIELDS) {
        let mixed = (tick + 1)
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .wrapping_add(at.wrapping_mul(0xBF58_476D_1CE4_E5B9));
        *word = match field.kind {
            anhyst_ipc::FieldKind::U64 if tick % 100 == 3 => u64::MAX,
            anhyst_ipc::FieldKind::U64 => mixed,
            anhyst_ipc::FieldKind::F64 if mixed % 17 == 0 => HARD[(mixed >> 32) as usize % HARD.len()],
            anhyst_ipc::FieldKind::F64 => f64::to_bits((mixed as f64 - 9e18) * 1e-20),
        };
    }
    M::from_words(tick, &words)
}

fn inputs(tick: u64) -> <Recorder as Block>::Inputs {
    (
        Now(token(tick)),
        Now(token(tick)),
        Now(token(tick)),
        Now(token(tick)),
        Now(token(tick)),
        Now(token(tick)),
        Now(token(tick)),
    )
}

fn calm(tick: u64) -> <Recorder as Block>::Inputs {
    let mut inputs = (
        Now(Measurement::default()),
        Now(Truth {
            shape_a_per_m: 7000.0,
            ..Truth::default()
        }),
        Now(Estimate::default()),
        Now(Demand::default()),
        Now(FieldCommand::default()),
        Now(SafeField::default()),
        Now(CoilField::default()),
    );
    inputs.0.0.stamp(tick, 0);
    inputs
}

fn bits<M: Message>(token: &M) -> (u64, [u64; MAX_FIELDS]) {
    let mut words = [0; MAX_FIELDS];
    token.write_words(&mut words);
    (token.tick(), words)
}

fn assert_same<M: Message>(recording: &Recording, ticks: u64) {
    let read: Vec<M> = recording.tokens().unwrap();
    assert_eq!(read.len() as u64, ticks, "rows of {}", M::CHANNEL);
    for (tick, got) in (0..ticks).zip(&read) {
        assert_eq!(bits(got), bits(&token::<M>(tick)), "{} of tick {tick}", M::CHANNEL);
    }
}

fn record(path: &Path, ticks: u64) -> Recorder {
    let mut recorder = Recorder::create(&RecorderSettings::default(), info(path.into())).unwrap();
    (0..ticks).for_each(|tick| recorder.step(tick, inputs(tick)));
    recorder
}

/// Guards replay: all seven channels come back with the same ticks and the same bits.
#[test]
fn every_bit_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let report = record(&path, TICKS).finish().unwrap();
    assert_eq!((report.rows, report.dropped), (TICKS, 0));
    assert_eq!(report.bytes, std::fs::metadata(&path).unwrap().len());
    let recording = Recording::open(&path).unwrap();
    assert!(recording.closed());
    assert_eq!(recording.tick_s(), TICK_S);
    assert_same::<Measurement>(&recording, TICKS);
    assert_same::<Truth>(&recording, TICKS);
    assert_same::<Estimate>(&recording, TICKS);
    assert_same::<Demand>(&recording, TICKS);
    assert_same::<FieldCommand>(&recording, TICKS);
    assert_same::<SafeField>(&recording, TICKS);
    assert_same::<CoilField>(&recording, TICKS);
    assert!(path.with_extension("rbl").exists(), "the layout is missing");
}

fn parts_in(folder: &Path) -> Vec<PathBuf> {
    let name = |part: u64| match part {
        1 => "run.rrd".to_owned(),
        _ => format!("run-{part}.rrd"),
    };
    (1..=9)
        .map(|part| folder.join(name(part)))
        .filter(|path| path.exists())
        .collect()
}

/// Guards long runs: parts follow each other without a lost or repeated tick, and each is whole in itself.
#[test]
fn parts_hold_every_bit_once() {
    let folder = tempfile::tempdir().unwrap();
    let settings = RecorderSettings {
        block_ticks: 1000,
        part_s: Some(8000.0 * TICK_S),
        ..RecorderSettings::default()
    };
    let mut recorder = Recorder::create(&settings, info(folder.path().join("run.rrd"))).unwrap();
    (0..20_500).for_each(|tick| recorder.step(tick, inputs(tick)));
    let report = recorder.finish().unwrap();
    let parts = parts_in(folder.path());
    assert_eq!((report.rows, report.parts, parts.len()), (20_500, 3, 3));
    let sizes = parts.iter().map(|part| std::fs::metadata(part).unwrap().len());
    assert_eq!(report.bytes, sizes.sum::<u64>());
    let whole = Recording::of_parts(&parts).unwrap();
    assert!(whole.closed());
    assert_same::<Measurement>(&whole, 20_500);
    assert_same::<Estimate>(&whole, 20_500);
    let second: Vec<Truth> = read_tokens(&parts[1]).unwrap();
    assert_eq!((second[0].tick, second.len()), (8000, 8000));
    let mut next = 0;
    each_stretch::<RecorderError>(&parts, |stretch| {
        assert_eq!(stretch.first(), next);
        next += stretch.ticks() as u64;
        Ok(())
    })
    .unwrap();
    assert_eq!(next, 20_500);
}

/// Guards the ring: what came before an event, and after it, is kept with its bits; of what is quiet only the end.
#[test]
fn a_ring_keeps_what_came_before_an_event() {
    let folder = tempfile::tempdir().unwrap();
    let settings = RecorderSettings {
        block_ticks: 500,
        ring_s: Some(1000.0 * TICK_S),
        ..RecorderSettings::default()
    };
    let mut recorder = Recorder::create(&settings, info(folder.path().join("run.rrd"))).unwrap();
    for tick in 0..9000 {
        let mut inputs = calm(tick);
        inputs.5.0.event = if tick == 4700 { 7 } else { 0 };
        recorder.step(tick, inputs);
    }
    let report = recorder.finish().unwrap();
    let recording = Recording::of_parts(&parts_in(folder.path())).unwrap();
    let tokens: Vec<SafeField> = recording.tokens().unwrap();
    let ticks: Vec<u64> = tokens.iter().map(|token| token.tick).collect();
    assert!(
        ticks.iter().copied().eq((3000..6000).chain(7000..9000)),
        "{} ticks",
        ticks.len()
    );
    assert_eq!((report.rows, report.removed_rows, report.parts), (9000, 4000, 5));
    assert!(
        recording
            .events()
            .iter()
            .any(|(_, _, text)| text.contains("seven happened"))
    );
}

/// Guards ticks that were left out: those after a gap keep their numbers.
#[test]
fn ticks_after_a_gap_keep_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let mut recorder = Recorder::create(&RecorderSettings::default(), info(path.clone())).unwrap();
    let there = || (0..700).chain(900..1000).chain([1500]);
    there().for_each(|tick| recorder.step(tick, inputs(tick)));
    recorder.finish().unwrap();
    let read: Vec<Demand> = read_tokens(&path).unwrap();
    assert!(
        read.iter()
            .map(bits)
            .eq(there().map(|tick| bits(&token::<Demand>(tick))))
    );
}

/// Guards: a run that failed and dropped its recorder keeps the partial block, and its outcome can still be asked for.
#[test]
fn a_dropped_recorder_keeps_what_it_heard() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let recorder = record(&path, 1234);
    let outcome = recorder.outcome();
    assert_eq!(outcome.report(), Err(RecorderError::StillOpen));
    drop(recorder);
    assert_eq!(outcome.report().unwrap().rows, 1234);
    let recording = Recording::open(&path).unwrap();
    assert_same::<Estimate>(&recording, 1234);
    assert!(
        recording
            .events()
            .iter()
            .any(|(_, _, text)| text.contains("not finished"))
    );
}

/// Guards: the file of a killed process (no footer, torn last message) is readable up to its last whole block.
#[test]
fn a_torn_file_is_read_up_to_the_tear() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    record(&path, 20_000).finish().unwrap();
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() * 6 / 10]).unwrap();
    let recording = Recording::open(&path).unwrap();
    assert!(!recording.closed());
    let read: Vec<Measurement> = recording.tokens().unwrap();
    assert!(
        read.len() >= 4000 && read.len().is_multiple_of(4000),
        "{} rows",
        read.len()
    );
    assert_same::<Measurement>(&recording, read.len() as u64);
}

/// Guards the event table: bits and event numbers become sentences at the right time, start and end are told.
#[test]
fn events_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let mut recorder = Recorder::create(&RecorderSettings::default(), info(path.clone())).unwrap();
    for tick in 0..10_000 {
        let mut inputs = calm(tick);
        inputs.3.0.status = status_word([((2000..6000).contains(&tick), Demand::INTEGRATION_STOPPED)]);
        inputs.4.0.status = status_word([(tick >= 3000, FieldCommand::LIMITED)]);
        inputs.5.0.event = if tick == 5000 { 7 } else { 0 };
        inputs.5.0.status = status_word([(tick >= 5000, SafeField::RAMPING)]);
        recorder.step(tick, inputs);
    }
    recorder.conclude(Level::Error, "NOT held: seven happened".into());
    recorder.finish().unwrap();
    let recording = Recording::open(&path).unwrap();
    let events = recording.events();
    // What the run came to is the first that is read.
    assert_eq!(
        (events[0].1.as_str(), events[0].2.as_str()),
        ("verdict", "verdict: NOT held: seven happened")
    );
    let told = |tick: u64, source: &str, words: &str| {
        let time = tick as f64 * TICK_S;
        assert!(
            events
                .iter()
                .any(|(t, s, text)| (t - time).abs() < 1e-8 && s == source && text.contains(words)),
            "`{words}` of {source} at {time} s is missing in {events:#?}"
        );
    };
    told(0, "run", "starts");
    told(2000, "controller", "anti-windup");
    told(6000, "controller", "integrates again");
    told(3000, "inverse", "more field than the limit");
    told(5000, "guard", "seven happened");
    told(5000, "guard", "ramps to the safe field");
    told(9999, "run", "ended after 10000 ticks");
    assert_eq!(events.len(), 8, "{events:#?}");
}

/// Guards: files that are no recordings, and recordings that hold nothing, are refused with a sentence.
#[test]
fn what_cannot_be_read_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let absent = read_tokens::<Truth>(&path).unwrap_err();
    assert!(absent.to_string().starts_with("cannot read the recording"), "{absent}");
    std::fs::write(&path, "no recording at all, but long enough for a header").unwrap();
    assert!(matches!(read_tokens::<Truth>(&path), Err(RecorderError::Read { .. })));
    record(&path, 0).finish().unwrap();
    assert!(matches!(
        read_tokens::<Truth>(&path),
        Err(RecorderError::NoTokens { .. })
    ));
}

/// Guards: settings are refused by name before any file is touched; a place that cannot be written is told.
#[test]
fn wrong_settings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let settings = RecorderSettings {
        block_ticks: 1,
        ..RecorderSettings::default()
    };
    let error = Recorder::create(&settings, info(path.clone())).err().unwrap();
    assert!(error.to_string().contains("block_ticks: 1 ticks is outside"), "{error}");
    assert!(!path.exists());
    let nowhere = folder.path().join("no/such/folder/run.rrd");
    assert!(matches!(
        Recorder::create(&RecorderSettings::default(), info(nowhere)),
        Err(RecorderError::Create { .. })
    ));
}

/// Guards: live viewers are served beside the file; a taken port is an error and leaves an old recording alone.
#[test]
fn live_is_served_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let taken = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let port = taken.local_addr().unwrap().port();
    let settings = RecorderSettings {
        live: Some(port),
        ..RecorderSettings::default()
    };
    std::fs::write(&path, "an old recording").unwrap();
    assert!(matches!(
        Recorder::create(&settings, info(path.clone())),
        Err(RecorderError::Live { .. })
    ));
    assert_eq!(std::fs::read(&path).unwrap(), b"an old recording");
    drop(taken);
    let mut recorder = Recorder::create(&settings, info(path.clone())).unwrap();
    (0..9000).for_each(|tick| recorder.step(tick, inputs(tick)));
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert!(
        std::net::TcpStream::connect(("127.0.0.1", port)).is_ok(),
        "nobody listens for viewers"
    );
    assert_eq!(recorder.finish().unwrap().rows, 9000);
    assert_same::<Truth>(&Recording::open(&path).unwrap(), 9000);
}
