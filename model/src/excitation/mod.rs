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

mod shapes;
mod standard;

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require, require_positive};
use shapes::{rise, sine, staircase, sweep, triangle};
use standard::{standard, tracking};

/// A field as a function of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum DriveSignal {
    /// Five parts that inform about all parameters; see the file's head. Held at its last value after its duration.
    Standard { amplitude_a_per_m: f64, duration_s: f64 },
    /// 50 Hz and 150 Hz, rising within 0.2 s. The largest field is 1.016 times the amplitude.
    Tracking { amplitude_a_per_m: f64 },
    /// offset + amplitude·sin(2π·frequency·t), both growing from zero within the rise.
    Sine {
        amplitude_a_per_m: f64,
        frequency_hz: f64,
        #[serde(default)]
        offset_a_per_m: f64,
        #[serde(default)]
        rise_s: f64,
    },
    /// Sine whose amplitude grows from zero to the full one within the duration, and then stays.
    Growing {
        amplitude_a_per_m: f64,
        frequency_hz: f64,
        duration_s: f64,
    },
    /// Sine whose frequency grows by a constant ratio. Held at its last value after its duration.
    Sweep {
        amplitude_a_per_m: f64,
        from_hz: f64,
        to_hz: f64,
        duration_s: f64,
    },
    /// Equal steps up, down through zero and back, each held.
    Staircase {
        amplitude_a_per_m: f64,
        steps: u32,
        hold_s: f64,
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
                rise_s,
            } => (offset_a_per_m + amplitude_a_per_m * sine(frequency_hz, time)) * rise(time, rise_s),
            DriveSignal::Growing {
                amplitude_a_per_m,
                frequency_hz,
                duration_s,
            } => amplitude_a_per_m * sine(frequency_hz, time) * rise(time, duration_s),
            DriveSignal::Sweep {
                amplitude_a_per_m,
                from_hz,
                to_hz,
                duration_s,
            } => {
                amplitude_a_per_m
                    * sweep(
                        if time < duration_s { time } else { duration_s },
                        from_hz,
                        to_hz,
                        duration_s,
                    )
            }
            DriveSignal::Staircase {
                amplitude_a_per_m,
                steps,
                hold_s,
            } => amplitude_a_per_m * staircase(time, steps, hold_s),
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
                rise_s,
            } => {
                amplitude(amplitude_a_per_m)?;
                amplitude(offset_a_per_m)?;
                require(rise_s >= 0.0, "drive rise", rise_s, "s", "not negative")?;
                require_positive(frequency_hz, "drive frequency", "Hz")
            }
            DriveSignal::Growing {
                amplitude_a_per_m,
                frequency_hz,
                duration_s,
            } => {
                amplitude(amplitude_a_per_m)?;
                require_positive(frequency_hz, "drive frequency", "Hz")?;
                require_positive(duration_s, "drive duration", "s")
            }
            DriveSignal::Sweep {
                amplitude_a_per_m,
                from_hz,
                to_hz,
                duration_s,
            } => {
                amplitude(amplitude_a_per_m)?;
                require_positive(from_hz, "sweep's first frequency", "Hz")?;
                require_positive(to_hz, "sweep's last frequency", "Hz")?;
                require_positive(duration_s, "drive duration", "s")
            }
            DriveSignal::Staircase {
                amplitude_a_per_m,
                steps,
                hold_s,
            } => {
                amplitude(amplitude_a_per_m)?;
                require(steps > 0, "staircase's steps", f64::from(steps), "", "at least 1")?;
                require_positive(hold_s, "staircase's hold", "s")
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

#[cfg(test)]
mod tests;
