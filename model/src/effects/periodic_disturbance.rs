//! y = u + s sin 2πft + c cos 2πft: something else shakes the tip at one frequency.
//!
//! u and y displacement (m), s and c amplitudes of sine and cosine (m), so that both enter linearly; f frequency (Hz), t time
//! from the first sample (s). A force through the linear rod looks the same at one frequency.
//! Assumption: constant amplitude. Source: spindles, pumps, mains hum.

use core::f64::consts::PI;
use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::{ParameterSpec, Screening};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    summary: "a vibration at one frequency is added to the displacement",
    signature: "one line in the residual's spectrum, there at zero input too, and independent of the drive",
    source: "spindles, pumps, mains hum",
    confused_with: &[],
    parameters: &[
        ParameterSpec::size("sine_m", "m", [-1e-3, 1e-3], 5e-9),
        ParameterSpec::size("cosine_m", "m", [-1e-3, 1e-3], 5e-9),
        ParameterSpec::shape("frequency_hz", "Hz", [0.01, 5e4], 50.0)
            .by_ratio()
            .screened(Screening::Lines),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PeriodicDisturbance {
    sine_m: f64,
    cosine_m: f64,
    turns_per_tick: f64,
    tick: u64,
}

impl Signal for PeriodicDisturbance {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(PeriodicDisturbance {
            sine_m: values[0],
            cosine_m: values[1],
            turns_per_tick: values[2] * tick_s,
            tick: 0,
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.tick = 0;
        input + self.cosine_m
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        self.tick += 1;
        let turns = self.turns_per_tick * self.tick as f64;
        let (sine, cosine) = libm::sincos(2.0 * PI * (turns - libm::floor(turns)));
        input + self.sine_m * sine + self.cosine_m * cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards amplitude, phase and frequency, also far into a run.
    #[test]
    fn it_is_the_sum_of_sine_and_cosine() {
        let mut disturbance = PeriodicDisturbance::new(&[3e-8, -2e-8, 117.0], 1e-4).unwrap();
        assert_eq!(disturbance.steady_state(1e-6), 1e-6 - 2e-8);
        for k in 1..100_000 {
            let angle = 2.0 * PI * 117.0 * 1e-4 * f64::from(k);
            let expected = 3e-8 * libm::sin(angle) - 2e-8 * libm::cos(angle);
            assert!((disturbance.step(0.0) - expected).abs() < 1e-17, "tick {k}");
        }
    }
}
