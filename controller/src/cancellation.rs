//! u_k = Re Σ Cᵢ·e^{jωᵢt_{k+2}},  Cᵢ ← Cᵢ + 2κT·e_k·e^{−jωᵢt_k}/Tᵢ: adaptive feedforward cancellation of known frequencies.
//!
//! Transfer function: u/e = Σ κT·[cᵢ/(1 − e^{jωᵢT}z⁻¹) + c̄ᵢ/(1 − e^{−jωᵢT}z⁻¹)], cᵢ = e^{2jωᵢT}/Tᵢ: infinite gain at ωᵢ. Tᵢ is the way from u
//! to y at ωᵢ *with the PID closed*, P/(1 + KPe^{−2jωT}): P the rod with its hold, K the PID, two ticks of delay in the loop (the
//! demand is made for t_{k+2}, so the delay is not in Tᵢ itself). Dividing by Tᵢ compensates the phase: the error's component at ωᵢ
//! dies as e^{−κt}, whatever the rod does there. Averaging over a period needs κ well below every ω and their distances.
//! C in m (complex), κ in 1/s, e in m. Ports: in e at t_k (m), out u (m of quasi-static displacement) for t_{k+2}.
//! Source: Bodson, Sacks, Khosla, "Harmonic generation in adaptive feedforward cancellation schemes", IEEE TAC 39 (1994).

use crate::loop_shape::{Complex, LoopShape};
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Frequencies that are known to disturb: tooth passing and its harmonics, lobes of the workpiece.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CancellationSettings {
    /// Frequencies in Hz, each once.
    pub frequencies_hz: Vec<f64>,
    /// κ: the error at each frequency dies as exp(−κt).
    pub rate_per_s: f64,
}

/// κ may be at most this part of the lowest frequency, and of the smallest distance between two, both in rad/s: tested.
const MAX_RATE: f64 = 0.1;

impl CancellationSettings {
    /// Refuses frequencies that cannot be sampled, told apart or adapted at this rate.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("rate_per_s", self.rate_per_s, "1/s")?;
        for (index, &frequency_hz) in self.frequencies_hz.iter().enumerate() {
            let highest = 0.25 / tick_s;
            let path = format!("frequencies_hz.{index}");
            Invalid::unless_positive(&path, frequency_hz, "Hz")?;
            Invalid::unless_between(&path, frequency_hz, 0.0, highest, "Hz")?;
            let nearest_hz = self.frequencies_hz[..index]
                .iter()
                .fold(frequency_hz, |nearest: f64, other| {
                    nearest.min((frequency_hz - other).abs())
                });
            let most_per_s = MAX_RATE * TAU * nearest_hz;
            if self.rate_per_s > most_per_s {
                let sentence = format!(
                    "{} 1/s is too fast for {frequency_hz} Hz, {nearest_hz} Hz away from 0 or from another frequency of the list: at most {most_per_s} 1/s",
                    self.rate_per_s
                );
                return Err(Invalid::new("rate_per_s", sentence));
            }
        }
        Ok(())
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Harmonic {
    omega: f64,
    /// 2κT/Tᵢ.
    gain: Complex,
    /// Cᵢ.
    amplitude_m: Complex,
    /// Cᵢ of the tick before.
    before_m: Complex,
}

/// The bank of harmonics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cancellation {
    tick_s: f64,
    harmonics: Vec<Harmonic>,
}

impl Cancellation {
    /// For a loop whose shape is known; settings are taken as validated.
    pub fn new(settings: &CancellationSettings, shape: &LoopShape, tick_s: f64) -> Self {
        let harmonic = |&frequency_hz: &f64| {
            let way = shape.demand_to_displacement(frequency_hz);
            Harmonic {
                omega: TAU * frequency_hz,
                gain: Complex::real(2.0 * settings.rate_per_s * tick_s).over(way),
                amplitude_m: Complex::real(0.0),
                before_m: Complex::real(0.0),
            }
        };
        Self {
            tick_s,
            harmonics: settings.frequencies_hz.iter().map(harmonic).collect(),
        }
    }

    /// Forgets the last tick's error: the demand that came with it was not let through, and the error may be why.
    pub fn take_back(&mut self) {
        for harmonic in &mut self.harmonics {
            harmonic.amplitude_m = harmonic.before_m;
        }
    }

    /// Advances by one tick; `adapt` is false where the error says nothing (missing, or the demand was not applied).
    pub fn step(&mut self, tick: u64, error_m: f64, adapt: bool) -> f64 {
        let now_s = tick as f64 * self.tick_s;
        let mut sum_m = 0.0;
        for harmonic in &mut self.harmonics {
            harmonic.before_m = harmonic.amplitude_m;
            if adapt {
                let error = Complex::unit(-harmonic.omega * now_s).scaled(error_m);
                harmonic.amplitude_m = harmonic.amplitude_m.plus(error.times(harmonic.gain));
            }
            let ahead = Complex::unit(harmonic.omega * (now_s + 2.0 * self.tick_s));
            sum_m += harmonic.amplitude_m.times(ahead).re;
        }
        sum_m
    }

    /// Amplitudes of the correction, in m, in the order of the settings.
    pub fn amplitudes_m(&self) -> impl Iterator<Item = f64> + '_ {
        self.harmonics.iter().map(|harmonic| harmonic.amplitude_m.magnitude())
    }
}
