//! Tapered periodograms of short segments, and the AR(1) floor under them in a band.
//!
//! P_k = abs(FFT(w·y))² / Σ w², with w Blackman and Harris' four terms (side lobes at −92 dB, so 40 µm of signal leak
//! less than 2 nm into the band) and y the segment less its straight line. Noise of variance σ² gives P_k = σ² in the
//! mean, each P_k exponentially distributed. In a band, Σ (ln S_k + P_k / S_k) is least at the most likely S.

use std::f64::consts::TAU;
use std::ops::Range;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Bins of this taper that are worth one independent one: L Σ w⁴ / (Σ w²)². Segments that overlap by half are independent.
const BINS_PER_INDEPENDENT: f64 = 2.763;
/// A segment this many standard deviations louder than the floor holds signal,
const CLIP_SEGMENTS: f64 = 2.5;
/// which takes this many deviations off the mean of those that are left (gamma distribution of shape 10 to 20).
const CLIPPED_MEAN: f64 = 0.055;
/// A bin this many standard deviations above the floor holds a line.
const CLIP_BINS: f64 = 4.0;
const CLIP_ROUNDS: usize = 6;
/// Share of the segments from which the first guess of the floor is taken.
const QUIETEST: f64 = 0.25;
/// A floor fits if no eighth of its band is off by more than this many deviations, or by less than this share.
const MISFIT_DEVIATIONS: f64 = 4.0;
const MISFIT_SHARE: f64 = 0.1;
const BAND_PARTS: usize = 8;
/// Twice the gain in log likelihood from which noise is called coloured (three standard deviations).
const COLOURED: f64 = 9.0;
/// Largest coefficient that is looked for.
const STRONGEST_COLOUR: f64 = 0.98;
/// A floor is known if its rms is known this well.
const KNOWN_SHARE: f64 = 0.3;

/// Power of every segment in every bin.
pub(super) struct Segments {
    length: usize,
    /// Bins 1 to length/2 − 1 of each segment.
    powers: Vec<Vec<f64>>,
}

/// An AR(1) floor.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Floor {
    /// Variance of the white noise that drives it.
    innovation: f64,
    pub autoregression: f64,
    pub relative_deviation: f64,
    /// The band holds nothing but this floor.
    pub fits: bool,
}

impl Floor {
    pub fn rms(&self) -> f64 {
        (self.innovation / (1.0 - self.autoregression * self.autoregression)).sqrt()
    }

    fn at(&self, cosine: f64) -> f64 {
        self.innovation * shape(self.autoregression, cosine)
    }
}

/// S/g of an AR(1) at the frequency of this cosine.
fn shape(autoregression: f64, cosine: f64) -> f64 {
    1.0 / (1.0 - 2.0 * autoregression * cosine + autoregression * autoregression)
}

impl Segments {
    /// Half-overlapping segments within the stretches.
    pub fn of(series: &[f64], stretches: &[Range<usize>], length: usize) -> Self {
        let transform = FftPlanner::new().plan_fft_forward(length);
        let taper: Vec<f64> = (0..length).map(|i| blackman_harris(i as f64 / length as f64)).collect();
        let energy: f64 = taper.iter().map(|weight| weight * weight).sum();
        let mut powers = Vec::new();
        for stretch in stretches {
            let starts = (stretch.start..).step_by(length / 2);
            for start in starts.take_while(|start| start + length <= stretch.end) {
                let mut buffer = tapered(&series[start..start + length], &taper);
                transform.process(&mut buffer);
                let bins = buffer[1..length / 2].iter();
                powers.push(bins.map(|bin| bin.norm_sqr() / energy).collect());
            }
        }
        Segments { length, powers }
    }

