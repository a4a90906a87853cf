//! How far the loop L is from −1: S = 1/(1 + L), T = L/(1 + L), with ω over the half circle (rad/s).
//!
//! Gain margin min 1/|L| where L crosses the real axis between −1 and 0: by so much all gains may grow. Phase margin
//! min (arg L + π) where |L| = 1 (rad), delay margin min (arg L + π)/ω there (s): by so much L may turn back, be later.
//! Ms = max |S|, Mt = max |T|; 1/Ms is the least distance of L from −1. Source: Åström and Murray, *Feedback Systems*, 10.3 and 13.3.

use crate::LoopShape;
use crate::complex::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// At one frequency: magnitudes, no unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoopPoint {
    pub frequency_hz: f64,
    /// |L|.
    pub open: f64,
    /// arg L, unbroken along the frequencies.
    pub phase_rad: f64,
    /// |S|: of an error from outside, what is left.
    pub sensitivity: f64,
    /// |T|: of the sensor's noise, what the tip does.
    pub complementary: f64,
}

/// A largest value and where it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Largest {
    /// No unit.
    pub value: f64,
    pub frequency_hz: f64,
}

/// The margins of a stable loop; none where nothing could be too much.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// All gains may be multiplied by this.
    pub gain: Option<f64>,
    pub phase_rad: Option<f64>,
    pub delay_s: Option<f64>,
    /// Where |L| crosses 1 with the least phase to spare.
    pub crossover_hz: Option<f64>,
    /// Below it errors are made smaller: |S| < 1. None without feedback.
    pub rejects_below_hz: Option<f64>,
    /// Ms; 1.4 to 2 is usual.
    pub sensitivity: Largest,
    /// Mt.
    pub complementary: Largest,
}

const ONE: Complex = Complex { re: 1.0, im: 0.0 };

fn point(omega: f64, open: Complex, phase_rad: f64) -> LoopPoint {
    let back = ONE.plus(open).magnitude().recip();
    LoopPoint {
        frequency_hz: omega / TAU,
        open: open.magnitude(),
        phase_rad,
        sensitivity: back,
        complementary: open.magnitude() * back,
    }
}

/// By how much L may turn back until it lies on the negative axis, in [0, 2π): the side on which delay comes.
fn spare_rad(open: Complex) -> f64 {
    let spare = libm::atan2(open.im, open.re) + PI;
    if spare >= TAU { 0.0 } else { spare }
}

fn larger(most: Largest, value: f64, omega: f64) -> Largest {
    let frequency_hz = omega / TAU;
    if value > most.value {
        Largest { value, frequency_hz }
    } else {
        most
    }
}

/// The lesser of what is there.
fn least(known: Option<f64>, other: f64) -> Option<f64> {
    Some(known.map_or(other, |known| known.min(other)))
}

impl LoopShape {
    /// L, S and T at `count` frequencies, evenly spaced in their logarithm up to half the sampling rate.
    pub fn points(&self, from_hz: f64, count: u32) -> Vec<LoopPoint> {
        let to_hz = self.highest_hz();
        let part = |index: u32| f64::from(index) / f64::from(count.max(2) - 1);
        let omegas = (0..count).map(|index| TAU * from_hz * libm::pow(to_hz / from_hz, part(index)));
        let (mut phase_rad, mut before) = (0.0, ONE);
        omegas
            .map(|omega| {
                let open = self.open(omega);
                let turn = open.over(std::mem::replace(&mut before, open));
                phase_rad += libm::atan2(turn.im, turn.re);
                point(omega, open, phase_rad)
            })
            .collect()
    }

    /// What the tip does of a white noise of the sensor, rms per rms: the root of the mean of |T|² up to half the sampling rate.
    pub fn noise_gain(&self) -> f64 {
        let gains = self
            .return_differences()
            .map(|(_, value)| value.minus(ONE).magnitude() / value.magnitude());
        let (sum, count) = gains.fold((0.0, 0.0), |(sum, count), gain| (sum + gain * gain, count + 1.0));
        libm::sqrt(sum / count)
    }

    /// The margins. They say something of a stable loop only.
    pub fn margins(&self) -> Margins {
        let nothing = Largest {
            value: 0.0,
            frequency_hz: 0.0,
        };
        let mut margins = Margins {
            gain: None,
            phase_rad: None,
            delay_s: None,
            crossover_hz: None,
            rejects_below_hz: None,
            sensitivity: nothing,
            complementary: nothing,
        };
        let mut before: Option<(f64, Complex)> = None;
        for (omega, value) in self.return_differences() {
            let open = value.minus(ONE);
            let back = value.magnitude().recip();
            if back >= 1.0 && margins.rejects_below_hz.is_none() && open != Complex::ZERO {
                margins.rejects_below_hz = Some(omega / TAU);
            }
            margins.sensitivity = larger(margins.sensitivity, back, omega);
            margins.complementary = larger(margins.complementary, open.magnitude() * back, omega);
            if let Some((omega_before, open_before)) = before {
                let between = |part: f64| {
                    let step = open.minus(open_before).scaled(part);
                    (omega_before + part * (omega - omega_before), open_before.plus(step))
                };
                margins.cross_one(open_before.magnitude() - 1.0, open.magnitude() - 1.0, between);
                margins.cross_axis(open_before.im, open.im, between);
            }
            before = Some((omega, open));
        }
        margins
    }
}

impl Margins {
    /// |L| − 1 goes from one value to another.
    fn cross_one(&mut self, from: f64, to: f64, between: impl Fn(f64) -> (f64, Complex)) {
        if from * to > 0.0 || from == to {
            return;
        }
        let (omega, open) = between(from / (from - to));
        let spare = spare_rad(open);
        if self.phase_rad.is_none_or(|known| spare < known) {
            (self.phase_rad, self.crossover_hz) = (Some(spare), Some(omega / TAU));
        }
        self.delay_s = least(self.delay_s, spare / omega);
    }

    /// Im L goes from one value to another.
    fn cross_axis(&mut self, from: f64, to: f64, between: impl Fn(f64) -> (f64, Complex)) {
        if from * to > 0.0 || from == to {
            return;
        }
        let (_, open) = between(from / (from - to));
        if (-1.0..0.0).contains(&open.re) {
            self.gain = least(self.gain, -open.re.recip());
        }
    }
}
