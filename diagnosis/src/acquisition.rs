//! The recorder's own low pass: found in the spectrum of what is left, applied to what is simulated.
//!
//! Butterworth of order n at f_c: F = 1/Π_k (j x − e^{jπ(2k + n + 1)/2n}), |F|² = 1/(1 + x^{2n}), of circuits x = f/f_c, of the recorder's
//! program (bilinear, prewarped) x = tan(πfT)/tan(πf_cT); applied to the whole run's spectrum, so exact for both: of what is smooth by F, of
//! the coil's field with the images of the command's straight lines. Noise that passes it has its
//! shape above the actuator's band: there S(f) = A|F|²(1 + r/fT) + q²/12 (r share like 1/f,
//! q resolution; a circuit's folded at half the sampling rate) is held against A f^−p + B by the likelihood of Whittle.
//! A filter that no noise passes is not seen here; it acts as a delay.

use anhyst_identify::order::ascending;
use std::f64::consts::PI;

use anhyst_model::{ActuatorModel, EffectKind};
use realfft::num_complex::Complex;

use crate::spectrum::Spectrum;
use crate::statistics::{quantile, sorted};

/// The actuator's own motion ends below this share of the sampling rate; where it is explained, most of it does not stand out from the other on.
pub(crate) const FROM: [f64; 2] = [0.08, 0.02];
/// Length of the windows in which the noise is looked at.
const WINDOW: usize = 512;
/// Power of what is left by that of a converter's steps from which on it is noise: of true noise it was seen above 900, of steps below 2.
const STEPS: f64 = 30.0;
/// Of the windows, the quiet ones: what is not understood is loud in some of them only.
const QUIET: f64 = 0.3;
/// Fall of −ln L that makes it sure.
const SURE: f64 = 30.0;
/// A low pass whose −ln L is higher by more is none.
const LIKELY: f64 = 100.0;
/// Delays within this share are alike.
const ALIKE: f64 = 0.04;
const MAX_ALTERNATIVES: usize = 4;
/// Rounds in which a level settles, to such a share.
const MAX_ROUNDS: u32 = 40;
const SETTLED: f64 = 1e-6;
/// Corners that are looked for, as shares of the sampling rate.
const MIN_CORNER: f64 = 0.03;
const MAX_CORNER: f64 = 0.46;
/// Shares of noise like 1/f: as much as white noise over a run, and what is beside it.
const PINK: [f64; 4] = [0.0, 0.015, 0.05, 0.15];
/// Images of a line on each side of it that a filter passes, and that a drive has.
const IMAGES: i32 = 3;
const TAIL: i32 = 24;
/// Between 0 and half the sampling rate those far above the corner are summed at so many places.
const NODES: i32 = 32;
pub(crate) const ORDERS: [u32; 7] = [2, 3, 4, 5, 6, 7, 8];

/// A Butterworth low pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LowPass {
    pub order: u32,
    pub corner_hz: f64,
    /// Before the sampling.
    pub is_circuit: bool,
    /// No noise shows it; a motion that comes late does.
    pub is_supposed: bool,
    /// It has the corner of the other channel's: one recorder has one filter.
    pub is_shared: bool,
}

/// Low passes that are likely, with −ln L over the likeliest's, likeliest first.
pub(crate) type Likely = Vec<(f64, LowPass)>;

impl LowPass {
    /// The same where no noise shows it.
    pub fn supposed(self) -> Self {
        LowPass {
            is_supposed: true,
            ..self
        }
    }

    /// The same with the corner of the other channel's.
    pub fn shared(self) -> Self {
        LowPass {
            is_shared: true,
            ..self.supposed()
        }
    }

    /// Of the power at shares of the sampling rate.
    fn powers(&self, shares: &[f64], tick_s: f64) -> Vec<f64> {
        let of = |ratio: f64| 1.0 / (1.0 + ratio.powi(2 * self.order as i32));
        let corner = self.corner_hz * tick_s;
        if self.is_circuit {
            let folded = |share: f64| {
                [share, 1.0 - share, 1.0 + share]
                    .map(|own| of(own / corner))
                    .iter()
                    .sum()
            };
            shares.iter().map(|share| folded(*share)).collect()
        } else {
            let at_corner = (PI * corner).tan();
            shares.iter().map(|share| of((PI * share).tan() / at_corner)).collect()
        }
    }

    /// It passes less than all that the samples hold.
    pub fn is_in_band(&self, tick_s: f64) -> bool {
        self.corner_hz * tick_s < MAX_CORNER
    }