    /// The floor above a share of the sampling rate.
    pub fn floor(&self, from: f64) -> Floor {
        let first = ((from * self.length as f64) as usize).max(1) - 1;
        let cosines: Vec<f64> = (first..self.length / 2 - 1)
            .map(|bin| (TAU * (bin + 1) as f64 / self.length as f64).cos())
            .collect();
        let band: Vec<&[f64]> = self.powers.iter().map(|powers| &powers[first..]).collect();
        let quiet = quiet_segments(&band);
        let silent = |powers: &&[f64]| powers.iter().all(|power| *power < f64::MIN_POSITIVE);
        if quiet.is_empty() || quiet.iter().all(silent) {
            return Floor {
                fits: true,
                ..Floor::default()
            };
        }
        let count = quiet.len() as f64;
        let clipped = 1.0 - CLIPPED_MEAN * segment_spread(cosines.len());
        let mean = |bin: usize| quiet.iter().map(|powers| powers[bin]).sum::<f64>() / count / clipped;
        let mut bins: Vec<(f64, f64)> = cosines
            .iter()
            .enumerate()
            .map(|(bin, cosine)| (*cosine, mean(bin)))
            .collect();
        let mut floor = most_likely(&bins, count);
        for _ in 0..CLIP_ROUNDS {
            let highest = 1.0 + CLIP_BINS / count.sqrt();
            let before = bins.len();
            bins.retain(|(cosine, power)| *power <= highest * floor.at(*cosine));
            if bins.len() == before || bins.len() < 2 {
                break;
            }
            floor = most_likely(&bins, count);
        }
        let known = floor.relative_deviation < KNOWN_SHARE;
        floor.fits = known && 2 * bins.len() > cosines.len() && fits(&floor, &bins, count);
        floor
    }
}

/// Four-term Blackman-Harris window at a share of its length (periodic).
fn blackman_harris(share: f64) -> f64 {
    let wave = |order: f64| (order * TAU * share).cos();
    0.35875 - 0.48829 * wave(1.0) + 0.14128 * wave(2.0) - 0.01168 * wave(3.0)
}

/// A segment less its straight line, tapered.
fn tapered(segment: &[f64], taper: &[f64]) -> Vec<Complex<f64>> {
    let count = segment.len() as f64;
    let (mean, middle) = (segment.iter().sum::<f64>() / count, (count - 1.0) / 2.0);
    let centred = segment
        .iter()
        .enumerate()
        .map(|(i, value)| (i as f64 - middle, value - mean));
    let slope = centred.clone().map(|(i, value)| i * value).sum::<f64>() / (count * (count * count - 1.0) / 12.0);
    centred
        .zip(taper)
        .map(|((i, value), weight)| Complex::new((value - slope * i) * weight, 0.0))
        .collect()
}

/// Standard deviation of a segment's level as a share of it, white noise.
fn segment_spread(bins: usize) -> f64 {
    (BINS_PER_INDEPENDENT / bins as f64).sqrt()
}

/// Segments that are no louder in the band than the quietest ones, whatever the colour: each bin is held against the
/// mean of its own quiet segments.
fn quiet_segments<'a>(band: &[&'a [f64]]) -> Vec<&'a [f64]> {
    let Some(bins) = band.first().map(|powers| powers.len()) else {
        return Vec::new();
    };
    let spread = segment_spread(bins);
    let mut reference: Vec<f64> = (0..bins)
        .map(|bin| quietest(band.iter().map(|powers| powers[bin])))
        .collect();
    let mut quiet = band.to_vec();
    for _ in 0..CLIP_ROUNDS {
        let level = |powers: &[f64]| {
            let shares = powers
                .iter()
                .zip(&reference)
                .map(|(power, usual)| power / usual.max(f64::MIN_POSITIVE));
            shares.sum::<f64>() / bins as f64
        };
        quiet = band
            .iter()
            .copied()
            .filter(|powers| level(powers) <= 1.0 + CLIP_SEGMENTS * spread)
            .collect();
        if quiet.is_empty() {
            return vec![
                band.iter()
                    .min_by(|one, other| level(one).total_cmp(&level(other)))
                    .copied()
                    .unwrap_or(&[]),
            ];
        }
        let count = quiet.len() as f64 * (1.0 - CLIPPED_MEAN * spread);
        reference = (0..bins)
            .map(|bin| quiet.iter().map(|powers| powers[bin]).sum::<f64>() / count)
            .collect();
    }
    quiet
}

