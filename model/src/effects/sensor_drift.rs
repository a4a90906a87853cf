//! y = u + b + r t: the sensor's zero is off and wanders.
//!
//! u displacement, y what the sensor says (m), b offset (m), r drift (m/s), t time from the first sample (s).
//! Assumption: linear in time. Source: capacitive and eddy-current probes; interferometers drift hundreds of nm in minutes.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    summary: "the sensor's zero is off and moves at a constant rate",
    signature: "there at zero input, unrelated to the field and to its square",
    source: "displacement probes; hundreds of nm in minutes",
    confused_with: &["thermal_expansion", "after_effect", "bias_shift"],
    parameters: &[
        ParameterSpec::size("drift_m_per_s", "m/s", [-1e-4, 1e-4], 2e-9),
        ParameterSpec::size("offset_m", "m", [-1e-2, 1e-2], 5e-9),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SensorDrift {
    drift_m_per_tick: f64,
    offset_m: f64,
    tick: u64,
}

impl Signal for SensorDrift {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(SensorDrift {
            drift_m_per_tick: values[0] * tick_s,
            offset_m: values[1],
            tick: 0,
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.tick = 0;
        input + self.offset_m
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        self.tick += 1;
        input + (self.offset_m + self.drift_m_per_tick * self.tick as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards rate and zero of time: the first sample has the offset alone.
    #[test]
    fn it_is_a_straight_line_in_time() {
        let mut drift = SensorDrift::new(&[2e-6, 1e-7], 1e-3).unwrap();
        assert_eq!(drift.steady_state(0.0), 1e-7);
        let last = (0..500).map(|_| drift.step(0.0)).last().unwrap();
        assert!((last - (1e-7 + 1e-6)).abs() < 1e-20);
    }
}
