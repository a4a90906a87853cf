//! Guards `fit --law` on measured ferrites and on made relays, counted one by one: nothing here shares code with the laws.

use anhyst_identify::laws::{Family, LawData, LawFit, LawOptions, LawRecord, Start, fit_laws, predict};
use anhyst_measured::{MeasuredRun, Quantity, RunReadOptions};
use std::path::Path;

fn fitted(family: Option<Family>, data: &LawData) -> LawFit {
    fit_laws(family, data, &LawOptions::default(), 2, &|_, _| ()).unwrap()
}

fn ferrite(kept: impl Fn(usize) -> bool) -> LawData {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mnzn_ferrite_4amp.csv");
    let runs = MeasuredRun::read_records(&file, &RunReadOptions::default()).unwrap();
    let kept: Vec<MeasuredRun> = (0..runs.len())
        .filter(|own| kept(*own))
        .map(|own| runs[own].clone())
        .collect();
    LawData::of(&kept, None, None).unwrap()
}

/// All amplitudes by one set of numbers, and each of the larger ones by a fit that has not seen it.
#[test]
fn a_measured_ferrite_is_described_and_predicted() {
    let joint = fitted(None, &ferrite(|_| true));
    assert!(joint.report.nrmse <= 0.0045, "{:?}", joint.report);
    assert_eq!(joint.file.start, Start::Cycled);
    for (left_out, limit) in [(1, 0.025), (2, 0.025), (3, 0.05)] {
        let found = fitted(None, &ferrite(|own| own != left_out));
        let error = predict(&found.file, &ferrite(|own| own == left_out)).error;
        assert!(
            error.rms <= limit * error.range,
            "{left_out}: {error:?} by {}",
            found.report.law
        );
    }
}

/// Relays on a grid over the half plane, of coercivities about `h`.
struct Relays {
    up: Vec<f64>,
    down: Vec<f64>,
    weight: Vec<f64>,
    is_up: Vec<bool>,
}

impl Relays {
    fn new(h: f64) -> Self {
        const FINE: i32 = 90;
        let level = |index: i32| f64::from(2 * index + 1) / f64::from(FINE);
        let mut relays = Relays {
            up: vec![],
            down: vec![],
            weight: vec![],
            is_up: vec![],
        };
        for up in -FINE..FINE {
            for down in -FINE..=up {
                let (coercive, shifted) = (0.5 * (level(up) - level(down)), 0.5 * (level(up) + level(down)));
                let density = (-((coercive - h) / 0.12).powi(2) - (shifted / 0.2).powi(2)).exp();
                relays.up.push(level(up));
                relays.down.push(level(down));
                relays.weight.push(density);
                relays.is_up.push(shifted < 0.0);
            }
        }
        let sum: f64 = relays.weight.iter().sum();
        relays.weight.iter_mut().for_each(|weight| *weight /= sum);
        relays
    }

    fn switch(&mut self, input: f64) -> f64 {
        let mut sum = 0.0;
        for relay in 0..self.up.len() {
            self.is_up[relay] = input >= self.up[relay] || self.is_up[relay] && input > self.down[relay];
            sum += if self.is_up[relay] { self.weight[relay] } else { 0.0 };
        }
        sum
    }
}

/// First-order reversal curves: down from 1 to each reversal unseen, then up, 40 points.
fn reversal_curves(reversals: impl Iterator<Item = f64>) -> LawData {
    let mut relays = Relays::new(0.25);
    let runs: Vec<MeasuredRun> = reversals
        .map(|reversal| {
            relays.switch(1.0);
            relays.switch(reversal);
            let field: Vec<f64> = (0..40)
                .map(|point| reversal + (1.0 - reversal) * f64::from(point) / 39.0)
                .collect();
            let response = field.iter().map(|field| relays.switch(*field)).collect();
            MeasuredRun::in_memory(
                "relays",
                None,
                vec![(Quantity::Field, field), (Quantity::Magnetization, response)],
            )
            .unwrap()
        })
        .collect();
    LawData::of(&runs, None, None).unwrap()
}