/// The mean of an exponential distribution from its lower quartile, ln(4/3) of it.
fn quietest(powers: impl Iterator<Item = f64>) -> f64 {
    let mut powers: Vec<f64> = powers.collect();
    let quartile = (powers.len() as f64 * QUIETEST) as usize;
    let (_, power, _) = powers.select_nth_unstable_by(quartile, f64::total_cmp);
    *power / (1.0 / (1.0 - QUIETEST)).ln()
}

/// White, or AR(1) if that is much likelier; `segments` were averaged in each bin of (cosine, power).
fn most_likely(bins: &[(f64, f64)], segments: f64) -> Floor {
    let count = bins.len() as f64;
    let innovation = |autoregression: f64| {
        let flat = bins
            .iter()
            .map(|(cosine, power)| power / shape(autoregression, *cosine));
        flat.sum::<f64>() / count
    };
    let cost = |autoregression: f64| {
        let shapes = bins.iter().map(|(cosine, _)| shape(autoregression, *cosine).ln());
        innovation(autoregression).max(f64::MIN_POSITIVE).ln() + shapes.sum::<f64>() / count
    };
    let independent = segments * count / BINS_PER_INDEPENDENT;
    let coloured = least(cost, -STRONGEST_COLOUR, STRONGEST_COLOUR);
    let gain = 2.0 * independent * (cost(0.0) - cost(coloured));
    let autoregression = if gain > COLOURED { coloured } else { 0.0 };
    // Fisher information of the coefficient when the innovation is free: the variance of d ln(S/g)/dφ over the band.
    let slopes = bins
        .iter()
        .map(|(cosine, _)| 2.0 * (cosine - autoregression) * shape(autoregression, *cosine));
    let mean_slope = slopes.clone().sum::<f64>() / count;
    let spread = slopes
        .map(|slope| (slope - mean_slope) * (slope - mean_slope))
        .sum::<f64>()
        / count;
    let colour_deviation = 1.0 / (independent * spread).max(f64::MIN_POSITIVE).sqrt();
    // d ln(rms)/dφ along the best innovation for each φ.
    let lever = autoregression / (1.0 - autoregression * autoregression) - 0.5 * mean_slope;
    Floor {
        innovation: innovation(autoregression),
        autoregression,
        relative_deviation: (0.25 / independent + (lever * colour_deviation).powi(2)).sqrt(),
        fits: false,
    }
}

/// Where a function is least between two bounds: a grid, then golden section around its best point.
fn least(cost: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    const POINTS: usize = 49;
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let spacing = (high - low) / (POINTS - 1) as f64;
    let grid = (0..POINTS).map(|i| low + i as f64 * spacing);
    let best = grid
        .min_by(|one, other| cost(*one).total_cmp(&cost(*other)))
        .unwrap_or(low);
    let (mut low, mut high) = ((best - spacing).max(low), (best + spacing).min(high));
    while high - low > 1e-4 {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if cost(left) < cost(right) {
            high = right;
        } else {
            low = left;
        }
    }
    0.5 * (low + high)
}

/// No part of the band stands far off the floor.
fn fits(floor: &Floor, bins: &[(f64, f64)], segments: f64) -> bool {
    bins.chunks(bins.len().div_ceil(BAND_PARTS)).all(|part| {
        let ratio = part
            .iter()
            .map(|(cosine, power)| power / floor.at(*cosine))
            .sum::<f64>()
            / part.len() as f64;
        let deviation = (BINS_PER_INDEPENDENT / (segments * part.len() as f64)).sqrt();
        (ratio - 1.0).abs() < (MISFIT_DEVIATIONS * deviation).max(MISFIT_SHARE)
    })
}
