//! The recorder's own low pass: found in the spectrum of what is left, applied to what is simulated.
//!
//! Butterworth of order n at f_c: F = 1/Π_k (j x − e^{jπ(2k + n + 1)/2n}), |F|² = 1/(1 + x^{2n}), of circuits x = f/f_c, of the recorder's
//! program (bilinear, prewarped) x = tan(πfT)/tan(πf_cT); applied to the whole run's spectrum, so exact for both: of what is smooth by F, of
//! the coil's field with the images of the command's straight lines. Noise that passes it has its
//! shape above the actuator's band: there S(f) = A|F|²(1 + r/fT) + q²/12 (r share like 1/f,
//! q resolution; a circuit's folded at half the sampling rate) is held against A f^−p + B by the likelihood of Whittle.
//! A filter that no noise passes is not seen here; it acts as a delay.

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
        found.sort_by(|one, other| one.0.total_cmp(&other.0));
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
mod tests {
    use super::*;

    fn noise(samples: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..samples).map(|_| (0..12).map(|_| uniform()).sum()).collect()
    }

    /// Guards against a delay that is the recorder's: the low pass is found from the noise alone, and white noise has none.
    #[test]
    fn a_low_pass_is_seen_in_the_noise() {
        let tick_s = 1e-4;
        let white = noise(40_000);
        assert_eq!(LowPass::seen(&white, tick_s, 0.0, FROM[0], 0.0), []);
        let spectrum = Spectrum::new(40_000);
        // Noise like 1/f beside the white falls sooner, as if the corner were lower: out of the box of its prior, three times 5 %.
        for (order, corner_hz, pink, off) in [(4, 1800.0, 0.0, 0.06), (2, 1300.0, 0.1, 0.15)] {
            let truth = LowPass {
                order,
                corner_hz,
                is_circuit: false,
                is_supposed: false,
                is_shared: false,
            };
            let mut packed = spectrum.of(&white);
            for (line, own) in packed[1..].chunks_mut(2).enumerate() {
                let share = (line + 1) as f64 / 40_000.0;
                own.iter_mut().for_each(|own| *own *= (1.0_f64 + pink / share).sqrt());
            }
            let mut filtered = spectrum.back(&packed);
            truth.apply(&mut filtered, tick_s, &spectrum, &truth.responses(tick_s, 40_000), &[]);
            let (_, found) = LowPass::seen(&filtered, tick_s, 0.0, FROM[0], 0.0)[0];
            assert!(
                found.order.abs_diff(order) <= 1 && (found.corner_hz / corner_hz).ln().abs() < off,
                "{found:?}"
            );
        }
    }

    /// Guards the images: a filter of first order of straight lines, behind a lag or a delay, has a closed form.
    #[test]
    fn straight_lines_pass_as_they_are_solved() {
        let (tick_s, rows, corner_hz) = (1e-4, 2000, 1500.0);
        let own = LowPass {
            order: 1,
            corner_hz,
            is_circuit: true,
            is_supposed: false,
            is_shared: false,
        };
        let ticks = 1.0 / (2.0 * PI * corner_hz * tick_s);
        // y' = (u − y)/τ a share of a tick after u_k, over u_k + 1; u goes from u_k to u_{k + 1}, τ in ticks, `back` one tick back.
        let after = |share: f64, ticks: f64, back: Complex<f64>| {
            let at = |share: f64| {
                let decay = (-share / ticks).exp();
                (decay, share - (1.0 - decay) * ticks)
            };
            let (decay, rise) = at(1.0);
            let whole = (back * (1.0 - decay - rise) + rise) / (-back * decay + 1.0);
            let (decay, rise) = at(share);
            back * whole * decay + back * (1.0 - decay - rise) + rise
        };
        let behind = |lag: f64, delay: f64, back: Complex<f64>| {
            let field = if lag > 0.0 {
                after(1.0, lag, back)
            } else {
                back * delay + (1.0 - delay)
            };
            // 1/((1 + sτ)(1 + sl)) by its parts.
            let filtered = after(1.0 - delay, ticks, back) * ticks;
            let lagged = if lag > 0.0 {
                after(1.0, lag, back) * lag
            } else {
                Complex::default()
            };
            (field, (filtered - lagged) / (ticks - lag))
        };
        for (lag, delay) in [(0.0, 0.0), (0.3, 0.0), (0.0, 0.5), (0.0, 0.8)] {
            let before = Before {
                lag_s: lag * tick_s,
                delay_s: delay * tick_s,
                ..Before::default()
            };
            let images = own.images(&before, tick_s, rows);
            let plain = own.responses(tick_s, rows);
            for (line, (image, plain)) in images.into_iter().zip(plain).enumerate().skip(20).take(180) {
                let back = Complex::from_polar(1.0, -2.0 * PI * (line + 1) as f64 / rows as f64);
                let (field, solved) = behind(lag, delay, back);
                let (error, without) = ((plain * field + image - solved).norm(), (plain * field - solved).norm());
                assert!(
                    error < 2e-3 && error < 0.1 * without,
                    "{lag}, {delay}, {line}: {error} {without}"
                );
            }
        }
    }

    /// Guards what is summed at few places only: a fall like that of the images, to its last place.
    #[test]
    fn a_smooth_fall_is_known_between_its_nodes() {
        let fall = |share: f64| Complex::new(1.0, 2.0 * PI * (share - 4.0)).inv() / (share - 4.0).powi(2);
        let nodes: Vec<Complex<f64>> = (-1..=NODES + 2)
            .map(|node| fall(0.5 * f64::from(node) / f64::from(NODES)))
            .collect();
        for line in 1..=1000 {
            let share = 0.5 * f64::from(line) / 1000.0;
            let own = between(&nodes, 2.0 * share * f64::from(NODES));
            assert!((own / fall(share) - 1.0).norm() < 1e-8, "{share}: {own}");
        }
    }

    /// Guards the filter itself: below the corner its delay, at, below and above it |F|², and a line is only delayed.
    #[test]
    fn a_sine_passes_as_the_equation_says() {
        let (tick_s, rows) = (1e-4, 20_000);
        let spectrum = Spectrum::new(rows);
        for is_circuit in [false, true] {
            let own = LowPass {
                order: 3,
                corner_hz: 800.0,
                is_circuit,
                is_supposed: false,
                is_shared: false,
            };
            for frequency in [20.0, 200.0, 800.0, 1600.0] {
                let sine = |delay_s: f64| {
                    let at = move |row: usize| 2.0 * PI * frequency * (row as f64 * tick_s - delay_s);
                    (0..rows).map(move |row| at(row).sin())
                };
                let mut passed: Vec<f64> = sine(0.0).collect();
                own.apply(&mut passed, tick_s, &spectrum, &own.responses(tick_s, rows), &[]);
                let power = 2.0 * passed[10_000..].iter().map(|y| y * y).sum::<f64>() / 10_000.0;
                let expected = own.response(tick_s)(frequency * tick_s).norm_sqr();
                assert!((power / expected - 1.0).abs() < 1e-3, "{frequency}: {power}");
                if frequency < 100.0 {
                    let delayed = sine(own.delay_s(tick_s)).zip(&passed).skip(100);
                    assert!(delayed.take(19_000).all(|(one, other)| (one - other).abs() < 1e-4));
                }
                if is_circuit {
                    assert!((expected - 1.0 / (1.0 + (frequency / 800.0).powi(6))).abs() < 1e-12);
                }
            }
            let mut line: Vec<f64> = (0..rows).map(|row| 2.5 + row as f64).collect();
            own.apply(&mut line, tick_s, &spectrum, &own.responses(tick_s, rows), &[]);
            let delayed = |row: usize| 2.5 + row as f64 - own.delay_s(tick_s) / tick_s;
            assert!((0..rows).all(|row| (line[row] - delayed(row)).abs() < 1e-6));
        }
    }
}
