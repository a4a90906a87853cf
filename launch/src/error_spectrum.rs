//! The spectrum of a run's error against that of the sensor's noise, by Welch's method, and the lines that stand out of it.
//!
//! P_k = 2T·|Σ w_i·(x_i − x̄)·e^{−2πjki/N}|²/Σ w², averaged over segments of N ticks that overlap by half: one-sided power density, m²/Hz.
//! w has Blackman and Harris' four terms, so a line leaks a 40 000th of its amplitude at most. Of the error x = r − y, and of the sensor x = measured − true: what no loop that measures with it can know.
//! A line is a bin above all of the window's main lobe around it and ten times above the median of its neighbours; its amplitude is
//! √(2 Σ (P − median)·Δf) over the nine bins of the lobe, its frequency their centre of power. Sources: Welch (1967), Harris (1978).

use anhyst_scenario::Scenario;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Ticks of a segment: so many, and so many of them in a run at least.
const LENGTHS: (u64, u64) = (256, 8192);
const SEGMENTS: u64 = 4;
/// Bands of equal ratio in what is told.
const BANDS: usize = 400;
/// A line's bin against the median of so many bins on either side.
const STANDS_OUT: f64 = 10.0;
const NEIGHBOURS: usize = 32;
/// Bins on either side of its peak that belong to a line.
const MAIN_LOBE: usize = 4;
/// Of the window, and the mean of its square.
const TERMS: [f64; 4] = [0.358_75, -0.488_29, 0.141_28, -0.011_68];
const MEAN_SQUARE: f64 = TERMS[0] * TERMS[0] + 0.5 * (TERMS[1] * TERMS[1] + TERMS[2] * TERMS[2] + TERMS[3] * TERMS[3]);
const MAX_LINES: usize = 8;
/// Of the reference's frequency: one that does not change.
const SAME: f64 = 1e-9;

/// What is gathered.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ErrorSpectrum {
    tick_s: f64,
    /// How often the reference repeats, if it does so evenly.
    repeats_hz: Option<f64>,
    length: usize,
    /// Error and sensor, of the segment that is filling.
    segment: Vec<[f64; 2]>,
    sums: Vec<[f64; 2]>,
    segments: u32,
    #[serde(skip)]
    transform: Transform,
}

/// The transform and its room, made once.
#[derive(Clone, Default)]
struct Transform {
    plan: Option<Arc<dyn Fft<f64>>>,
    window: Vec<f64>,
    values: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Transform").finish_non_exhaustive()
    }
}

/// Amplitude densities in one band of frequencies, the largest of its bins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpectrumBand {
    /// Of the bin with the largest error.
    pub frequency_hz: f64,
    pub error_m_per_sqrt_hz: f64,
    pub sensor_m_per_sqrt_hz: f64,
}

/// A line in the error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorLine {
    pub frequency_hz: f64,
    pub amplitude_m: f64,
    /// Which harmonic of the reference it is, counted from 1; none if it is no such.
    pub harmonic: Option<u32>,
}

impl ErrorSpectrum {
    /// None where a run is too short for one.
    pub fn new(scenario: &Scenario) -> Option<Self> {
        let judged_s = scenario.duration_s - scenario.expect.settling_s;
        let ticks = (judged_s / scenario.tick_s) as u64;
        let length = (ticks / SEGMENTS + 1).next_power_of_two() / 2;
        let repeats_hz = repeats_hz(scenario);
        (length >= LENGTHS.0).then(|| Self::of(length.min(LENGTHS.1) as usize, scenario.tick_s, repeats_hz))
    }

    /// Of a series alone, one value a tick; none where it is too short for a spectrum.
    pub fn of_series(series: &[f64], tick_s: f64) -> Option<Self> {
        let length = (series.len() as u64 / SEGMENTS + 1).next_power_of_two() / 2;
        let mut own = (length >= LENGTHS.0).then(|| Self::of(length.min(LENGTHS.1) as usize, tick_s, None))?;
        series.iter().for_each(|value| own.observe(Some([*value, 0.0])));
        Some(own)
    }

    /// Of the error: frequency (Hz) and power density (m²/Hz), bin by bin.
    pub fn densities(&self) -> Vec<[f64; 2]> {
        let bins = self.density(0).into_iter().enumerate().skip(1);
        bins.map(|(bin, own)| [bin as f64 * self.resolution_hz(), own])
            .collect()
    }

    fn of(length: usize, tick_s: f64, repeats_hz: Option<f64>) -> Self {
        Self {
            tick_s,
            repeats_hz,
            length,
            segment: Vec::with_capacity(length),
            sums: vec![[0.0; 2]; length / 2],
            segments: 0,
            transform: Transform::of(length),
        }
    }

    /// Takes in a tick; a tick without an error to judge ends the segment that it is in.
    pub fn observe(&mut self, error_and_sensor_m: Option<[f64; 2]>) {
        let Some(values) = error_and_sensor_m.filter(|values| values.iter().all(|own| own.is_finite())) else {
            self.segment.clear();
            return;
        };
        self.segment.push(values);
        if self.segment.len() == self.length {
            self.transform();
            self.segment.drain(..self.length / 2);
        }
    }