    /// Of another order that delays slow motion alike.
    pub fn of_order(self, order: u32) -> Self {
        LowPass {
            order,
            corner_hz: self.corner_hz * delay_angle(order) / delay_angle(self.order),
            ..self
        }
    }

    /// The same at the corner where slow motion comes later by so much.
    pub fn delayed(self, by_s: f64, tick_s: f64) -> Self {
        let own_s = self.delay_s(tick_s);
        LowPass {
            corner_hz: self.corner_hz * own_s / (own_s + by_s),
            ..self
        }
    }

    /// Of slow motion, s.
    fn delay_s(&self, tick_s: f64) -> f64 {
        let angle = PI * self.corner_hz * tick_s;
        let k = if self.is_circuit { angle } else { angle.tan() };
        delay_angle(self.order) * 0.5 * tick_s / k
    }

    /// How long it remembers what it was fed before, s: e^−8 is left.
    pub fn memory_s(&self) -> f64 {
        let slowest = (PI / f64::from(2 * self.order)).sin();
        8.0 / (2.0 * PI * self.corner_hz * slowest)
    }

    /// F by the share of the sampling rate.
    fn response(&self, tick_s: f64) -> impl Fn(f64) -> Complex<f64> {
        let order = self.order;
        let corner = self.corner_hz * tick_s;
        let pole = move |k: u32| Complex::from_polar(1.0, PI * f64::from(2 * k + order + 1) / f64::from(2 * order));
        let poles: Vec<Complex<f64>> = (0..order).map(pole).collect();
        let (is_circuit, at_corner) = (self.is_circuit, (PI * corner).tan());
        move |share| {
            let ratio = if is_circuit {
                share / corner
            } else {
                (PI * share).tan() / at_corner
            };
            poles
                .iter()
                .map(|pole| Complex::new(0.0, ratio) - pole)
                .product::<Complex<f64>>()
                .inv()
        }
    }

    /// F of each line from the first on of a series of so many rows.
    pub fn responses(&self, tick_s: f64, rows: usize) -> Vec<Complex<f64>> {
        let response = self.response(tick_s);
        (1..=rows / 2).map(|line| response(line as f64 / rows as f64)).collect()
    }

    /// What folds back from above half the sampling rate of a field whose drive is a straight line between its rows, of each line of the drive:
    /// for a circuit Σ_m≠0 sinc²(s + m) H(s + m) (F(s + m) − F(s)), s share of the sampling rate, H what is before the filter.
    pub fn images(&self, before: &Before, tick_s: f64, rows: usize) -> Vec<Complex<f64>> {
        if !self.is_circuit {
            return Vec::new();
        }
        let response = self.response(tick_s);
        let turned = |share: f64| Complex::from_polar(1.0, -2.0 * PI * share * before.delay_s / tick_s);
        let turns: Vec<Complex<f64>> = (-TAIL..=TAIL).map(|m| turned(f64::from(m))).collect();
        let image = |share: f64, m: i32| {
            let place = share + f64::from(m);
            before.lagged(place / tick_s) * turns[(m + TAIL) as usize] / (place * place)
        };
        // So far above the corner nothing passes; what the samples have of it is smooth in s.
        let far = |node: i32| {
            let outside = (-TAIL..=TAIL).filter(|m| m.abs() > IMAGES);
            let all = outside.map(|m| image(0.5 * f64::from(node) / f64::from(NODES), m));
            all.sum::<Complex<f64>>()
        };
        let nodes: Vec<Complex<f64>> = (-1..=NODES + 2).map(far).collect();
        let folded = |share: f64| {
            let own = response(share);
            let power = ((PI * share).sin() / PI).powi(2);
            let inside = (-IMAGES..=IMAGES).filter(|m| *m != 0);
            let near = inside.map(|m| (response(share + f64::from(m)) - own) * image(share, m));
            let passed = near.sum::<Complex<f64>>() - own * between(&nodes, 2.0 * share * f64::from(NODES));
            turned(share) * passed * power
        };
        (1..=rows / 2).map(|line| folded(line as f64 / rows as f64)).collect()
    }

    /// What it makes of a series, but for the time that it remembers at its begin, by its [`LowPass::responses`] and what else is in the spectrum.
    pub fn apply(
        &self,
        series: &mut [f64],
        tick_s: f64,
        spectrum: &Spectrum,
        responses: &[Complex<f64>],
        added: &[Complex<f64>],
    ) {
        let line = end_to_end(series);
        let mut packed = periodic(series, spectrum);
        for (line, (own, response)) in packed[1..].chunks_mut(2).zip(responses).enumerate() {
            let added = added.get(line).copied().unwrap_or_default();
            match own {
                [re, im] => {
                    let passed = Complex::new(*re, *im) * response + added;
                    (*re, *im) = (passed.re, passed.im);
                }
                own => own[0] = own[0] * response.re + added.re,
            }
        }
        let delay = self.delay_s(tick_s) / tick_s;
        for (row, (own, passed)) in series.iter_mut().zip(spectrum.back(&packed)).enumerate() {
            *own = passed + line(row as f64 - delay);
        }
    }

