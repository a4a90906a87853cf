//! H(t): fields to drive a material with, as pure functions of time.
//!
//! `Standard`, amplitude A, five parts of equal length T (τ time within a part):
//! 1. growing loops A(τ/T) sin(2π 10 Hz τ);
//! 2. logarithmic sweep 0.6 A sin φ, φ′ = 2πf, f = 1 Hz·200^(τ/T);
//! 3. staircase: eight held levels between −0.42 A and 0.89 A, each approached with a time constant of 4 ms;
//! 4. multisine 0.2 A Σ sin(2π f_i τ + φ_i), f = 7, 23, 61, 97, 151, 283 Hz, faded in and out within 50 ms;
//! 5. shrinking loops A(1 − 0.8 τ/T) sin(2π 30 Hz τ).
//!
//! Together they visit major and minor loops, fast and slow, biased and not: enough to tell all five parameters of the
//! hysteresis apart. `Tracking`: min(1, t/0.2 s)·A(sin 2π50t + 0.3125 sin(2π150t + 0.4)), a cut with its third
//! harmonic. H, A in A/m, times in s, frequencies in Hz. Source: the development runs with one hidden effect, whose
//! commanded fields they reproduce (12 kA/m and 9.6 kA/m; in the sweep up to the phase of that simulation's summation).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require, require_positive};

const GROWING_HZ: f64 = 10.0;
const SHRINKING_HZ: f64 = 30.0;
const SWEEP_SHARE: f64 = 0.6;
const SWEEP_FROM_HZ: f64 = 1.0;
const SWEEP_RATIO: f64 = 200.0;
/// Levels of the staircase as shares of the amplitude.
const LEVELS: [f64; 8] = [
    0.887065, -0.281158, 0.569611, 0.182557, -0.411342, 0.845452, 0.738663, -0.271723,
];
const APPROACH_S: f64 = 4e-3;
const LINE_SHARE: f64 = 0.2;
/// Frequency (Hz) and phase (rad) of the multisine's lines.
const LINES: [(f64, f64); 6] = [
    (7.0, -0.171635),
    (23.0, 1.410013),
    (61.0, -1.224671),
    (97.0, -2.007157),
    (151.0, 2.958260),
    (283.0, 0.193458),
];
const FADE_S: f64 = 0.05;
const TRACKING_HZ: f64 = 50.0;
const TRACKING_THIRD_SHARE: f64 = 0.3125;
const TRACKING_RISE_S: f64 = 0.2;

/// A field as a function of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum DriveSignal {
    /// Five parts that inform about all parameters; see the file's head. Held at its last value after its duration.
    Standard { amplitude_a_per_m: f64, duration_s: f64 },
    /// 50 Hz and 150 Hz, rising within 0.2 s. The largest field is 1.016 times the amplitude.
    Tracking { amplitude_a_per_m: f64 },
    /// offset + amplitude·sin(2π·frequency·t).
    Sine {
        amplitude_a_per_m: f64,
        frequency_hz: f64,
        #[serde(default)]
        offset_a_per_m: f64,
    },
    /// Straight from one field to another within the duration, then held.
    Ramp {
        from_a_per_m: f64,
        to_a_per_m: f64,
        duration_s: f64,
    },
    /// Straight from 0 to the amplitude and then between its two signs: quasi-static loops.
    Triangle { amplitude_a_per_m: f64, period_s: f64 },
}

impl DriveSignal {
    /// The standard excitation with 12 kA/m.
    pub fn standard(duration_s: f64) -> Self {
        DriveSignal::Standard {
            amplitude_a_per_m: 12e3,
            duration_s,
        }
    }

    /// The tracking excitation with 9.6 kA/m, that is about ±40 µm of the paper's rod.
    pub fn tracking() -> Self {
        DriveSignal::Tracking {
            amplitude_a_per_m: 9.6e3,
        }
    }