#[test]
fn reversal_curves_of_relays_predict_those_between_them() {
    let reversal = |curve: usize| 0.8 - 1.7 * curve as f64 / 59.0;
    let found = fitted(None, &reversal_curves((0..60).step_by(2).map(reversal)));
    assert_eq!(found.file.start, Start::Turned, "{:?}", found.report);
    let error = predict(&found.file, &reversal_curves((1..60).step_by(2).map(reversal))).error;
    assert!(error.rms <= 0.01 * error.range, "{error:?} by {}", found.report.law);
    // What it said of itself is about what came.
    let told = found.report.held_out_nrmse * error.range;
    assert!(error.rms < 2.0 * told && told < 4.0 * error.rms, "{told} {error:?}");
}

fn over_time(output: impl Fn(f64, f64) -> f64) -> LawData {
    let time: Vec<f64> = (0..3000).map(|sample| 0.01 * f64::from(sample)).collect();
    let voltage: Vec<f64> = time
        .iter()
        .map(|t| 5.0 + (2.0 + 2.5 * (0.3 * t).sin()) * (2.0 * t).sin())
        .collect();
    let displacement = time.iter().zip(&voltage).map(|(t, v)| output(*t, *v)).collect();
    let series = vec![(Quantity::Voltage, voltage), (Quantity::Displacement, displacement)];
    LawData::of(
        &[MeasuredRun::in_memory("made", Some(0.01), series).unwrap()],
        None,
        None,
    )
    .unwrap()
}

/// Where there is no hysteresis none is claimed.
#[test]
fn a_line_stays_a_line() {
    let noise = |t: f64| 3e-9 * (12.9898e3 * t).sin() * (78.233e2 * t).cos();
    let found = fitted(None, &over_time(|t, v| 2e-6 * v - 7e-6 + noise(t)));
    assert_eq!(found.report.law, "linear");
    assert!(
        found.report.warnings.iter().any(|own| own.contains("no hysteresis")),
        "{:?}",
        found.report.warnings
    );
    assert!((found.file.model.slope - 2e-6).abs() < 1e-9, "{:?}", found.file.model);
}

/// An amplifier's lag is no whole number of samples: a play behind one, its input held from sample to sample.
#[test]
fn a_lag_is_told_to_a_tenth_of_a_sample() {
    const LAG_S: f64 = 0.0133;
    let (mut seen, mut held, mut play) = (5.0, 5.0, 5.0_f64);
    let behind = std::cell::RefCell::new(move |voltage: f64| {
        let finely = 1000;
        for _ in 0..finely {
            seen += 0.01 / f64::from(finely) / LAG_S * (held - seen);
        }
        held = voltage;
        play = play.clamp(seen - 0.8, seen + 0.8);
        1e-6 * (seen + play)
    });
    let found = fitted(None, &over_time(|_, voltage| behind.borrow_mut()(voltage)));
    let reaction = found.file.reaction;
    assert_eq!(reaction.delay_s, 0.0, "{:?}", found.report);
    assert!((reaction.lag_s - LAG_S).abs() < 1e-3, "{reaction:?}");
}

fn sweep(through: &[f64], each: usize) -> Vec<f64> {
    let leg = |pair: &[f64]| {
        let (from, to) = (pair[0], pair[1]);
        (0..each).map(move |step| from + (to - from) * step as f64 / each as f64)
    };
    let mut input: Vec<f64> = through.windows(2).flat_map(leg).collect();
    input.extend(through.last());
    input
}

fn of(input: Vec<f64>, output: Vec<f64>) -> LawData {
    let series = vec![(Quantity::Temperature, input), (Quantity::Strain, output)];
    LawData::of(&[MeasuredRun::in_memory("made", None, series).unwrap()], None, None).unwrap()
}

