//! y = round(u/q)·q: the sensor's steps are coarser than thought.
//!
//! u displacement, y what the sensor says, q step (m); 0 is no quantisation. The output jumps, and so does every
//! derivative: compare histograms, not sensitivities. Source: converters; see [`crate::Sensor`].

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::{ParameterSpec, Screening};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    needs_time: false,
    differentiable: false,
    summary: "what the sensor says is rounded to steps",
    signature: "a lattice of values; white residual within ±q/2",
    source: "analogue-to-digital converters",
    confused_with: &[],
    parameters: &[ParameterSpec::size("step_m", "m", [0.0, 1e-4], 1e-8)
        .by_ratio()
        .screened(Screening::Lattice)],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Quantisation {
    step_m: f64,
}

impl Signal for Quantisation {
    fn new(values: &[f64], _tick_s: f64) -> Result<Self, ModelError> {
        Ok(Quantisation { step_m: values[0] })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.step(input)
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        if self.step_m > 0.0 {
            libm::rint(input / self.step_m) * self.step_m
        } else {
            input
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the lattice: every value a multiple of the step, at most half a step away.
    #[test]
    fn values_lie_on_the_lattice() {
        let mut quantisation = Quantisation { step_m: 5e-8 };
        for k in 0..200 {
            let input = 3.1e-9 * f64::from(k);
            let output = quantisation.step(input);
            assert!((output - input).abs() <= 2.5e-8 * (1.0 + 1e-9));
            assert!((output / 5e-8 - libm::rint(output / 5e-8)).abs() < 1e-9);
        }
    }
}