    /// Low passes that the noise in what is left of an output allows, with −ln L over the best's, best first; none where it has not
    /// passed any, from a share of the sampling rate on, or does not stand out of a converter's `steps`, whose own spectrum falls.
    /// `resolution` is the step of its digits.
    pub fn seen(residual: &[f64], tick_s: f64, resolution: f64, from: f64, steps: f64) -> Likely {
        let Some(levels) = quiet_spectrum(residual) else {
            return Vec::new();
        };
        let rate = 1.0 / tick_s;
        let lines = levels
            .iter()
            .enumerate()
            .map(|(line, level)| ((line + 1) as f64 / WINDOW as f64, *level));
        let (shares, lines): (Vec<f64>, Vec<f64>) = lines.filter(|(share, _)| *share > from && *share < 0.49).unzip();
        if lines.iter().sum::<f64>() < STEPS * steps * steps / 12.0 * lines.len() as f64 {
            return Vec::new();
        }
        let windows = (residual.len() / WINDOW) as f64;
        let floor = resolution * resolution / 12.0;
        // −ln L with the level A profiled out by rounds of A ← mean of (P/shape) weighted; floor fixed.
        let cost = |shapes: &[f64], floor: f64| {
            let mut level = lines.iter().sum::<f64>() / lines.len() as f64;
            for _ in 0..MAX_ROUNDS {
                let (mut above, mut below) = (0.0, 0.0);
                for (shape, p) in shapes.iter().zip(&lines) {
                    let s = level * shape + floor;
                    let weight = shape / (s * s);
                    above += weight * (p - floor);
                    below += weight * shape;
                }
                let before = level;
                level = (above / below).max(1e-6 * level);
                if (level - before).abs() <= SETTLED * before {
                    break;
                }
            }
            let sum = shapes.iter().zip(&lines).map(|(shape, p)| {
                let s = level * shape + floor;
                s.ln() + p / s
            });
            // Windows that overlap by half count once.
            windows * QUIET * sum.sum::<f64>()
        };
        // Noise of the sensor and a misfit that falls above: white, and a power of the frequency beside it.
        let white = lines.iter().copied().fold(f64::INFINITY, f64::min);
        let slanted = (1..=8).flat_map(|power: i32| {
            let shapes: Vec<f64> = shares.iter().map(|share| share.powi(-power)).collect();
            let floors = (-12..=12).map(|step| floor + white * 10.0_f64.powf(f64::from(step) / 12.0));
            floors.map(|floor| cost(&shapes, floor)).collect::<Vec<f64>>()
        });
        let plain = slanted.fold(cost(&vec![1.0; lines.len()], floor), f64::min);
        let at = |low_pass: &LowPass| {
            let powers = low_pass.powers(&shares, tick_s);
            let with = |pink: f64| {
                let shapes = powers
                    .iter()
                    .zip(&shares)
                    .map(|(power, share)| power * (1.0 + pink / share));
                cost(&shapes.collect::<Vec<f64>>(), floor)
            };
            PINK.map(with).into_iter().fold(f64::INFINITY, f64::min)
        };
        let best_of = |family: LowPass, corners: &mut dyn Iterator<Item = f64>| {
            let all = corners.filter(|corner_hz| *corner_hz < MAX_CORNER * rate);
            let all = all.map(|corner_hz| LowPass { corner_hz, ..family });
            all.map(|own| (at(&own), own))
                .min_by(|one, other| one.0.total_cmp(&other.0))
        };
        let mut found: Vec<(f64, LowPass)> = Vec::new();
        for (order, is_circuit) in ORDERS.into_iter().flat_map(|order| [(order, false), (order, true)]) {
            let family = LowPass {
                order,
                corner_hz: 0.0,
                is_circuit,
                is_supposed: false,
                is_shared: false,
            };
            let ratio = MAX_CORNER / MIN_CORNER;
            let mut coarse = (0..=32).map(|step| rate * MIN_CORNER * ratio.powf(f64::from(step) / 32.1));
            let coarse = best_of(family, &mut coarse);
            let fine = coarse.and_then(|(_, own)| {
                best_of(
                    own,
                    &mut (-8..=8).map(|step| own.corner_hz * (1.0 + 0.01 * f64::from(step))),
                )
            });
            found.extend(fine);
        }
        ascending(&mut found, |own| own.0);
        let least = found.first().map_or(f64::INFINITY, |(own, _)| *own);
        found.retain(|(own, _)| plain - own > SURE && own - least < LIKELY);
        // Of those that delay alike the likeliest.
        let mut delays_s: Vec<f64> = Vec::new();
        found.retain(|(_, own)| {
            let delay_s = own.delay_s(tick_s);
            let is_new = delays_s.iter().all(|other| (delay_s / other - 1.0).abs() > ALIKE);
            delays_s.push(delay_s);
            is_new
        });
        found.truncate(MAX_ALTERNATIVES);
        found
            .into_iter()
            .map(|(own, low_pass)| (own - least, low_pass))
            .collect()
    }
}

