//! y = u + G (x − u),  ẍ + 2ζω ẋ + ω² x = ω² u: a light resonance between rod and sensor that the rod's motion excites.
//!
//! u tip, x end of the resonance (m), ω = 2πf (1/s), ζ damping ratio against the surroundings, 3 % unless told, G its share in
//! what the sensor sees (no unit). At rest x = u, so the static gain is the nominal one; below the resonance the gap grows
//! with f². Propagated exactly for u straight within a tick T; by the straight lines u loses sinc²(ωT/2) of what it has at the resonance, 2 % at a
//! twelfth of the sampling rate, which G makes up for. Assumption: the resonance does not act back on the rod.
//! Source: mode of a sensor bracket or of the rod above its first.

use core::f64::consts::PI;
use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::signal::Signal;
use crate::parameter::{ParameterSpec, Screening};
use crate::{ModelError, RodMotion, RodState, TwoPole, TwoPolePropagator};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    summary: "a second, lightly damped resonance between rod and sensor",
    signature: "a narrow pole pair in the displacement only; linear in amplitude, growing with f² below its frequency",
    source: "modes of sensor brackets; the rod's own higher modes",
    confused_with: &["delta_e", "load_change", "sensor_gain"],
    parameters: &[
        ParameterSpec::size("gain", "", [-1.0, 1.0], 1e-3),
        ParameterSpec::shape("frequency_hz", "Hz", [10.0, 2e4], 400.0)
            .by_ratio()
            .screened(Screening::Band),
        ParameterSpec::fixed("damping_ratio", "", [1e-3, 0.7], 0.03)
            .by_ratio()
            .believed(0.7),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SecondMode {
    /// By which the gap of straight lines is multiplied.
    gain: f64,
    stiffness_per_s2: f64,
    propagator: TwoPolePropagator,
    motion: RodMotion,
}

impl Signal for SecondMode {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        let (gain, frequency_hz, damping_ratio) = (values[0], values[1], values[2]);
        let angular = 2.0 * PI * frequency_hz;
        // Beyond half the sampling rate nothing is seen of it.
        let half_turn = (0.5 * angular * tick_s).min(0.5 * PI);
        let passed = libm::sin(half_turn) / half_turn;
        let resonance = TwoPole {
            gain: 1.0,
            damping_per_s: 2.0 * damping_ratio * angular,
            stiffness_per_s2: angular * angular,
            force_gain_per_kg: 0.0,
        };
        Ok(SecondMode {
            gain: gain / (passed * passed),
            stiffness_per_s2: resonance.stiffness_per_s2,
            propagator: TwoPolePropagator::new(resonance, tick_s)?,
            motion: RodMotion::default(),
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.motion = RodMotion {
            state: RodState {
                displacement_m: input,
                velocity_m_per_s: 0.0,
            },
            acceleration: self.stiffness_per_s2 * input,
        };
        input
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        let displacement_m = self.motion.advance(&self.propagator, self.stiffness_per_s2 * input);
        input + self.gain * (displacement_m - input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the frequency response: y/u at f is 1 + G r²/(1 − r²) without damping, r = f over the resonance.
    #[test]
    fn the_gap_grows_with_the_square_of_the_frequency() {
        let (gain, resonance_hz) = (0.03, 400.0);
        for frequency_hz in [20.0, 40.0, 100.0] {
            let mut mode = SecondMode::new(&[gain, resonance_hz, 1e-3], 1e-5).unwrap();
            mode.steady_state(0.0);
            let (mut product, mut square) = (0.0, 0.0);
            for k in 1..=600_000 {
                // It is switched on slowly, so that the resonance itself does not ring.
                let on = libm::tanh(3e-5 * f64::from(k));
                let input = on * libm::sin(2.0 * PI * frequency_hz * 1e-5 * f64::from(k));
                let output = mode.step(input);
                if k > 300_000 {
                    product += output * input;
                    square += input * input;
                }
            }
            let ratio = (frequency_hz / resonance_hz) * (frequency_hz / resonance_hz);
            let expected = 1.0 + gain * ratio / (1.0 - ratio);
            assert!((product / square - expected).abs() < 2e-5 * gain, "{frequency_hz} Hz");
        }
    }

    /// Guards the gap at the resonance against the tick: it is as large at a twelfth of the sampling rate as at a thousandth.
    #[test]
    fn the_gap_at_the_resonance_does_not_depend_on_the_tick() {
        let power_of_gap = |tick_s: f64| {
            let mut mode = SecondMode::new(&[0.03, 800.0, 0.03], tick_s).unwrap();
            mode.steady_state(0.0);
            let rows = (0.05 / tick_s) as usize;
            let gaps = (1..=rows).map(|k| {
                let input = libm::sin(2.0 * PI * 800.0 * tick_s * k as f64);
                let gap = mode.step(input) - input;
                if k > rows / 2 { gap * gap } else { 0.0 }
            });
            gaps.sum::<f64>() / rows as f64
        };
        let ratio = power_of_gap(1e-4) / power_of_gap(1e-6);
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    }
}