    /// H(t), A/m; before t = 0 what it is there.
    pub fn field_a_per_m(&self, time_s: f64) -> f64 {
        let time = if time_s > 0.0 { time_s } else { 0.0 };
        match *self {
            DriveSignal::Standard {
                amplitude_a_per_m,
                duration_s,
            } => amplitude_a_per_m * standard(if time < duration_s { time } else { duration_s }, duration_s / 5.0),
            DriveSignal::Tracking { amplitude_a_per_m } => amplitude_a_per_m * tracking(time),
            DriveSignal::Sine {
                amplitude_a_per_m,
                frequency_hz,
                offset_a_per_m,
            } => offset_a_per_m + amplitude_a_per_m * sine(frequency_hz, time),
            DriveSignal::Ramp {
                from_a_per_m,
                to_a_per_m,
                duration_s,
            } => {
                if time < duration_s {
                    from_a_per_m + (to_a_per_m - from_a_per_m) * (time / duration_s)
                } else {
                    to_a_per_m
                }
            }
            DriveSignal::Triangle {
                amplitude_a_per_m,
                period_s,
            } => amplitude_a_per_m * triangle(time / period_s),
        }
    }

    /// Refuses numbers that are not finite, and durations and frequencies that are not positive.
    pub fn validate(&self) -> Result<(), ModelError> {
        let amplitude = |value| require(true, "drive amplitude", value, "A/m", "finite");
        match *self {
            DriveSignal::Standard {
                amplitude_a_per_m,
                duration_s,
            } => {
                amplitude(amplitude_a_per_m)?;
                require_positive(duration_s, "drive duration", "s")
            }
            DriveSignal::Tracking { amplitude_a_per_m } => amplitude(amplitude_a_per_m),
            DriveSignal::Sine {
                amplitude_a_per_m,
                frequency_hz,
                offset_a_per_m,
            } => {
                amplitude(amplitude_a_per_m)?;
                amplitude(offset_a_per_m)?;
                require_positive(frequency_hz, "drive frequency", "Hz")
            }
            DriveSignal::Ramp {
                from_a_per_m,
                to_a_per_m,
                duration_s,
            } => {
                amplitude(from_a_per_m)?;
                amplitude(to_a_per_m)?;
                require_positive(duration_s, "drive duration", "s")
            }
            DriveSignal::Triangle {
                amplitude_a_per_m,
                period_s,
            } => {
                amplitude(amplitude_a_per_m)?;
                require_positive(period_s, "drive period", "s")
            }
        }
    }
}

fn sine(frequency_hz: f64, time: f64) -> f64 {
    libm::sin(2.0 * PI * frequency_hz * time)
}

/// The standard excitation with amplitude 1 and parts of length `part`.
fn standard(time: f64, part: f64) -> f64 {
    let index = libm::floor(time / part);
    let index = if index < 4.0 { index } else { 4.0 };
    let inside = time - index * part;
    let share = inside / part;
    match index as u32 {
        0 => share * sine(GROWING_HZ, inside),
        1 => sweep(share, part),
        2 => staircase(inside, part / LEVELS.len() as f64),
        3 => multisine(inside, part),
        _ => (1.0 - 0.8 * share) * sine(SHRINKING_HZ, inside),
    }
}

fn sweep(share: f64, part: f64) -> f64 {
    let rate = libm::log(SWEEP_RATIO);
    SWEEP_SHARE * sine(SWEEP_FROM_HZ, part * libm::expm1(rate * share) / rate)
}

/// Each level is approached from where the one before ended, so that short holds stay continuous.
fn staircase(time: f64, hold: f64) -> f64 {
    let mut field = 0.0;
    let mut left = time;
    for level in LEVELS {
        let held = if left < hold { left } else { hold };
        field = level + (field - level) * libm::exp(-held / APPROACH_S);
        left -= hold;
        if left < 0.0 {
            break;
        }
    }
    field
}

fn multisine(time: f64, part: f64) -> f64 {
    let sum: f64 = LINES
        .iter()
        .map(|(frequency, phase)| libm::sin(2.0 * PI * frequency * time + phase))
        .sum();
    let to_edge = if time < part - time { time } else { part - time };
    let fade = to_edge / FADE_S;
    LINE_SHARE * sum * if fade < 1.0 { fade } else { 1.0 }
}

fn tracking(time: f64) -> f64 {
    let rise = time / TRACKING_RISE_S;
    let third = libm::sin(2.0 * PI * 3.0 * TRACKING_HZ * time + 0.4);
    (if rise < 1.0 { rise } else { 1.0 }) * (sine(TRACKING_HZ, time) + TRACKING_THIRD_SHARE * third)
}

