//! Guards the noise floor: what later counts as "the gap" is measured against it, so a floor that is wrong by a tenth
//! hides effects or invents them.

use std::f64::consts::TAU;

use anhyst_measured::{MeasuredRun, NoiseFloor, NoiseSource, Quantity, RunReadOptions, noise_floor, rests};
use anhyst_witness::shared;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Normal numbers with correlation φ from one to the next and standard deviation 1.
fn noise(samples: usize, autoregression: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = move || (f64::from(random.next_u32()) + 0.5) / (f64::from(u32::MAX) + 1.0);
    let mut normal = move || (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos();
    let drive = (1.0 - autoregression * autoregression).sqrt();
    let mut last = normal();
    (0..samples)
        .map(|_| {
            last = autoregression * last + drive * normal();
            last
        })
        .collect()
}

/// Signal of an actuator at 10 kHz: 40 µm at 50 and 150 Hz.
fn motion(sample: usize) -> f64 {
    let phase = TAU * 50.0 * sample as f64 * 1e-4;
    40e-6 * (phase.sin() + 0.3 * (3.0 * phase).sin())
}

fn sum(signal: impl Fn(usize) -> f64, noise: &[f64], rms: f64) -> Vec<f64> {
    noise
        .iter()
        .enumerate()
        .map(|(sample, noise)| signal(sample) + rms * noise)
        .collect()
}

/// The worst relative error of the rms over ten seeds.
fn worst(rms: f64, floor: impl Fn(u64) -> NoiseFloor) -> f64 {
    (0..10)
        .map(|seed| (floor(seed).rms / rms - 1.0).abs())
        .fold(0.0, f64::max)
}

#[test]
fn white_noise_under_a_signal_two_thousand_times_louder() {
    let of = |seed| noise_floor(&sum(motion, &noise(40_000, 0.0, seed), 20e-9), &[]).unwrap();
    let error = worst(20e-9, of);
    assert!(error < 0.03, "{error}");
    assert_eq!((of(0).from, of(0).resolution), (NoiseSource::Spectrum, None));
    assert!(of(0).autoregression.abs() < 0.05, "{:?}", of(0));
}

#[test]
fn the_colour_of_noise_is_seen_from_the_upper_band_alone() {
    // The redder the noise, the less the upper band says of it.
    for (autoregression, known) in [(0.3, 0.06), (0.6, 0.35), (-0.4, 0.03)] {
        let of = |seed| noise_floor(&sum(motion, &noise(40_000, autoregression, seed), 1e-6), &[]).unwrap();
        let (error, stated) = (worst(1e-6, of), of(1).relative_deviation);
        assert!(
            stated < known && error < 3.0 * stated,
            "{autoregression}: {error}, stated {stated}"
        );
        let seen = of(1).autoregression;
        assert!(
            (seen - autoregression).abs() < 0.15,
            "{seen} instead of {autoregression}"
        );
    }
}

#[test]
fn the_stated_deviation_is_the_one_that_is_found() {
    // White: the stated one allows for a colour too weak to be told from white. Coloured: the upper band shows less than it claims.
    for (autoregression, reached) in [(0.0, 0.4..0.55), (0.4, 1.2..1.6)] {
        let of = |seed| noise_floor(&noise(10_000, autoregression, seed), &[]).unwrap();
        let floors: Vec<NoiseFloor> = (0..40).map(of).collect();
        let scores: f64 = floors
            .iter()
            .map(|of| ((of.rms - 1.0) / of.relative_deviation).powi(2))
            .sum();
        let ratio = (scores / 40.0).sqrt();
        assert!(reached.contains(&ratio), "{autoregression}: {ratio} times as stated");
    }
}

/// Kinks of a triangle and steps of a staircase reach into the upper band; interference is a line in it.
#[test]
fn kinks_steps_and_lines_are_no_noise() {
    let staircase = |sample: usize| 1e-5 * ((sample / 800) % 7) as f64;
    let triangle = |sample: usize| 4e-7 * ((sample % 500) as f64 - 250.0).abs();
    let line = |sample: usize| 1e-7 * (2.2 * sample as f64).sin();
    let signals: [&dyn Fn(usize) -> f64; 3] = [&staircase, &triangle, &line];
    for (index, signal) in signals.into_iter().enumerate() {
        let error = worst(20e-9, |seed| {
            noise_floor(&sum(signal, &noise(40_000, 0.0, seed), 20e-9), &[]).unwrap()
        });
        assert!(error < 0.08, "signal {index}: {error}");
    }
}

#[test]
fn rounding_is_part_of_the_floor() {
    let step = 100e-9;
    let round = |x: &f64| (x / step).round() * step;
    let moving: Vec<f64> = sum(motion, &noise(20_000, 0.0, 1), 1e-9).iter().map(round).collect();
    let floor = noise_floor(&moving, &[]).unwrap();
    assert!((floor.resolution.unwrap() / step - 1.0).abs() < 1e-3, "{floor:?}");
    assert!((floor.rms / (step / 12_f64.sqrt()) - 1.0).abs() < 0.15, "{floor:?}");
    // A held value is silent, but the next movement is rounded again.
    let held: Vec<f64> = (0..4000).map(|sample| step * f64::from(sample / 100)).collect();
    let floor = noise_floor(&held, &[]).unwrap();
    assert!(floor.rms > 0.99 * step / 12_f64.sqrt(), "{floor:?}");
}

/// At rest nearly the whole band is seen, so strong colour is too; a run's command says where its rests are.
#[test]
fn rests_of_the_command_show_the_colour_below_the_band() {
    let command: Vec<f64> = (0..20_000)
        .map(|s| if s % 2000 < 1000 { 2e4 * motion(s) } else { 0.3 })
        .collect();
    let noise = noise(20_000, 0.8, 5);
    let displacement = sum(|s| if s % 2000 < 1000 { motion(s) } else { 1e-5 }, &noise, 1e-6);
    let series = vec![
        (Quantity::FieldCommand, command),
        (Quantity::Displacement, displacement),
    ];
    let run = MeasuredRun::in_memory("made", Some(1e-4), series).unwrap();
    assert_eq!((rests(&run).len(), rests(&run)[0].clone()), (10, 1000..2000));
    let floor = run.noise(Quantity::Displacement).unwrap();
    assert_eq!(floor.from, NoiseSource::Rest);
    assert!(floor.relative_deviation < 0.12, "{floor:?}");
    assert!(
        (floor.rms / 1e-6 - 1.0).abs() < 2.5 * floor.relative_deviation,
        "{floor:?}"
    );
    assert!((floor.autoregression - 0.8).abs() < 0.08, "{floor:?}");
    assert!((floor.samples_per_independent() - 9.0).abs() < 4.0, "{floor:?}");
}

/// The creep after a step is a slow movement, not noise.
#[test]
fn creep_in_a_rest_is_no_noise() {
    let creep = |s: usize| 1e-6 * (1.0 + (s % 4000) as f64).ln();
    let command: Vec<f64> = (0..20_000).map(|s| f64::from(s / 4000)).collect();
    let displacement = sum(creep, &noise(20_000, 0.0, 2), 20e-9);
    let series = vec![
        (Quantity::FieldCommand, command),
        (Quantity::Displacement, displacement),
    ];
    let run = MeasuredRun::in_memory("made", Some(1e-4), series).unwrap();
    let floor = run.noise(Quantity::Displacement).unwrap();
    assert!((floor.rms / 20e-9 - 1.0).abs() < 0.05, "{floor:?}");
    assert_eq!(floor.autoregression, 0.0);
}

#[test]
fn too_little_data_have_no_floor() {
    assert_eq!(noise_floor(&[0.0; 63], &[]), None);
    let short = noise_floor(&noise(64, 0.0, 1), &[]).unwrap();
    assert!(
        (0.5..2.0).contains(&short.rms) && short.relative_deviation > 0.05,
        "{short:?}"
    );
    assert_eq!(noise_floor(&[3.0; 100], &[]).unwrap().rms, 0.0);
}

/// Runs of an independent simulator with 20 nm rms on the displacement and 1 A/m rms on the measured field.
#[test]
fn runs_of_another_simulator_have_the_noise_that_was_put_in() {
    let Some(folder) = shared("hidden") else { return };
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|ending| ending == "csv"))
        .collect();
    files.sort();
    assert!(!files.is_empty());
    for file in files {
        let run = MeasuredRun::read(&file, &RunReadOptions::default()).unwrap_or_else(|refusal| panic!("{refusal}"));
        for (quantity, rms) in [(Quantity::Displacement, 20e-9), (Quantity::Field, 1.0)] {
            let floor = run.noise(quantity).unwrap();
            println!(
                "{}: {} {:.4e} from {:?}",
                run.source,
                quantity.name(),
                floor.rms,
                floor.from
            );
            assert!((floor.rms / rms - 1.0).abs() < 0.1, "{}: {floor:?}", run.source);
        }
    }
}