    /// Both signals in one transform: X of the first is (Z_k + Z̄_{N−k})/2, of the second (Z_k − Z̄_{N−k})/2j.
    fn transform(&mut self) {
        let n = self.length;
        if self.transform.plan.is_none() {
            self.transform = Transform::of(n);
        }
        let Transform {
            plan,
            window,
            values,
            scratch,
        } = &mut self.transform;
        let Some(plan) = plan else { return };
        // The mean is the window's: a plain one would put what a strong line has left over into the lowest bins.
        let mut means = [0.0; 2];
        for ((value, own), &window) in values.iter_mut().zip(&self.segment).zip(&*window) {
            means = [0, 1].map(|of| means[of] + window * own[of] / (TERMS[0] * n as f64));
            *value = Complex::from(window);
        }
        for (value, own) in values.iter_mut().zip(&self.segment) {
            *value = Complex::new(value.re * (own[0] - means[0]), value.re * (own[1] - means[1]));
        }
        plan.process_with_scratch(values, scratch);
        // A quarter for splitting.
        let scale = 0.25 * 2.0 * self.tick_s / (MEAN_SQUARE * n as f64);
        for (bin, sum) in self.sums.iter_mut().enumerate().skip(1) {
            let (one, other) = (values[bin], values[n - bin].conj());
            sum[0] += scale * (one + other).norm_sqr();
            sum[1] += scale * (one - other).norm_sqr();
        }
        self.segments += 1;
    }

    fn resolution_hz(&self) -> f64 {
        1.0 / (self.tick_s * self.length as f64)
    }

    /// Of error (0) or sensor (1), m²/Hz, bin by bin.
    fn density(&self, of: usize) -> Vec<f64> {
        let segments = f64::from(self.segments.max(1));
        self.sums.iter().map(|sum| sum[of] / segments).collect()
    }

    /// The largest in each of at most 400 bands; empty before a segment was full.
    pub fn bands(&self) -> Vec<SpectrumBand> {
        let mut bands: Vec<(usize, SpectrumBand)> = Vec::new();
        let per_band = (self.sums.len() as f64).ln() / BANDS as f64;
        let [error, sensor] = [self.density(0), self.density(1)].map(|own| own.into_iter().map(f64::sqrt));
        for (bin, (error, sensor)) in error.zip(sensor).enumerate().skip(1) {
            let place = ((bin as f64).ln() / per_band) as usize;
            let own = SpectrumBand {
                frequency_hz: bin as f64 * self.resolution_hz(),
                error_m_per_sqrt_hz: error,
                sensor_m_per_sqrt_hz: sensor,
            };
            match bands.last_mut().filter(|(known, _)| *known == place) {
                None => bands.push((place, own)),
                Some((_, known)) => {
                    let sensor_m_per_sqrt_hz = known.sensor_m_per_sqrt_hz.max(sensor);
                    let louder = own.error_m_per_sqrt_hz > known.error_m_per_sqrt_hz;
                    *known = SpectrumBand {
                        sensor_m_per_sqrt_hz,
                        ..if louder { own } else { *known }
                    };
                }
            }
        }
        let told = bands.into_iter().map(|(_, band)| band);
        told.take(if self.segments == 0 { 0 } else { usize::MAX }).collect()
    }

    /// The strongest lines of the error, the strongest first.
    pub fn lines(&self) -> Vec<ErrorLine> {
        let density = self.density(0);
        let floor = medians(&density);
        let resolution_hz = self.resolution_hz();
        let above: Vec<f64> = density.iter().zip(&floor).map(|(own, floor)| own - floor).collect();
        let lobe = |peak: usize| peak.saturating_sub(MAIN_LOBE).max(1)..(peak + MAIN_LOBE + 1).min(density.len());
        let stands_out = |bin: &usize| {
            above[*bin] > (STANDS_OUT - 1.0) * floor[*bin] && lobe(*bin).all(|other| density[other] <= density[*bin])
        };
        let line = |peak: usize| {
            let power: f64 = above[lobe(peak)].iter().sum();
            let centre = lobe(peak).map(|bin| bin as f64 * above[bin]).sum::<f64>() / power;
            let frequency_hz = centre * resolution_hz;
            ErrorLine {
                frequency_hz,
                amplitude_m: (2.0 * power * resolution_hz).sqrt(),
                harmonic: self.harmonic(frequency_hz),
            }
        };
        let mut lines: Vec<ErrorLine> = (1..density.len()).filter(stands_out).map(line).collect();
        lines.sort_by(|one, other| other.amplitude_m.total_cmp(&one.amplitude_m));
        lines.truncate(MAX_LINES);
        lines
    }

    /// Within half a bin.
    fn harmonic(&self, frequency_hz: f64) -> Option<u32> {
        let repeats_hz = self.repeats_hz?;
        let number = (frequency_hz / repeats_hz).round();
        let off_hz = (frequency_hz - number * repeats_hz).abs();
        (number >= 1.0 && off_hz <= 0.5 * self.resolution_hz()).then_some(number as u32)
    }
}