/// At a place among equidistant nodes, the first of which is at −1: by the cubic through the four around it.
fn between(nodes: &[Complex<f64>], place: f64) -> Complex<f64> {
    let from = place as usize;
    let t = place - from as f64;
    let weights = [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ];
    nodes[from..]
        .iter()
        .zip(weights)
        .map(|(own, weight)| own * weight)
        .sum()
}

/// The straight line from the first sample to the last, by row.
fn end_to_end(series: &[f64]) -> impl Fn(f64) -> f64 + use<> {
    let (first, last, rows) = (series[0], series[series.len() - 1], series.len() as f64);
    move |row| first + (last - first) * row / (rows - 1.0)
}

/// Spectrum without the line from end to end, which a filter only delays: what is left goes round without a jump.
pub(crate) fn periodic(series: &[f64], spectrum: &Spectrum) -> Vec<f64> {
    let line = end_to_end(series);
    let round = series.iter().enumerate().map(|(row, own)| own - line(row as f64));
    spectrum.of(&round.collect::<Vec<f64>>())
}

/// What a drive passes before the recorder's filter: H = e^(−sd)/((1 + sτ₀)(1 + sτ + q s²τ²)), the amplifier's delay and lags.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Before {
    delay_s: f64,
    nominal_lag_s: f64,
    lag_s: f64,
    second_order: f64,
}

impl Before {
    pub fn of(model: &ActuatorModel) -> Self {
        let value = |kind: EffectKind, place: usize| model.effect(kind).map_or(0.0, |effect| effect.values()[place]);
        Before {
            delay_s: value(EffectKind::LoopDelay, 0),
            nominal_lag_s: model.amplifier.lag_s(),
            lag_s: value(EffectKind::AmplifierBandwidth, 0),
            second_order: value(EffectKind::AmplifierBandwidth, 1),
        }
    }

    /// Without the delay.
    fn lagged(&self, hz: f64) -> Complex<f64> {
        let angle = 2.0 * PI * hz;
        let lag = angle * self.lag_s;
        let nominal = Complex::new(1.0, angle * self.nominal_lag_s);
        (nominal * Complex::new(1.0 - self.second_order * lag * lag, lag)).inv()
    }
}

/// 2π f_c times the delay of slow motion behind a circuit.
fn delay_angle(order: u32) -> f64 {
    let poles = (0..order).map(|pole| (PI * f64::from(2 * pole + 1) / f64::from(2 * order)).sin());
    poles.sum()
}

/// Power of the lines of windows of [`WINDOW`] samples (Hann, half overlapping), of the quiet ones; in units of the series squared.
fn quiet_spectrum(series: &[f64]) -> Option<Vec<f64>> {
    if series.len() < 4 * WINDOW {
        return None;
    }
    let spectrum = Spectrum::new(WINDOW);
    let taper: Vec<f64> = (0..WINDOW)
        .map(|k| (2.0_f64 / 3.0).sqrt() * (1.0 - (2.0 * PI * k as f64 / WINDOW as f64).cos()))
        .collect();
    let starts = (0..=series.len() - WINDOW).step_by(WINDOW / 2);
    let windows: Vec<Vec<f64>> = starts
        .map(|from| {
            let own = &series[from..from + WINDOW];
            let mean = own.iter().sum::<f64>() / WINDOW as f64;
            let tapered: Vec<f64> = own.iter().zip(&taper).map(|(y, w)| (y - mean) * w).collect();
            Spectrum::powers(&spectrum.of(&tapered))
        })
        .collect();
    // The quantile of an exponential distribution, over its mean.
    let bias = -(1.0 - QUIET).ln();
    let level = |line: usize| quantile(&sorted(windows.iter().map(|own| own[line])), QUIET) / bias;
    Some((0..windows[0].len()).map(level).collect())
}

#[cfg(test)]
#[path = "acquisition_tests.rs"]
mod tests;