/// 0 → 1 → −1 → 0 over one period.
fn triangle(periods: f64) -> f64 {
    let shifted = periods + 0.25;
    let share = shifted - libm::floor(shifted);
    1.0 - 4.0 * (share - 0.5).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards agreement with the development runs: fields read off their commanded column (4 s, 10 kHz), two or more of
    // each part.
    #[test]
    fn the_fields_of_the_development_runs() {
        let standard = DriveSignal::standard(4.0);
        // The first rows of the staircase already have the step of their first tick behind them.
        let staircase = |time: f64| (time + 1e-4, 0.01);
        for ((time, tolerance), expected) in [
            ((0.0323, 0.01), 434.42),
            ((0.5754, 0.01), -8628.27),
            ((0.7908, 0.01), -6481.33),
            // The sweep's phase was summed row by row; at its first peaks that does not matter yet.
            ((0.9474, 0.3), 7200.0),
            ((1.1363, 5.0), 7200.0),
            (staircase(1.61), 9792.58),
            (staircase(1.65), 10644.74),
            (staircase(1.6998), 10644.78),
            ((2.02, 0.01), -4888.09),
            ((2.4024, 0.01), -200.02),
            ((2.4049, 0.01), 893.98),
            ((3.225, 0.01), -11700.0),
            ((3.9915, 0.01), -2500.77),
        ] {
            let found = standard.field_a_per_m(time);
            assert!(
                (found - expected).abs() <= tolerance,
                "{time} s: {found} A/m, not {expected} A/m"
            );
        }
        let tracking = DriveSignal::tracking();
        for (time, expected) in [(0.0059, 243.90), (0.2, 1168.26), (0.206, 8451.12), (0.211, -5888.71)] {
            let found = tracking.field_a_per_m(time);
            assert!(
                (found - expected).abs() <= 0.011,
                "{time} s: {found} A/m, not {expected} A/m"
            );
        }
    }

    // Guards other durations: the parts keep their shares, nothing jumps within a part, and after the end the field is
    // held.
    #[test]
    fn parts_scale_with_the_duration() {
        for duration in [0.3, 5.0, 40.0] {
            let signal = DriveSignal::standard(duration);
            let part = duration / 5.0;
            let step = 1e-6;
            for index in 0..5 {
                for sample in 1..2000 {
                    let time = part * (f64::from(index) + f64::from(sample) / 2000.5);
                    let moved = signal.field_a_per_m(time + step) - signal.field_a_per_m(time);
                    // The fastest is the multisine: at most 0.2 A·2π·622 Hz.
                    assert!(
                        moved.abs() < 12e3 * 800.0 * step,
                        "{time} s of {duration} s: {moved} A/m"
                    );
                }
            }
            assert_eq!(signal.field_a_per_m(duration + 1.0), signal.field_a_per_m(duration));
            assert_eq!(signal.field_a_per_m(0.0), 0.0);
        }
    }

    #[test]
    fn simple_signals() {
        let triangle = DriveSignal::Triangle {
            amplitude_a_per_m: 8.0,
            period_s: 2.0,
        };
        let found = [0.0, 0.25, 0.5, 1.0, 1.5, 1.75, 2.0].map(|time| triangle.field_a_per_m(time));
        assert_eq!(found, [0.0, 4.0, 8.0, 0.0, -8.0, -4.0, 0.0]);
        let ramp = DriveSignal::Ramp {
            from_a_per_m: 1.0,
            to_a_per_m: 3.0,
            duration_s: 4.0,
        };
        assert_eq!([-1.0, 2.0, 9.0].map(|time| ramp.field_a_per_m(time)), [1.0, 2.0, 3.0]);
        let sine = DriveSignal::Sine {
            amplitude_a_per_m: 2.0,
            frequency_hz: 0.25,
            offset_a_per_m: 1.0,
        };
        assert_eq!(sine.field_a_per_m(1.0), 3.0);
        assert!(sine.validate().is_ok() && DriveSignal::standard(0.0).validate().is_err());
    }

    // Guards the form in files: a variant with its fields by name, unknown ones refused.
    #[test]
    fn signals_are_stored_and_read_back() {
        let text = serde_json::to_string(&DriveSignal::standard(5.0)).expect("stored");
        assert_eq!(
            serde_json::from_str::<DriveSignal>(&text).expect("read"),
            DriveSignal::standard(5.0)
        );
        assert!(serde_json::from_str::<DriveSignal>(&text.replace("duration_s", "duration")).is_err());
    }
}
