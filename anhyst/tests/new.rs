//! Guards `anhyst new`: wishes drawn at random within what can be had give scenarios that pass the check and hold when run; wishes
//! beyond are refused with the limit. ANHYST_WISHES=50 draws fifty instead of six.

use anhyst::cli::{Command, parse};
use anhyst::design::{Actuator, Profile, Wish, design};
use anhyst_launch::embedded::judged;
use anhyst_launch::summary::Summary;
use anhyst_scenario::{Placement, load_changed};
use clap::ValueEnum;
use std::path::Path;

fn wish(words: &[String]) -> Wish {
    let all = ["anhyst", "new"].into_iter().chain(words.iter().map(String::as_str));
    match parse(all.map(Into::into)).unwrap().command {
        Command::New(own) => own.wish,
        other => panic!("{other:?}"),
    }
}

fn said(words: &str) -> Wish {
    wish(&words.split(' ').map(str::to_owned).collect::<Vec<_>>())
}

/// SplitMix64.
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((word ^ (word >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.between(0.0, all.len() as f64) as usize]
    }
}

/// Words of a wish within what its actuator can do.
fn drawn(draw: &mut Draw, folder: &Path) -> Vec<String> {
    let materials = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/materials");
    let preisach = format!("{materials}/piezo_stage_preisach.ron");
    let measured = format!("{materials}/terfenol_d_measured.ron");
    let all = ["terfenol", "terfenol-measured", "piezo", "magnet", &preisach, &measured];
    let material = *draw.one_of(&all);
    let mut words = vec!["drawn".to_owned(), "--material".into(), material.to_owned()];
    let rod = material.contains("terfenol");
    if rod && draw.between(0.0, 1.0) < 0.5 {
        let (length_mm, mass_kg) = (draw.between(60.0, 200.0), draw.between(0.1, 1.0));
        words.extend([format!("--length={length_mm:.0}mm"), format!("--mass={mass_kg:.2}kg")]);
    }
    if !rod && draw.between(0.0, 1.0) < 0.5 {
        words.push(format!("--resonance={:.0}Hz", draw.between(300.0, 2000.0)));
    }
    let profile = *draw.one_of(Profile::value_variants());
    words.push(format!("--profile={}", profile.to_possible_value().unwrap().get_name()));
    let actuator = Actuator::of(&wish(&words), folder).unwrap();
    let unit = actuator.units()[1].to_owned();
    let [low, high] = actuator.gives(None);
    let stroke = 0.9 * (high - low) * draw.between(0.1, 1.0);
    words.push(format!("--stroke={stroke:e}{unit}"));
    let natural_hz = actuator.rod.natural_frequency_hz();
    let usual_hz = actuator
        .preset
        .and_then(|preset| preset.bandwidth_hz)
        .unwrap_or(f64::MAX);
    let mut most_hz = (0.5 * natural_hz).min(usual_hz);
    if draw.between(0.0, 1.0) < 0.5 {
        let bandwidth_hz = natural_hz * draw.between(1.0, 5.0);
        most_hz = (0.5 * natural_hz).min(bandwidth_hz);
        words.push(format!("--bandwidth={bandwidth_hz:.0}Hz"));
    }
    let frequency_hz = most_hz / profile.busiest() * draw.between(0.05, 0.99);
    words.push(format!("--frequency={frequency_hz:.2}Hz"));
    let noise = stroke * 10_f64.powf(-draw.between(2.5, 5.0));
    words.push(format!("--noise={noise:e}{unit}"));
    words
}

