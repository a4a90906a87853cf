//! What a fall of J is worth where what is left is more than noise: the misfit of a model that is nearly right is no noise.
//!
//! Whittle's likelihood takes all N_b numbers of a band for independent. Those of noise are; a misfit (another form of the same law, an
//! effect that nobody listed) repeats with the drive, and is as sure as a few numbers. With n_b the noise of a band, L_b its level, and
//! D = Σ N_b max(0, L_b − n_b)/Σ N_b n_b a channel's misfit over its noise, the evidence against a fit is
//!
//!   E = ½ Σ_b N_b ln min(L_b, n_b) + ½ M Σ_c ln(1 + D_c) + ½ Σ ((q − μ)/σ)²
//!
//! where the best fit leaves a misfit, and J where it reaches the noise. So of two misfits that with less energy wins: to earn its place an
//! effect must leave less than e^{−2·JOINS/M} = 37 % of it, and those that leave alike to e^{2·TIES/M} = 1.5 tie. For intervals the misfit is
//! noise of level D/M in each of its bands, and no number has more than its band's whole energy.
//! n_b is what the measurement itself shows, white, and as much noise like 1/f as the bands of the best fit leave room for.

use crate::channel::Channel;
use crate::likelihood::{Bench, Point};

/// What is left may be this multiple of the noise that the measurement itself shows where nothing is said to be missing.
pub(crate) const LACK_OF_FIT: f64 = 3.0;
/// A misfit of this share of the noise's energy is one.
const MISFIT: f64 = 0.5;
/// M: independent numbers of a channel's misfit.
const MISFIT_NUMBERS: f64 = 60.0;
/// So much of what shows as white may be noise like 1/f, tried in so many steps.
const MAX_LEAK: f64 = 0.2;
const LEAKS: usize = 10;
/// Share of a low pass' own band in which it hides no noise.
const WELL_PASSED: f64 = 0.7;

/// What is noise and what is misfit, told by the best fit.
pub(crate) struct Evidence<'a> {
    bench: &'a Bench,
    bands: Vec<Noise>,
    /// The best fit leaves a misfit.
    pub is_misfit: bool,
}

/// Of one band.
struct Noise {
    channel: usize,
    count: f64,
    /// Variance by noise.
    variance: f64,
}

impl Noise {
    /// Energy of a level beyond the noise's.
    fn misfit(&self, level: f64) -> f64 {
        self.count * (level - self.variance).max(0.0)
    }
}

impl<'a> Evidence<'a> {
    /// By the best fit.
    pub fn new(bench: &'a Bench, best: &Point) -> Self {
        let channels = &bench.plant.channels;
        let by_channel: Vec<(f64, f64)> = channels.iter().map(|own| noise(bench, best, own)).collect();
        let bands = bench.bands.iter().zip(&bench.counts).map(|(band, count)| {
            let channel = channels
                .iter()
                .position(|own| own.places.contains(&band[0]))
                .unwrap_or(0);
            let (white, pink) = by_channel[channel];
            Noise {
                channel,
                count: *count,
                variance: white + pink / middle(band, &channels[channel]),
            }
        });
        let mut own = Evidence {
            bands: bands.collect(),
            bench,
            is_misfit: false,
        };
        // A fitted model's own error has a level of its own (`bands.rs`).
        own.is_misfit = own.is_misfit_at(&best.levels);
        own
    }

    /// Some levels leave more than noise.
    pub fn is_misfit_at(&self, levels: &[f64]) -> bool {
        !self.bench.plant.fitted && self.misfits(levels).iter().any(|own| *own > MISFIT)
    }

    /// E of a point.
    pub fn cost(&self, point: &Point) -> f64 {
        self.cost_of(&point.levels) + point.cost - self.bench.cost(&point.levels)
    }

    /// E of some levels alone.
    pub fn cost_of(&self, levels: &[f64]) -> f64 {
        if !self.is_misfit {
            return self.bench.cost(levels);
        }
        let clipped = |(own, level): (&Noise, &f64)| own.count * level.min(own.variance).ln();
        let noise: f64 = self.bands.iter().zip(levels).map(clipped).sum();
        0.5 * (noise + MISFIT_NUMBERS * self.misfits(levels).iter().map(|own| own.ln_1p()).sum::<f64>())
    }

    /// Fall of J from some levels down to the noise: as far as that is known, no more can be gained.
    pub fn to_noise(&self, levels: &[f64]) -> f64 {
        let above = |(own, level): (&Noise, &f64)| own.count * (level / own.variance).ln().max(0.0);
        0.5 * self.bands.iter().zip(levels).map(above).sum::<f64>()
    }