/// A wire that shortens at 60 to 80 degrees and lengthens again at 40 to 55, from one loop: relays, counted one by one.
fn wire(temperatures: &[f64]) -> Vec<f64> {
    let places: Vec<(f64, f64)> = (0..1600)
        .map(|relay| {
            let share = |index: i32| (f64::from(index) + 0.5) / 40.0;
            let bell = |share: f64| 0.3 * (share / (1.0 - share)).ln();
            (
                70.0 + 8.0 * bell(share(relay / 40)),
                47.0 + 5.0 * bell(share(relay % 40)),
            )
        })
        .collect();
    let mut is_up = vec![false; places.len()];
    let strain = temperatures.iter().map(|temperature| {
        for (is_up, (up, down)) in is_up.iter_mut().zip(&places) {
            *is_up = temperature >= up || *is_up && temperature > down;
        }
        0.04 * (1.0 - is_up.iter().filter(|is_up| **is_up).count() as f64 / 1600.0)
    });
    strain.collect()
}

/// Guards a loop that is neither about 0 nor alike on its sides, of an output that falls: and the minor loops that it did not hold.
#[test]
fn a_wire_that_remembers_its_shape_is_predicted_from_one_loop() {
    let one = sweep(&[25.0, 100.0, 25.0], 100);
    let found = fitted(None, &of(one.clone(), wire(&one)));
    assert!(found.file.falls && found.report.nrmse < 0.01, "{:?}", found.report);
    let later = sweep(&[25.0, 100.0, 25.0, 72.0, 44.0, 75.0, 25.0], 80);
    let error = predict(&found.file, &of(later.clone(), wire(&later))).error;
    assert!(error.rms < 0.02 * error.range, "{error:?} by {}", found.report.law);
}

/// Reversal curves one behind the other, with nothing that tells them apart but the jumps between them.
#[test]
fn reversal_curves_are_found_in_one_record() {
    let curves = reversal_curves((0..30).map(|curve| 0.8 - 1.7 * f64::from(curve) / 29.0));
    let joined = |series: fn(&LawRecord) -> &Vec<f64>| curves.records.iter().flat_map(series).copied().collect();
    let data = of(joined(|own| &own.input), joined(|own| &own.output));
    assert_eq!(data.records.len(), 30);
    for (own, known) in data.records.iter().zip(&curves.records) {
        assert_eq!((&own.input, &own.output), (&known.input, &known.output));
    }
    // A sweep that is no such thing stays whole, and so does one that flies back to the same place.
    let saw: Vec<f64> = (0..400).map(|step| f64::from(step % 40)).collect();
    assert_eq!(of(saw.clone(), saw).records.len(), 1);
    let loops = sweep(&[0.0, 1.0, -1.0, 0.5, -0.5, 0.0], 30);
    assert_eq!(of(loops.clone(), loops).records.len(), 1);
}

/// What the data do not show is said: where nothing turned round, and where no law of this input is there.
#[test]
fn what_is_not_shown_is_not_claimed() {
    let warned = |found: &LawFit, words: &str| found.report.warnings.iter().any(|own| own.contains(words));
    let branch = sweep(&[-1.0, 0.4], 150);
    let output = branch.iter().map(|input| (3.0 * (input - 0.1)).tanh()).collect();
    let found = fitted(None, &of(branch, output));
    assert!(warned(&found, "never turns round"), "{:?}", found.report.warnings);
    let loops = sweep(&[0.0, 1.0, -1.0, 1.0, -1.0, 0.0], 60);
    let even = loops.iter().map(|input| input * input).collect();
    let found = fitted(None, &of(loops, even));
    assert!(warned(&found, "of the range is left"), "{:?}", found.report.warnings);
    assert!(!warned(&found, "show no hysteresis"), "{:?}", found.report.warnings);
}

/// A magnet that keeps what a large field gave it, along small loops: the record does not hold how it came there.
#[test]
fn a_record_may_begin_magnetised() {
    let mut relays = Relays::new(0.25);
    for field in [1.0, -1.0, 0.0] {
        relays.switch(field);
    }
    let field = sweep(&[0.0, 0.3, -0.1, 0.4, 0.0, 0.5], 60);
    let output = field.iter().map(|field| relays.switch(*field)).collect();
    let found = fitted(None, &of(field, output));
    assert_eq!(found.file.start, Start::FromBelow, "{:?}", found.report);
    assert!(found.report.nrmse < 0.02, "{:?}", found.report);
}