#[test]
fn wishes_within_the_limits_hold() {
    let wishes = std::env::var("ANHYST_WISHES").map_or(6, |wishes| wishes.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let mut draw = Draw(16);
    let mut failed = Vec::new();
    for number in 0..wishes {
        let words = drawn(&mut draw, folder.path());
        let file = folder.path().join(format!("{number}.ron"));
        let told = words.join(" ");
        let found = match design(&wish(&words), &file) {
            Ok(found) => found,
            Err(error) => {
                failed.push(format!("{number}: {told}: {error}"));
                continue;
            }
        };
        std::fs::write(&file, &found.text).unwrap();
        // As `check` and `run` read it.
        let scenario = load_changed(&file, &[], |scenario| {
            scenario.placement = Placement::Embedded;
            scenario.recording.on = false;
        });
        let scenario = scenario.unwrap_or_else(|error| panic!("{told}: {error}\n{}", found.text));
        let summary = Summary::new(&scenario, &judged(&scenario).unwrap());
        if !summary.held || summary.verdict.guarded_ticks > 0 {
            failed.push(format!("{number}: {told}: {:?}", summary.failures));
        }
        println!("{number}: {told}: off by {:e}, {:.4} of the stroke", found.error_max, {
            let stroke = words.iter().find_map(|word| word.strip_prefix("--stroke=")).unwrap();
            let stroke: f64 = stroke.trim_end_matches(['m', 'T']).parse().unwrap();
            found.error_max / stroke
        });
    }
    assert!(
        failed.is_empty(),
        "{} of {wishes}:\n{}",
        failed.len(),
        failed.join("\n")
    );
}

#[test]
fn wishes_beyond_the_limits_are_refused_with_the_limit() {
    let file = Path::new("x.ron");
    for (words, limit) in [
        ("x --stroke=1mm", "ask for at most"),
        ("x --stroke=1mm", "--length "),
        ("x --stroke=80um --limit=1kA/m", "with 1.000 kA/m"),
        ("x --material=piezo --stroke=80um --limit=300V", "up to 100.0 V,"),
        ("x --material=piezo --stroke=40um --limit=50V", "with 50.00 V"),
        ("x --length=80", "as in --length 115mm"),
        (
            "x --material=piezo --stroke=80um",
            "within the inputs that its law was fitted to, up to 100.0 V,",
        ),
        ("x --frequency=1kHz", "half of the resonance is at 637"),
        (
            "x --material=piezo --frequency=100Hz --profile=raster",
            "ask for at most 20.80 Hz",
        ),
        ("x --bandwidth=20Hz --frequency=50Hz", "the amplifier ends at 20.00 Hz"),
        ("x --rate=2kHz", "outside [10.2"),
        ("x --noise=10um", "at most 4.000"),
        ("x --frequency=0.001Hz", "ask for at least"),
        (
            "x --stroke=80V",
            "give a positive number with its unit, m, as in --stroke 80um",
        ),
        (
            "x --material=piezo --limit=120",
            "--limit 120: give a positive number with its unit, V, as in --limit 120V",
        ),
        ("x --material=piezzo", "is piezo meant?"),
        (
            "x --material=materials/magnet_plays.ron",
            "in the program is built-in/materials/magnet_plays.ron",
        ),
        ("x --resonance=100Hz", "are for stages and magnets"),
        ("x --material=piezo --length=10mm", "is for a rod"),
        ("x --material=ghost", "terfenol, terfenol-measured, piezo, magnet"),
    ] {
        let error = design(&said(words), file)
            .err()
            .unwrap_or_else(|| panic!("{words}"))
            .to_string();
        assert!(error.contains(limit), "{words}: {error}");
    }
}

/// Guards what a fitted law's data told beside it: noise, lag and delay come into the scenario, and whatever else was not asked for is named.
#[test]
fn a_law_brings_its_delay_lag_and_noise() {
    let folder = tempfile::tempdir().unwrap();
    let law = folder.path().join("law.ron");
    let designed = |delay_s: f64, lag_s: f64, more: &str| {
        let text = format!(
            "(input: Voltage, output: Displacement, start: Rest, input_extent: (0.0, 100.0), reaction: (delay_s: {delay_s:e}, lag_s: {lag_s:e}), \
             noise_rms: 4e-9, model: (offset: 0.0, slope: 3e-7, laws: [Plays(groups: [(warp: Straight, radii: [10.0], weights: [1e-7])])]))"
        );
        std::fs::write(&law, text).unwrap();
        let words = format!("mine --material={} {more}", law.display());
        design(&said(&words), &folder.path().join("mine.ron")).unwrap()
    };
    let found = designed(5e-4, 0.0, "--frequency=5Hz");
    let ticks = (5e-4 / found.scenario.tick_s).round() as u32;
    assert_eq!(found.scenario.amplifier.delay_ticks, ticks);
    assert!(found.text.contains("displacement_noise_m: 4e-9"), "{}", found.text);
    let assumed = found.assumed.join("\n");
    for words in [
        "--stroke",
        "a sine (--profile)",
        "a loop at 10.00 kHz (--rate)",
        "4.000 nm rms, that of the law's data (--noise)",
        "--limit",
        "no more than 120.0 V (--limit); its law was fitted to inputs up to 100.0 V",
        "no less than −20.00 V (guard.lowest_field_a_per_m)",
        "--resonance",
        &format!("the delay of 500.0 µs that the law's data told, as the amplifier's: {ticks} ticks"),
    ] {
        assert!(assumed.contains(words), "no {words} in {assumed}");
    }
    assert!(!assumed.contains("--frequency"), "{assumed}");
    assert_eq!(found.scenario.guard.lowest_field_a_per_m, Some(-20.0));
    let late = designed(0.1, 0.0, "--frequency=5Hz");
    assert_eq!(late.scenario.amplifier.delay_ticks, 0);
    assert!(late.assumed.join("").contains("at most 63 ticks"), "{:?}", late.assumed);
    // 79.58 Hz: what a raster does at twelve times its lines' frequency must be below, and is where nothing is said of it.
    let lagging = designed(0.0, 2e-3, "--profile=raster");
    assert_eq!(lagging.scenario.amplifier.bandwidth_hz, Some(79.58));
    assert!(
        lagging.text.contains("Raster(") && lagging.scenario.tick_s > 0.0,
        "{}",
        lagging.text
    );
    let assumed = lagging.assumed.join("\n");
    for words in [
        "repeats at 5.000 Hz",
        "the lag of 2.000 ms that the law's data told",
        "ends at 79.58 Hz (--bandwidth)",
    ] {
        assert!(assumed.contains(words), "no {words} in {assumed}");
    }
    // A limit below a fifth of the data's end holds both ways.
    let small = designed(0.0, 0.0, "--frequency=5Hz --stroke=1um --limit=15V");
    assert_eq!(small.scenario.guard.lowest_field_a_per_m, Some(-15.0));
    let told = designed(0.0, 2e-3, "--frequency=5Hz --bandwidth=1kHz");
    assert_eq!(told.scenario.amplifier.bandwidth_hz, Some(1000.0));
    assert!(!told.assumed.join("").contains("the lag"), "{:?}", told.assumed);
}

/// Guards the order of refusals: an option that cannot be had is told before that the file is there.
#[test]
fn a_wrong_option_is_told_before_a_file_that_is_there() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mine.ron"), "").unwrap();
    let out = folder.path().to_string_lossy();
    for (option, sentence) in [
        ("--limit=30", "--limit 30: give"),
        ("--limit=30kA/m", "is there already"),
    ] {
        let words = ["anhyst", "new", "mine", "--out", &out, "--no-questions", option];
        let Command::New(own) = parse(words.map(Into::into)).unwrap().command else {
            panic!("no new")
        };
        let refused = anhyst::commands::new::run(&own).unwrap_err().to_string();
        assert!(refused.contains(sentence), "{refused}");
    }
}
