//! r(t) = mean + Σ A·sin(2πf·t + φ);  rⁿ(t) = Σ A(2πf)ⁿ·sin(2πf·t + φ + nπ/2).
//!
//! A in m, f in Hz, φ in rad. Every derivative is continuous.

use super::jet::Jet;
use anhyst_ipc::Invalid;
use anhyst_model::turn::sine_and_cosine;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Lobes of the slowest term that are tried, and how whole the others' must be.
const MOST_LOBES: u32 = 20;
const WHOLE: f64 = 1e-6;

/// A sine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Term {
    amplitude_m: f64,
    frequency_hz: f64,
    phase_turns: f64,
}

impl Term {
    fn turns(&self, time_s: f64) -> f64 {
        self.frequency_hz * time_s + self.phase_turns
    }
}

/// A mean and a sum of sines.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Harmonics {
    mean_m: f64,
    terms: Vec<Term>,
}

impl Harmonics {
    /// Terms of amplitude in m, frequency in Hz, phase in rad.
    pub fn new(mean_m: f64, terms: &[(f64, f64, f64)]) -> Self {
        let terms = terms.iter().map(|&(amplitude_m, frequency_hz, phase)| Term {
            amplitude_m,
            frequency_hz,
            phase_turns: phase / TAU,
        });
        Self {
            mean_m,
            terms: terms.collect(),
        }
    }

    /// Of the longest turn that all terms repeat with, at most `MOST_LOBES` times the slowest; none if there is none.
    pub fn turns_per_s(&self) -> Option<f64> {
        self.turns_per_s_within(MOST_LOBES)
    }

    /// The same with so many lobes at most.
    pub fn turns_per_s_within(&self, most_lobes: u32) -> Option<f64> {
        let frequencies = self.terms.iter().map(|term| term.frequency_hz);
        let slowest = frequencies.clone().reduce(f64::min)?;
        (1..=most_lobes).map(|lobe| slowest / f64::from(lobe)).find(|base| {
            let mut lobes = frequencies.clone().map(|frequency| frequency / base);
            lobes.all(|lobes| (lobes - libm::round(lobes)).abs() < WHOLE)
        })
    }

    /// The same bits as the position of [`Harmonics::at`].
    pub fn position_m(&self, time_s: f64) -> f64 {
        self.terms.iter().fold(self.mean_m, |sum, term| {
            sum + sine_and_cosine(term.turns(time_s)).0 * term.amplitude_m
        })
    }

    pub fn at(&self, time_s: f64) -> Jet {
        self.terms.iter().fold(Jet::constant(self.mean_m), |sum, term| {
            let (sine, cosine) = sine_and_cosine(term.turns(time_s));
            let omega = TAU * term.frequency_hz;
            let omega2 = omega * omega;
            let unit = [
                sine,
                omega * cosine,
                -omega2 * sine,
                -omega2 * omega * cosine,
                omega2 * omega2 * sine,
            ];
            sum.plus(Jet(unit).scaled(term.amplitude_m))
        })
    }
}

/// Refuses what is not finite and what cannot be sampled.
pub(crate) fn validate(mean_m: f64, terms: &[(f64, f64, f64)], tick_s: f64) -> Result<(), Invalid> {
    if !mean_m.is_finite() {
        return Err(Invalid::new("mean_m", format!("{mean_m} m must be finite")));
    }
    for (index, &(amplitude_m, frequency_hz, phase)) in terms.iter().enumerate() {
        let path = format!("terms.{index}");
        if !amplitude_m.is_finite() || !phase.is_finite() {
            return Err(Invalid::new(
                path,
                format!("amplitude {amplitude_m} m and phase {phase} rad must be finite"),
            ));
        }
        unless_sampled(&path, frequency_hz, tick_s)?;
    }
    Ok(())
}

/// Refuses a frequency that fewer than four ticks a period cannot carry: the hold's correction is a series in (ωT)².
pub(crate) fn unless_sampled(path: &str, frequency_hz: f64, tick_s: f64) -> Result<(), Invalid> {
    let highest = 0.25 / tick_s;
    if frequency_hz.is_finite() && frequency_hz > 0.0 && frequency_hz <= highest {
        return Ok(());
    }
    let sentence = format!(
        "frequency {frequency_hz} Hz must be above 0 Hz and at most {highest} Hz: a tick of {tick_s} s must fit four times into a period"
    );
    Err(Invalid::new(path, sentence))
}
