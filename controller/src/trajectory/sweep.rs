//! r(t) = mean + A·w(t)·sin θ(t),  θ' = 2π·f(t), from f₀ at 0 to f₁ at T: linear f = f₀ + (f₁ − f₀)·t/T, logarithmic
//! f = f₀·(f₁/f₀)^(t/T). Then it stands still.
//!
//! A amplitude (m), f frequency (Hz), T length (s); w goes from 0 to 1 and back along the blend S of `blend.rs`, over the taper
//! at each end, and is 1 in between.

use super::blend::Blend;
use super::harmonics::unless_sampled;
use super::jet::Jet;
use super::unless_turned;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How the frequency goes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Spacing {
    /// By so many hertz a second.
    Linear,
    /// By so many octaves a second.
    #[default]
    Logarithmic,
}

/// A sine whose frequency goes from one to another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Mean position.
    #[serde(default)]
    pub mean_m: f64,
    /// Amplitude between the tapers.
    pub amplitude_m: f64,
    /// Frequency at the beginning.
    pub from_hz: f64,
    /// Frequency at the end.
    pub to_hz: f64,
    /// How long it takes.
    pub over_s: f64,
    /// How the frequency goes.
    #[serde(default)]
    pub spacing: Spacing,
    /// Over which the amplitude grows and falls at the ends; none: a tenth of the sweep.
    #[serde(default)]
    pub taper_s: Option<f64>,
}

impl Sweep {
    pub(super) fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        if !self.mean_m.is_finite() {
            return Err(Invalid::new("mean_m", format!("{} m must be finite", self.mean_m)));
        }
        Invalid::unless_positive("amplitude_m", self.amplitude_m, "m")?;
        unless_sampled("from_hz", self.from_hz, tick_s)?;
        unless_sampled("to_hz", self.to_hz, tick_s)?;
        if self.from_hz == self.to_hz {
            let sentence = format!("{} Hz is where it begins: that is no sweep; take Harmonics", self.to_hz);
            return Err(Invalid::new("to_hz", sentence));
        }
        Invalid::unless_positive("over_s", self.over_s, "s")?;
        Invalid::unless_between("taper_s", self.taper_s(), 0.0, 0.5 * self.over_s, "s")?;
        unless_turned("taper_s", "a taper", self.taper_s(), "taper_s", tick_s)
    }

    fn taper_s(&self) -> f64 {
        self.taper_s.unwrap_or(0.1 * self.over_s)
    }

    /// θ/2π and its derivatives, turns.
    fn turns_at(&self, time_s: f64) -> Jet {
        match self.spacing {
            Spacing::Linear => {
                let rate = (self.to_hz - self.from_hz) / self.over_s;
                let first = self.from_hz;
                Jet([
                    (first + 0.5 * rate * time_s) * time_s,
                    first + rate * time_s,
                    rate,
                    0.0,
                    0.0,
                ])
            }
            Spacing::Logarithmic => {
                let per_s = libm::log(self.to_hz / self.from_hz) / self.over_s;
                let grown = libm::expm1(per_s * time_s);
                let first = self.from_hz * (1.0 + grown);
                Jet([
                    self.from_hz * grown / per_s,
                    first,
                    first * per_s,
                    first * per_s * per_s,
                    first * per_s * per_s * per_s,
                ])
            }
        }
    }

    /// θ (rad), and f (Hz), while it lasts.
    pub fn angle_and_frequency_hz(&self, time_s: f64) -> Option<(f64, f64)> {
        let Jet([turns, frequency_hz, ..]) = self.turns_at(time_s);
        (0.0..self.over_s)
            .contains(&time_s)
            .then_some((TAU * turns, frequency_hz))
    }

    pub(super) fn at(&self, time_s: f64) -> Jet {
        let rest = Jet::constant(self.mean_m);
        if !(0.0..self.over_s).contains(&time_s) {
            return rest;
        }
        let length_s = self.taper_s();
        let blend = |from_s: f64| Blend { from_s, length_s }.at(time_s);
        let window = blend(0.0).plus(blend(self.over_s - length_s).scaled(-1.0));
        rest.plus(
            self.turns_at(time_s)
                .sine_of_turns()
                .times(window)
                .scaled(self.amplitude_m),
        )
    }
}