    /// Rms of each channel's noise; what some levels hold less is no noise's chance, but a low pass.
    pub fn noise_rms(&self, levels: &[f64]) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.bench.plant.channels.len()];
        for ((own, level), band) in self.bands.iter().zip(levels).zip(&self.bench.bands) {
            sums[own.channel].0 += own.count * at_most(band, *level).min(own.variance);
            sums[own.channel].1 += own.count;
        }
        let rms = |(energy, count): &(f64, f64)| (energy / count.max(1.0)).sqrt();
        sums.iter().map(rms).collect()
    }

    /// D of each channel.
    fn misfits(&self, levels: &[f64]) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.bench.plant.channels.len()];
        for (own, level) in self.bands.iter().zip(levels) {
            sums[own.channel].0 += own.misfit(*level);
            sums[own.channel].1 += own.count * own.variance;
        }
        sums.iter()
            .map(|(misfit, noise): &(f64, f64)| misfit / noise.max(f64::MIN_POSITIVE))
            .collect()
    }

    /// Levels that stand in the way of a column.
    pub fn levels(&self, point: &Point) -> Vec<f64> {
        if !self.is_misfit {
            return point.levels.clone();
        }
        let mut each = vec![0.0; self.bench.plant.channels.len()];
        for (own, level) in self.bands.iter().zip(&point.levels) {
            each[own.channel] += own.misfit(*level) / MISFIT_NUMBERS;
        }
        let bands = self.bands.iter().zip(&point.levels);
        bands
            .map(|(own, level)| match own.misfit(*level) {
                0.0 => *level,
                energy => own.variance + energy.min(each[own.channel]),
            })
            .collect()
    }
}

/// White part of a channel's noise, and of its part like 1/f the variance at place 1: of all that the bands leave room for the pair with most
/// energy. What shows as white has some of the other in it.
fn noise(bench: &Bench, best: &Point, channel: &Channel) -> (f64, f64) {
    let shown = noise_variance(bench, best, channel);
    let bands: Vec<(f64, f64, f64)> = well_passed(bench, best, channel)
        .map(|(band, level)| (band.len() as f64, middle(band, channel), at_most(band, level)))
        .collect();
    // A misfit that is large everywhere would look like it, too.
    let energy = |of: fn(&(f64, f64, f64)) -> f64| bands.iter().map(|own| own.0 * of(own)).sum::<f64>();
    let is_close = energy(|own| own.2) < LACK_OF_FIT * LACK_OF_FIT * shown * energy(|_| 1.0);
    let leaks = if is_close { LEAKS } else { 0 };
    let pairs = (0..=leaks).map(|step| {
        let white = shown * (1.0 - MAX_LEAK * step as f64 / LEAKS as f64);
        let room = bands.iter().map(|(_, middle, most)| (most - white).max(0.0) * middle);
        let pink = room.reduce(f64::min).unwrap_or(0.0);
        let energy: f64 = bands
            .iter()
            .map(|(count, middle, _)| count * (white + pink / middle))
            .sum();
        (energy, white, pink)
    });
    let best = pairs.reduce(|one, other| if other.0 > one.0 { other } else { one });
    best.map_or((shown, 0.0), |(_, white, pink)| (white, pink))
}

/// Bands of a channel with their levels, as far as no low pass hides their noise.
fn well_passed<'a>(
    bench: &'a Bench,
    point: &'a Point,
    channel: &'a Channel,
) -> impl Iterator<Item = (&'a Vec<usize>, f64)> {
    let share = passed(bench, point, channel).map_or(1.0, |share| WELL_PASSED * share);
    let most = share * channel.places.len() as f64;
    let bands = bench.bands.iter().zip(&point.levels);
    bands.filter_map(move |(band, level)| {
        let end = band.last().map_or(0, |last| last + 1);
        let inside = channel.places.contains(&band[0]) && (end - channel.places.start) as f64 <= most;
        inside.then_some((band, *level))
    })
}

/// What a band's variance may be, of which a few numbers show less by chance.
fn at_most(band: &[usize], level: f64) -> f64 {
    level * (1.0 + 3.0 * (2.0 / band.len() as f64).sqrt())
}

/// Of a band's places within its channel.
fn middle(band: &[usize], channel: &Channel) -> f64 {
    let (first, last) = (band[0], band[band.len() - 1]);
    0.5 * (first + last) as f64 - channel.places.start as f64
}

/// Rms of the first output's noise: what the measurement itself shows, or where a low pass hides it, the level of the quietest bands.
pub(crate) fn noise_rms(bench: &Bench, point: &Point) -> f64 {
    let Some((_, channel)) = bench.plant.outputs().next() else {
        return 0.0;
    };
    let share = passed(bench, point, channel).unwrap_or(1.0);
    (noise_variance(bench, point, channel) * share).sqrt()
}

/// Variance of a number of a channel's spectrum by white noise alone.
fn noise_variance(bench: &Bench, point: &Point, channel: &Channel) -> f64 {
    let own = channel.noise_rms * channel.noise_rms;
    if passed(bench, point, channel).is_none() {
        return own;
    }
    let levels = well_passed(bench, point, channel).map(|(band, level)| at_most(band, level));
    levels.reduce(f64::min).unwrap_or(own)
}

/// Share of the band up to half the sampling rate that a low pass leaves of a channel.
fn passed(bench: &Bench, point: &Point, channel: &Channel) -> Option<f64> {
    let low_pass = point.composition.fitted_low_pass(channel.kind)?;
    Some(2.0 * low_pass.corner_hz * bench.plant.runs[channel.run].tick_s?)
}