impl Transform {
    fn of(length: usize) -> Self {
        let plan = FftPlanner::new().plan_fft_forward(length);
        let window = (0..length).map(|place| {
            let angle = TAU * place as f64 / length as f64;
            let terms = (0..)
                .zip(TERMS)
                .map(|(order, term)| term * (f64::from(order) * angle).cos());
            terms.sum()
        });
        Self {
            window: window.collect(),
            values: vec![Complex::default(); length],
            scratch: vec![Complex::default(); plan.get_inplace_scratch_len()],
            plan: Some(plan),
        }
    }
}

/// How often the reference repeats over the judged time, if that does not change.
fn repeats_hz(scenario: &Scenario) -> Option<f64> {
    let (from_s, to_s) = (scenario.expect.settling_s, scenario.duration_s);
    let controller = scenario.controller().ok()?;
    let turns = |part: f64| controller.trajectory().turns(from_s + part * (to_s - from_s));
    let [begin, middle, end] = [turns(0.0)?, turns(0.5)?, turns(1.0)?];
    let even = (end - 2.0 * middle + begin).abs() <= SAME * (end - begin);
    even.then(|| (end - begin) / (to_s - from_s))
}

/// The median of each bin and its neighbours.
fn medians(density: &[f64]) -> Vec<f64> {
    let around = |bin: usize| {
        let from = bin.saturating_sub(NEIGHBOURS).max(1);
        let mut own = density[from..(bin + NEIGHBOURS + 1).min(density.len())].to_vec();
        let middle = own.len() / 2;
        own.select_nth_unstable_by(middle, f64::total_cmp);
        own[middle]
    };
    (0..density.len()).map(around).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 1e-4;

    /// White noise of rms 1, from a generator of its own.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        // Twelve uniform numbers less six have variance 1.
        (0..count)
            .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
            .collect()
    }

    fn spectrum(signal: impl Fn(f64) -> f64, noise_m: f64, sensor_m: f64) -> ErrorSpectrum {
        let mut spectrum = ErrorSpectrum::of(2048, TICK_S, Some(50.0));
        let drawn = noise(80_000);
        for (tick, pair) in drawn.chunks_exact(2).enumerate() {
            let error_m = signal(tick as f64 * TICK_S) + noise_m * pair[0];
            spectrum.observe(Some([error_m, sensor_m * pair[1]]));
        }
        spectrum
    }

    /// Guards the scale: the integral of a density is the mean square (Parseval), of the error and of the sensor, each its own.
    #[test]
    fn the_density_of_white_noise_integrates_to_its_variance() {
        let found = spectrum(|_| 1.0, 3e-9, 1e-8);
        for (of, expected) in [(0, 9e-18), (1, 1e-16)] {
            let total = found.density(of).iter().sum::<f64>() * found.resolution_hz();
            assert!((total / expected - 1.0).abs() < 0.02, "{of}: {total:e}");
        }
        assert_eq!(found.lines(), []);
        let bands = found.bands();
        assert!(
            bands.len() <= BANDS
                && bands
                    .iter()
                    .all(|own| own.sensor_m_per_sqrt_hz > own.error_m_per_sqrt_hz)
        );
    }

    /// Guards the names: lines between bins and on them come with their frequency, amplitude and harmonic, the strongest first; one a
    /// thousand times as strong hides none, and what it leaks is none.
    #[test]
    fn lines_are_named() {
        let parts = [(150.0, 5e-6, Some(3)), (333.3, 2e-9, None), (2000.0, 1e-9, Some(40))];
        let sum = |time_s: f64| {
            let of = |(hz, amplitude, _): &(f64, f64, Option<u32>)| amplitude * (TAU * hz * time_s).sin();
            parts.iter().map(of).sum()
        };
        let lines = spectrum(sum, 1e-9, 1e-9).lines();
        assert_eq!(lines.len(), parts.len(), "{lines:?}");
        for (line, (frequency_hz, amplitude_m, harmonic)) in lines.iter().zip(parts) {
            assert!((line.frequency_hz - frequency_hz).abs() < 0.5, "{line:?}");
            assert!((line.amplitude_m / amplitude_m - 1.0).abs() < 0.03, "{line:?}");
            assert_eq!(line.harmonic, harmonic);
        }
    }

    /// Guards against joining what is apart: a tick that is missing, or no number, ends the segment.
    #[test]
    fn no_segment_goes_over_a_gap() {
        for gap in [None, Some([f64::NAN, 0.0])] {
            let mut spectrum = ErrorSpectrum::of(256, TICK_S, None);
            (0..255).for_each(|_| spectrum.observe(Some([1.0, 1.0])));
            spectrum.observe(gap);
            (0..255).for_each(|_| spectrum.observe(Some([1.0, 1.0])));
            assert_eq!((spectrum.segments, spectrum.bands()), (0, Vec::new()));
            spectrum.observe(Some([1.0, 1.0]));
            assert_eq!(spectrum.segments, 1);
        }
    }
}
