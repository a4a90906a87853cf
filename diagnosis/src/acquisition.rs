//! The recorder's own low pass: found in the spectrum of what is left, applied to what is simulated.
//!
//! Butterworth of order n at f_c, of circuits |F(f)|² = 1/(1 + (f/f_c)^{2n}) or of the recorder's program (bilinear, prewarped)
//! 1/(1 + (tan(πfT)/tan(πf_cT))^{2n}); both as n/2 biquads (and one first-order section) in transposed form II, a circuit's without
//! prewarping, which keeps its delay. Noise that passes it has its shape above the actuator's band: there S(f) = A|F|² + q²/12
//! (q resolution; a circuit's folded at half the sampling rate) is held against A f^−p + B by the likelihood of Whittle.
//! A filter that no noise passes is not seen here; it acts as a delay.

use std::f64::consts::PI;

use crate::spectrum::Spectrum;
use crate::statistics::{quantile, sorted};

/// The actuator's own motion ends below this share of the sampling rate.
const FROM: f64 = 0.08;
/// Length of the windows in which the noise is looked at.
const WINDOW: usize = 512;
/// Of the windows, the quiet ones: what is not understood is loud in some of them only.
const QUIET: f64 = 0.3;
/// Fall of −ln L that makes it sure.
const SURE: f64 = 30.0;
/// A low pass whose −ln L is higher by more is none.
const LIKELY: f64 = 100.0;
/// Delays within this share are alike.
const ALIKE: f64 = 0.04;
const MAX_ALTERNATIVES: usize = 4;
/// Corners that are looked for, as shares of the sampling rate.
const MIN_CORNER: f64 = 0.03;
const MAX_CORNER: f64 = 0.46;
const ORDERS: [u32; 7] = [2, 3, 4, 5, 6, 7, 8];

/// A Butterworth low pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LowPass {
    pub order: u32,
    pub corner_hz: f64,
    /// Before the sampling.
    pub is_circuit: bool,
}

/// Low passes that are likely, with −ln L over the likeliest's, likeliest first.
pub(crate) type Likely = Vec<(f64, LowPass)>;

impl LowPass {
    /// Of the power at a frequency.
    fn power(&self, frequency_hz: f64, tick_s: f64) -> f64 {
        let of = |ratio: f64| 1.0 / (1.0 + ratio.powi(2 * self.order as i32));
        if self.is_circuit {
            let rate = 1.0 / tick_s;
            let folded = [frequency_hz, rate - frequency_hz, rate + frequency_hz];
            folded.iter().map(|own| of(own / self.corner_hz)).sum()
        } else {
            of((PI * frequency_hz * tick_s).tan() / (PI * self.corner_hz * tick_s).tan())
        }
    }

    /// Of slow motion, s.
    fn delay_s(&self, tick_s: f64) -> f64 {
        let order = self.order;
        let poles = (0..order).map(|pole| (PI * f64::from(2 * pole + 1) / f64::from(2 * order)).sin());
        let angle = PI * self.corner_hz * tick_s;
        let k = if self.is_circuit { angle } else { angle.tan() };
        poles.sum::<f64>() * 0.5 * tick_s / k
    }

    /// How long it remembers what it was fed before, s: e^−8 is left.
    pub fn memory_s(&self) -> f64 {
        let slowest = (PI / f64::from(2 * self.order)).sin();
        8.0 / (2.0 * PI * self.corner_hz * slowest)
    }

    /// What it makes of a series that rested at its first value.
    pub fn apply(&self, series: &mut [f64], tick_s: f64) {
        let angle = PI * self.corner_hz * tick_s;
        let k = if self.is_circuit { angle } else { angle.tan() };
        let first = series.first().copied().unwrap_or(0.0);
        for section in 0..self.order.div_ceil(2) {
            let (b0, b1, b2, a1, a2);
            if 2 * section + 1 == self.order {
                let norm = 1.0 / (1.0 + k);
                (b0, b1, b2, a1, a2) = (k * norm, k * norm, 0.0, (k - 1.0) * norm, 0.0);
            } else {
                let angle = PI * f64::from(2 * section + 1) / f64::from(2 * self.order);
                let damping = 2.0 * angle.sin();
                let norm = 1.0 / (1.0 + damping * k + k * k);
                let gain = k * k * norm;
                (b0, b1, b2) = (gain, 2.0 * gain, gain);
                (a1, a2) = (2.0 * (k * k - 1.0) * norm, (1.0 - damping * k + k * k) * norm);
            }
            let (mut one, mut two) = ((1.0 - b0) * first, (b2 - a2) * first);
            for value in series.iter_mut() {
                let input = *value;
                *value = b0 * input + one;
                one = b1 * input - a1 * *value + two;
                two = b2 * input - a2 * *value;
            }
        }
    }

