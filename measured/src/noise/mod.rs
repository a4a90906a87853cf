//! How loud is the measurement itself? The floor under a series: rms, colour, and the step of its digits.
//!
//! Model: y = signal + n, n_t = φ n_{t−1} + e_t with e white: rms = √(g / (1 − φ²)), g the variance of e, φ the AR(1)
//! coefficient (0 is white), spectrum S(ω) = g / (1 − 2 φ cos ω + φ²), ω in rad per sample.
//!
//! Where the command rests, what is left of a settled actuator is noise, and nearly the whole band shows it. Elsewhere
//! only the upper band does: actuators are low passes, so above a quarter of the sampling rate (or higher, as far as
//! the spectrum fits) the signal has gone. Segments in which a step or a kink reaches into the band are left out, so
//! are lines of interference. Source: Whittle's likelihood (1953) on a tapered, averaged periodogram (Welch 1967).
//! Assumption: the noise has one colour over the run; below the band its spectrum is that of the AR(1) seen above.

mod spectrum;

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::quantity::Quantity;
use crate::resolution::resolution;
use crate::run::MeasuredRun;
use spectrum::{Floor, Segments};

/// Fewest samples with which a floor is looked for.
pub const MIN_NOISE_SAMPLES: usize = 64;
/// Fewest samples at rest that are worth more than the whole run's upper band.
const MIN_REST_SAMPLES: usize = 512;
/// A stretch of constant command is a rest from this length on.
const MIN_REST: usize = 192;
/// Segment length at rest, samples.
const REST_SEGMENT: usize = 128;
/// Longest segment elsewhere, samples: short enough to fit between two kinks of the signal.
const MAX_SEGMENT: usize = 128;
/// Fewest segments over which a median means something.
const WANTED_SEGMENTS: usize = 16;
/// Where the band may begin, as shares of the sampling rate: the first that fits is taken.
const REST_BANDS: &[f64] = &[1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0];
const UPPER_BANDS: &[f64] = &[1.0 / 4.0, 5.0 / 16.0, 3.0 / 8.0, 7.0 / 16.0];

/// Where the floor was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoiseSource {
    /// While the command stood still.
    Rest,
    /// In the upper band of the whole series.
    Spectrum,
}

/// The floor under a series, in the series' own unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFloor {
    pub rms: f64,
    /// Standard deviation of `rms` as a share of it.
    pub relative_deviation: f64,
    /// Step between values, if they stand on a lattice.
    pub resolution: Option<f64>,
    /// Correlation of a sample's noise with that of the sample before; 0 is white.
    pub autoregression: f64,
    pub from: NoiseSource,
}

impl NoiseFloor {
    /// How many samples count as one independent one: (1 + φ) / (1 − φ).
    pub fn samples_per_independent(&self) -> f64 {
        (1.0 + self.autoregression) / (1.0 - self.autoregression)
    }
}

/// The floor of a series; `rests` are stretches in which nothing drove it. None for fewer than
/// [`MIN_NOISE_SAMPLES`] samples.
pub fn noise_floor(series: &[f64], rests: &[Range<usize>]) -> Option<NoiseFloor> {
    if series.len() < MIN_NOISE_SAMPLES {
        return None;
    }
    let (floor, from) = match at_rest(series, rests) {
        Some(floor) => (floor, NoiseSource::Rest),
        None => (upper_band(series), NoiseSource::Spectrum),
    };
    let resolution = resolution(series);
    // A moving signal that is rounded carries an error of one step over √12 whatever the sensor does.
    let rounding = resolution.unwrap_or(0.0) / 12.0_f64.sqrt();
    let rounded_only = floor.rms() <= rounding;
    Some(NoiseFloor {
        rms: floor.rms().max(rounding),
        relative_deviation: if rounded_only { 0.0 } else { floor.relative_deviation },
        resolution,
        autoregression: if rounded_only { 0.0 } else { floor.autoregression },
        from,
    })
}

impl MeasuredRun {
    /// The floor under one of the run's series.
    pub fn noise(&self, quantity: Quantity) -> Option<NoiseFloor> {
        noise_floor(self.series(quantity)?, &rests(self))
    }
}

/// Stretches in which every command stands still; none for a run without a command or a command that is noisy.
pub fn rests(run: &MeasuredRun) -> Vec<Range<usize>> {
    let commands: Vec<&[f64]> = [Quantity::FieldCommand, Quantity::Voltage]
        .into_iter()
        .filter_map(|quantity| run.series(quantity))
        .collect();
    if commands.is_empty() {
        return Vec::new();
    }
    let still = |sample: usize| commands.iter().all(|command| command[sample] == command[sample - 1]);
    let (mut found, mut first) = (Vec::new(), 0);
    for sample in 1..=run.len() {
        if sample == run.len() || !still(sample) {
            if sample - first >= MIN_REST {
                found.push(first..sample);
            }
            first = sample;
        }
    }
    found
}

fn at_rest(series: &[f64], rests: &[Range<usize>]) -> Option<Floor> {
    let samples: usize = rests.iter().map(ExactSizeIterator::len).sum();
    if samples < MIN_REST_SAMPLES {
        return None;
    }
    let segments = Segments::of(series, rests, REST_SEGMENT);
    let mut floors = REST_BANDS.iter().map(|from| segments.floor(*from));
    floors.find(|floor| floor.fits)
}

fn upper_band(series: &[f64]) -> Floor {
    let mut length = MAX_SEGMENT;
    while length > 16 && 2 * series.len() / length < WANTED_SEGMENTS + 1 {
        length /= 2;
    }
    let segments = Segments::of(series, std::slice::from_ref(&(0..series.len())), length);
    let floors = UPPER_BANDS.iter().map(|from| segments.floor(*from));
    let mut best: Option<Floor> = None;
    for floor in floors {
        if floor.fits {
            return floor;
        }
        // Where nothing fits, the lowest of them is nearest to the floor.
        best = best.filter(|best| best.rms() <= floor.rms()).or(Some(floor));
    }
    best.unwrap_or_default()
}
