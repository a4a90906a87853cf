//! The sensor while nothing is asked of the rig: noise, its spectrum and lines, and what it says where the rig stands.

use super::{Step, TRACKS, open_loop};
use anhyst_conformance::amplifier::Findings;
use anhyst_ipc::Measurement;
use anhyst_launch::error_spectrum::ErrorSpectrum;
use anhyst_model::DriveSignal;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::number::Si;
use anhyst_scenario::Scenario;

/// So long, and so many ticks at least.
const REST_S: f64 = 1.0;
const MIN_TICKS: f64 = 2048.0;
/// Lines below this part of the noise say nothing.
const LOUD: f64 = 0.1;
/// More of them are not told.
const LINES: usize = 4;
/// Bands of the picture.
const BANDS: usize = 400;

/// What the sensor says of a rig that stands.
#[derive(Debug, Default)]
pub struct Rest {
    pub noise_rms_m: f64,
    /// Hz and m²/Hz.
    pub densities: Vec<[f64; 2]>,
}

/// The run: no field.
pub fn probe(of: &Scenario) -> Scenario {
    let duration_s = REST_S.max(MIN_TICKS * of.tick_s);
    let mut own = open_loop(of, duration_s);
    own.inverse.drive = Some(DriveSignal::Ramp {
        from_a_per_m: 0.0,
        to_a_per_m: 0.0,
        duration_s,
    });
    own
}

/// What it shows; `size` is how far the profile goes.
pub fn judge(scenario: &Scenario, measured: &[Measurement], size: Option<f64>) -> (Rest, Step) {
    let unit = scenario.units().output;
    // Where it stands after whatever it did when the field went on.
    let series: Vec<f64> = measured[measured.len() / 10..]
        .iter()
        .map(|own| own.displacement_m)
        .collect();
    let zero = series.iter().sum::<f64>() / series.len().max(1) as f64;
    let power = series.iter().map(|own| (own - zero).powi(2)).sum::<f64>() / series.len().max(1) as f64;
    let spectrum = ErrorSpectrum::of_series(&series, scenario.tick_s);
    let densities = spectrum.as_ref().map(ErrorSpectrum::densities).unwrap_or_default();
    let noise = power.sqrt();
    let white = white(&densities, scenario.tick_s);
    let lines = spectrum.as_ref().map(ErrorSpectrum::lines).unwrap_or_default();
    let loud = lines.iter().filter(|line| line.amplitude_m > LOUD * noise).take(LINES);
    let lines: Vec<String> = loud
        .map(|line| format!("{} at {:.1} Hz", Si(line.amplitude_m, &unit), line.frequency_hz))
        .collect();
    let lines = match lines.is_empty() {
        true => "no lines".to_owned(),
        false => format!("lines of {}", lines.join(", ")),
    };
    let mut found = Findings::default();
    let sentence = format!(
        "the sensor of a rig at rest says {} rms, {} of it white, {lines}",
        Si(noise, &unit),
        Si(white, &unit)
    );
    if let Some(size) = size {
        found.at_most("noise", noise, TRACKS * size, "m", sentence.clone());
        let words = format!("where nothing is asked the sensor says {}", Si(zero, &unit));
        found.at_most("zero", zero.abs(), size, "m", words);
    }
    let mut step = Step::new("sensor at rest", found.checks, &["noise"]);
    if step.refusal.is_none() {
        step.findings.insert(0, sentence);
    }
    let per_band = (densities.len().max(2) as f64).ln() / BANDS as f64;
    let mut told = densities
        .iter()
        .enumerate()
        .map(|(bin, own)| (((bin + 1) as f64).ln() / per_band, own));
    let mut bands: Vec<(usize, [f64; 2])> = Vec::new();
    told.by_ref().for_each(|(band, own)| {
        let (band, own) = (band as usize, [own[0], own[1].sqrt()]);
        match bands.last_mut().filter(|(known, _)| *known == band) {
            Some((_, known)) if known[1] < own[1] => *known = own,
            Some(_) => {}
            None => bands.push((band, own)),
        }
    });
    let curve = Curve::new(bands.into_iter().map(|(_, own)| own), Role::Measured).named("sensor");
    let frequency = Axis::new("frequency", "Hz").logarithmic();
    let density = Axis::new("amplitude density", &format!("{unit}/√Hz")).logarithmic();
    let chart = Chart::new("", frequency, density).curve(curve);
    step.section = step.section.figure(
        Figure::new("Noise of the sensor", vec![chart]).columns(1),
        "Amplitude density of what the sensor says while the field is zero.",
    );
    let rest = Rest {
        noise_rms_m: noise,
        densities,
    };
    (rest, step)
}

/// What is the same at all frequencies: the median of the upper half, over all of them.
fn white(densities: &[[f64; 2]], tick_s: f64) -> f64 {
    let mut upper: Vec<f64> = densities[densities.len() / 2..].iter().map(|own| own[1]).collect();
    if upper.is_empty() {
        return 0.0;
    }
    let middle = upper.len() / 2;
    let (_, median, _) = upper.select_nth_unstable_by(middle, f64::total_cmp);
    (*median * 0.5 / tick_s).sqrt()
}
