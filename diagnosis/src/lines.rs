//! Lines in what is left: sines that the drive does not make, such as the mains'.
//!
//! A line stands 60 times above the median power of its neighbourhood, where the simulated output has no line itself, and is steady: with
//! A_j its complex amplitude in the j-th of eight parts of the record, Ā their mean, median Re(A_j/Ā) > 0.6 and mean |A_j/Ā − 1|² < 0.45.
//! Its frequency is where Σ w_n r_n e^{−iωn} is largest (w Hann's window). Near k·50 or k·60 Hz it is the mains'.

use anhyst_identify::order::descending;
use std::f64::consts::TAU;

use realfft::num_complex::Complex;

use crate::channel::Channel;
use crate::composition::Line;
use crate::likelihood::{Bench, Point};
use crate::spectrum::Spectrum;
use crate::statistics::{quantile, sorted};

/// Power over that of the neighbourhood.
const STANDS_OUT: f64 = 60.0;
/// Lines to either side that are the neighbourhood.
const NEIGHBOURS: usize = 40;
const PARTS: usize = 8;
/// Share of a drive's power that makes a tone of it.
const TONE: f64 = 0.15;
/// The highest lines that are looked at.
const MAX_LOOKS: usize = 12;
/// A line is the mains' within this distance, Hz.
const NEAR_MAINS_HZ: f64 = 0.4;
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
const MAX_HARMONIC: f64 = 7.0;

impl Line {
    /// It is a multiple of the mains' frequency.
    pub fn of_mains(&self) -> bool {
        MAINS_HZ.iter().any(|mains| {
            let harmonic = (self.frequency_hz / mains).round();
            (1.0..=MAX_HARMONIC).contains(&harmonic) && (self.frequency_hz - harmonic * mains).abs() < NEAR_MAINS_HZ
        })
    }
}

/// Steady lines of fields and outputs that are not in the composition yet, strongest first.
pub(crate) fn lines(bench: &Bench, point: &Point) -> Vec<Line> {
    let mut found: Vec<(f64, Line)> = Vec::new();
    for (index, channel) in bench.plant.channels.iter().enumerate() {
        let Some(tick_s) = bench.plant.runs[channel.run].tick_s else {
            continue;
        };
        let left = Spectrum::powers(&point.residual[channel.places.clone()]);
        let own = Spectrum::powers(&point.simulated[channel.places.clone()]);
        let (left_ratios, own_ratios) = (ratios(&left), ratios(&own));
        let mut peaks: Vec<usize> = (2..left.len().saturating_sub(2))
            .filter(|&line| {
                left_ratios[line] > STANDS_OUT && left[line] >= left[line - 1] && left[line] > left[line + 1]
            })
            .filter(|&line| own_ratios[line - 2..=line + 2].iter().all(|ratio| *ratio < STANDS_OUT))
            .collect();
        descending(&mut peaks, |line| left_ratios[*line]);
        let series = bench.left(point, channel);
        let tones = tones(
            &bench.plant.runs[channel.run].drive_a_per_m[channel.rows.clone()],
            channel,
            tick_s,
        );
        for peak in peaks.into_iter().take(MAX_LOOKS) {
            let frequency_hz = refined(&series, channel, peak + 1, tick_s);
            let line = Line {
                channel: index,
                frequency_hz,
            };
            let resolution_hz = 1.0 / (tick_s * series.len() as f64);
            let known = |other: &Line| {
                other.channel == index && (other.frequency_hz - frequency_hz).abs() < 2.0 * resolution_hz
            };
            let again = found.iter().any(|(_, own)| known(own)) || point.composition.lines.iter().any(known);
            let of_the_drive = tones.iter().any(|tone| {
                let order = (frequency_hz / tone).round();
                order >= 1.0 && (frequency_hz - order * tone).abs() < resolution_hz
            });
            if !again && !of_the_drive && is_steady(&series, frequency_hz * tick_s) {
                found.push((left_ratios[peak], line));
            }
        }
    }
    descending(&mut found, |own| own.0);
    found.into_iter().map(|(_, line)| line).collect()
}

/// Lines that hold most of a drive: what answers them is no disturbance, whatever its order. Hz.
fn tones(drive: &[f64], channel: &Channel, tick_s: f64) -> Vec<f64> {
    let powers = Spectrum::powers(&channel.spectrum.of(drive));
    let all: f64 = powers.iter().sum();
    let inside = 1..powers.len().saturating_sub(1);
    let around = |line: usize| &powers[line - 1..=line + 1];
    let is_tone = |line: &usize| {
        let own = around(*line);
        own.iter().sum::<f64>() > TONE * all && own[1] >= own[0] && own[1] >= own[2]
    };
    inside
        .filter(is_tone)
        .map(|line| refined(drive, channel, line + 1, tick_s))
        .collect()
}

/// Power of each line over the median of its neighbourhood.
fn ratios(powers: &[f64]) -> Vec<f64> {
    // Medians change slowly: one for every few lines.
    let block = NEIGHBOURS / 4;
    let median = |at: usize| {
        let around = at.saturating_sub(NEIGHBOURS)..(at + NEIGHBOURS).min(powers.len());
        quantile(&sorted(powers[around].iter().copied()), 0.5).max(f64::MIN_POSITIVE)
    };
    let medians: Vec<f64> = (0..powers.len().div_ceil(block))
        .map(|own| median(own * block))
        .collect();
    powers
        .iter()
        .enumerate()
        .map(|(line, power)| power / medians[line / block])
        .collect()
}

/// Σ r_n e^{−iωn} over some samples, `turns` a sample.
fn demodulated(series: &[f64], first: usize, turns: f64) -> Complex<f64> {
    let step = Complex::from_polar(1.0, -TAU * turns);
    let mut phasor = Complex::from_polar(1.0, -TAU * (turns * first as f64).fract());
    let mut sum = Complex::default();
    for value in series {
        sum += phasor * value;
        phasor *= step;
    }
    sum
}

fn refined(series: &[f64], channel: &Channel, line: usize, tick_s: f64) -> f64 {
    let length = channel.rows.len() as f64;
    let hann = |row: usize| 1.0 - (TAU * row as f64 / length).cos();
    let windowed: Vec<f64> = series.iter().enumerate().map(|(row, own)| hann(row) * own).collect();
    let power = |line: f64| demodulated(&windowed, 0, line / length).norm_sqr();
    let (mut best, mut step) = (line as f64, 0.5);
    while step > 1e-3 {
        let [a, b, c] = [best - step, best, best + step].map(power);
        if a > b && a >= c {
            best -= step;
        } else if c > b {
            best += step;
        } else {
            step *= 0.5;
        }
    }
    best / (length * tick_s)
}

fn is_steady(series: &[f64], turns: f64) -> bool {
    let part = series.len() / PARTS;
    let amplitudes: Vec<Complex<f64>> = (0..PARTS)
        .map(|own| demodulated(&series[own * part..(own + 1) * part], own * part, turns))
        .collect();
    let mean = amplitudes.iter().sum::<Complex<f64>>() / PARTS as f64;
    let ratios: Vec<Complex<f64>> = amplitudes.iter().map(|own| own / mean).collect();
    let median = quantile(&sorted(ratios.iter().map(|ratio| ratio.re)), 0.5);
    let spread = ratios.iter().map(|ratio| (ratio - 1.0).norm_sqr()).sum::<f64>() / PARTS as f64;
    median > 0.6 && spread < 0.45
}
