//! What every rig has beside its actuator: noise with a colour, lines, wrong scales and zeros, a filter before the converter, a past.
//!
//! Coloured noise: a sum of first-order noises, dn_i = −n_i dt/τ_i + …, τ_i from 0.5 s to 50 μs in equal ratios, variances as τ_i^(γ−1), which
//! is a spectrum like 1/f^γ in between. The filter is Butterworth's, by the bilinear transform at the step of integration, so that it is
//! the analogue one for all that passes. Noise comes before the filter, lines and drift (slow) count as behind it.

use crate::noise::Noise;
use std::f64::consts::{PI, TAU};

const COLOURS: i32 = 9;
const SLOWEST_S: f64 = 0.5;
/// τ_i over τ_i+1: nine from 0.5 s to 50 μs.
const RATIO: f64 = 3.162_277_66;

/// A sine on what is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// In the unit of its channel.
    pub amplitude: f64,
    pub hz: f64,
    pub phase: f64,
}

impl Tone {
    pub const NONE: Tone = Tone {
        amplitude: 0.0,
        hz: 50.0,
        phase: 0.0,
    };

    fn at(&self, time_s: f64) -> f64 {
        self.amplitude * (TAU * self.hz * time_s + self.phase).sin()
    }
}

/// Before the converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    pub order: usize,
    pub corner_hz: f64,
    /// On the measured field, too.
    pub field_too: bool,
}

/// Magnetising loops before the first row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past {
    pub amplitude_a_per_m: f64,
    pub hz: f64,
}

/// All of it; zero is absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Rms of the coloured noise (m), and γ.
    pub coloured_m: f64,
    pub colour: f64,
    /// On the displacement: mains, its third harmonic, another line.
    pub tones: [Tone; 3],
    /// On the measured field.
    pub field_tone: Tone,
    /// Share and zero (A/m) by which the measured field is off.
    pub probe: [f64; 2],
    /// Share and zero (A/m) by which the field exceeds what the record says was commanded.
    pub readback: [f64; 2],
    pub filter: Option<Filter>,
    pub past: Option<Past>,
    /// Zero of the sensor (m), its drift (m/s), and a part that settles (m) in half a second.
    pub zero_m: f64,
    pub drift_m_per_s: f64,
    pub settling_m: f64,
}

impl Surroundings {
    pub const NOTHING: Surroundings = Surroundings {
        coloured_m: 0.0,
        colour: 1.0,
        tones: [Tone::NONE; 3],
        field_tone: Tone::NONE,
        probe: [0.0; 2],
        readback: [0.0; 2],
        filter: None,
        past: None,
        zero_m: 0.0,
        drift_m_per_s: 0.0,
        settling_m: 0.0,
    };

    /// Lines, zero and drift of the displacement, m.
    pub(crate) fn added_m(&self, time_s: f64) -> f64 {
        let tones: f64 = self.tones.iter().map(|tone| tone.at(time_s)).sum();
        tones + self.zero_m + self.drift_m_per_s * time_s + self.settling_m * (-time_s / 0.5).exp()
    }

    /// What the probe makes of a field, A/m.
    pub(crate) fn probed(&self, field: f64, time_s: f64) -> f64 {
        (1.0 + self.probe[0]) * field + self.probe[1] + self.field_tone.at(time_s)
    }

    /// The field that the amplifier took for what the record says.
    pub(crate) fn commanded(&self, recorded: f64) -> f64 {
        (1.0 + self.readback[0]) * recorded + self.readback[1]
    }

    /// Loops, a way back to nothing, and a rest, before the first row.
    pub(crate) fn before(&self, tick_s: f64, one_sided: bool) -> Vec<f64> {
        let Some(past) = self.past else {
            // Only as long as a zero and a bias need to settle.
            return vec![0.0; (0.02 / tick_s) as usize];
        };
        let ticks = |seconds: f64| (seconds / tick_s) as usize;
        let looped = |tick: usize| {
            let phase = TAU * past.hz * tick as f64 * tick_s;
            let share = if one_sided {
                0.5 * (1.0 - phase.cos())
            } else {
                phase.sin()
            };
            past.amplitude_a_per_m * share
        };
        let (loops, back, rest) = (ticks(0.4), ticks(0.04), ticks(0.06));
        let last = looped(loops);
        (0..loops)
            .map(looped)
            .chain((0..back).map(|tick| 0.5 * last * (1.0 + (PI * tick as f64 / back as f64).cos())))
            .chain(std::iter::repeat_n(0.0, rest))
            .collect()
    }

    /// White noise of a displacement and the coloured beside it, at points `h` seconds apart of which a tick has `points`; m. White noise is
    /// as dense as that of `white_m` rms a tick.
    pub(crate) fn noise_m(&self, white_m: f64, rows: usize, points: usize, h: f64, noise: &mut Noise) -> Vec<f64> {
        let white = white_m * (points as f64).sqrt();
        let places: Vec<(f64, f64)> = (0..COLOURS)
            .map(|place| {
                let time_s = SLOWEST_S / RATIO.powi(place);
                (time_s, (time_s / SLOWEST_S).powf(self.colour - 1.0))
            })
            .collect();
        let all: f64 = places.iter().map(|(_, variance)| variance).sum();
        let mut colours: Vec<(f64, f64, f64)> = places
            .into_iter()
            .filter(|_| self.coloured_m > 0.0)
            .map(|(time_s, variance)| {
                let rms = self.coloured_m * (variance / all).sqrt();
                let keep = (-h / time_s).exp();
                (keep, rms * (1.0 - keep * keep).sqrt(), rms * noise.normal())
            })
            .collect();
        (0..(rows - 1) * points + 1)
            .map(|_| {
                let mut sum = white * noise.normal();
                for (keep, kick, value) in &mut colours {
                    *value = *keep * *value + *kick * noise.normal();
                    sum += *value;
                }
                sum
            })
            .collect()
    }
}

impl Filter {
    /// In place; before the first point the input stood still.
    pub(crate) fn pass(&self, values: &mut [f64], h: f64) {
        let w = (PI * self.corner_hz * h).tan();
        for section in 0..self.order / 2 {
            let angle = PI * (2 * section + 1) as f64 / (2 * self.order) as f64;
            let damping = 2.0 * angle.sin() * w;
            let all = 1.0 + damping + w * w;
            let (forward, a1, a2) = (w * w / all, 2.0 * (w * w - 1.0) / all, (1.0 - damping + w * w) / all);
            let (mut x1, mut x2) = (values[0], values[0]);
            let (mut y1, mut y2) = (x1, x2);
            for value in values.iter_mut() {
                let y = forward * (*value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
                (x2, x1, y2, y1) = (x1, *value, y1, y);
                *value = y;
            }
        }
        if self.order % 2 == 1 {
            let (mut x1, mut y1) = (values[0], values[0]);
            for value in values.iter_mut() {
                let y = (w * (*value + x1) + (1.0 - w) * y1) / (1.0 + w);
                (x1, y1) = (*value, y);
                *value = y;
            }
        }
    }
}
