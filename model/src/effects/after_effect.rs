//! M_c = M + (f/3) Σ z_i,  τ_i dz_i/dt = M − z_i: magnetization goes on creeping after the field has stopped.
//!
//! M magnetization without, M_c with creep (A/m), z_i three first-order creeps, f their share in all (no unit), τ_i (s)
//! from the shortest to the longest in equal ratios: 0.03, 0.3 and 3 s unless told. Over that range the sum is close to
//! log t, f/3/ln(10)·2.3 per decade. Propagated exactly, see `lag.rs`.
//! Assumptions: linear creep that does not act back on the hysteresis, settled at the first sample.
//! Source: Richter's after-effect with a few time constants; 0.3-2 % a decade for giant magnetostriction, 0.9 % on piezo stages.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::lag::Lag;
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Magnetization,
    summary: "magnetization creeps on after the field has stopped",
    signature: "tails like log t after steps, signed like the last step; loops wider at low frequency",
    source: "magnetic after-effect (Richter); creep of piezo stages",
    confused_with: &["sensor_drift", "thermal_expansion", "accommodation"],
    parameters: &[
        ParameterSpec::size("fraction", "", [0.0, 0.5], 5e-4).by_ratio(),
        ParameterSpec::fixed("shortest_s", "s", [1e-4, 100.0], 0.03)
            .by_ratio()
            .believed(0.5),
        ParameterSpec::fixed("longest_s", "s", [1e-3, 1e5], 3.0)
            .by_ratio()
            .believed(0.5),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AfterEffect {
    share: f64,
    creeps: [Lag; 3],
}

impl AfterEffect {
    /// M (A/m) whose sample, taken next, gives M_c = `wanted`: M_c is affine in it.
    pub fn inverse(&self, wanted: f64) -> f64 {
        let mut silent = 0.0;
        let mut gain = 1.0;
        for creep in &self.creeps {
            let (rest, weight) = creep.response();
            silent += self.share * rest;
            gain += self.share * weight;
        }
        (wanted - silent) / gain
    }
}

impl Signal for AfterEffect {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        let (shortest_s, longest_s) = (values[1], values[2]);
        let middle_s = libm::sqrt(shortest_s * longest_s);
        Ok(AfterEffect {
            share: values[0] / 3.0,
            creeps: [shortest_s, middle_s, longest_s].map(|time_s| Lag::new(time_s, tick_s)),
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        let [first, second, third] = &mut self.creeps;
        input + self.share * (first.steady_state(input) + second.steady_state(input) + third.steady_state(input))
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        let [first, second, third] = &mut self.creeps;
        input + self.share * (first.step(input) + second.step(input) + third.step(input))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the creep after a step (a ramp of one tick, exactly) and its end at 1 + f.
    #[test]
    fn a_step_creeps_in_three_exponentials() {
        let (tick_s, fraction) = (1e-3, 0.06);
        let mut creep = AfterEffect::new(&[fraction, 0.03, 3.0], tick_s).unwrap();
        creep.steady_state(0.0);
        let mut output = 0.0;
        for k in 1..=40_000 {
            output = creep.step(1.0);
            let rise = |time_constant_s: f64| {
                // Response to a ramp over the first tick, at t_k.
                let weight = time_constant_s / tick_s * libm::expm1(tick_s / time_constant_s);
                1.0 - weight * libm::exp(-tick_s * f64::from(k) / time_constant_s)
            };
            let expected = 1.0 + fraction / 3.0 * (rise(0.03) + rise(0.3) + rise(3.0));
            assert!((output - expected).abs() < 1e-12, "tick {k}");
        }
        assert!((output - 1.06).abs() < 1e-6);
    }

    /// Guards the compensation: what the inverse says, taken as the next sample, gives what was wanted.
    #[test]
    fn the_inverse_is_exact() {
        let mut creep = AfterEffect::new(&[0.3, 0.001, 0.1], 1e-4).unwrap();
        creep.steady_state(0.0);
        for k in 1..500 {
            let wanted = 1e5 * libm::sin(0.05 * f64::from(k));
            let bare = creep.inverse(wanted);
            assert!((creep.step(bare) - wanted).abs() < 1e-9, "sample {k}");
        }
    }
}