    /// Low passes that the noise in what is left of an output allows, with −ln L over the best's, best first; none where it has not
    /// passed any. `resolution` is the step of its digits.
    pub fn seen(residual: &[f64], tick_s: f64, resolution: f64) -> Likely {
        let Some(levels) = quiet_spectrum(residual) else {
            return Vec::new();
        };
        let rate = 1.0 / tick_s;
        let lines: Vec<(f64, f64)> = levels
            .iter()
            .enumerate()
            .map(|(line, level)| ((line + 1) as f64 / WINDOW as f64, *level))
            .filter(|(share, _)| *share > FROM && *share < 0.49)
            .map(|(share, level)| (share * rate, level))
            .collect();
        let windows = (residual.len() / WINDOW) as f64;
        let floor = resolution * resolution / 12.0;
        // −ln L with the level A profiled out by rounds of A ← mean of (P/shape) weighted; floor fixed.
        let cost = |shape: &dyn Fn(f64) -> f64, floor: f64| {
            let mut level = lines.iter().map(|(_, p)| p).sum::<f64>() / lines.len() as f64;
            let at = |level: f64, f: f64| level * shape(f) + floor;
            for _ in 0..40 {
                let (mut above, mut below) = (0.0, 0.0);
                for (f, p) in &lines {
                    let s = at(level, *f);
                    let weight = shape(*f) / (s * s);
                    above += weight * (p - floor);
                    below += weight * shape(*f);
                }
                level = (above / below).max(1e-6 * level);
            }
            let sum = lines.iter().map(|(f, p)| {
                let s = at(level, *f);
                s.ln() + p / s
            });
            // Windows that overlap by half count once.
            windows * QUIET * sum.sum::<f64>()
        };
        // Noise of the sensor and a misfit that falls above: white, and a power of the frequency beside it.
        let white = lines.iter().map(|(_, p)| *p).fold(f64::INFINITY, f64::min);
        let floors = (0..=24).map(|step| floor + white * 10.0_f64.powf(f64::from(step - 12) / 12.0));
        let slanted = floors.flat_map(|floor| (1..=8).map(move |power| (floor, f64::from(power))));
        let slanted = slanted.map(|(floor, power)| cost(&|f: f64| (f * tick_s).powf(-power), floor));
        let plain = slanted.fold(cost(&|_| 1.0, floor), f64::min);
        let at = |low_pass: &LowPass| cost(&|f: f64| low_pass.power(f, tick_s), floor);
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
        assert_eq!(LowPass::seen(&white, tick_s, 0.0), []);
        let truth = LowPass {
            order: 4,
            corner_hz: 1800.0,
            is_circuit: false,
        };
        let mut filtered = white;
        truth.apply(&mut filtered, tick_s);
        let (_, found) = LowPass::seen(&filtered, tick_s, 0.0)[0];
        assert!(
            found.order.abs_diff(4) <= 1 && (found.corner_hz / 1800.0 - 1.0).abs() < 0.06,
            "{found:?}"
        );
    }

    /// Guards the filter itself: |F|² at, below and above the corner, and a constant passes unchanged from the first sample.
    #[test]
    fn a_sine_passes_as_the_equation_says() {
        let (tick_s, own) = (
            1e-4,
            LowPass {
                order: 3,
                corner_hz: 800.0,
                is_circuit: false,
            },
        );
        for frequency in [200.0, 800.0, 1600.0] {
            let mut sine: Vec<f64> = (0..20_000)
                .map(|k| (2.0 * PI * frequency * tick_s * f64::from(k)).sin())
                .collect();
            own.apply(&mut sine, tick_s);
            let power = 2.0 * sine[10_000..].iter().map(|y| y * y).sum::<f64>() / 10_000.0;
            assert!(
                (power / own.power(frequency, tick_s) - 1.0).abs() < 1e-3,
                "{frequency}: {power}"
            );
        }
        let mut constant = vec![2.5; 100];
        own.apply(&mut constant, tick_s);
        assert!(constant.iter().all(|own| (own - 2.5).abs() < 1e-9));
    }
}
