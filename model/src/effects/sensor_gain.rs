//! y = (1 + g) u: the sensor's scale is off.
//!
//! u displacement, y what the sensor says (m), g relative error (no unit).
//! Assumption: linear. Source: calibration of displacement sensors. Without a second reference it is the rod's gain w.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    needs_time: false,
    summary: "the sensor's scale is off by a factor",
    signature: "residual proportional to the displacement, everywhere; the same as another gain of rod or magnetostriction",
    source: "calibration of displacement sensors",
    confused_with: &["parameter_w", "load_change"],
    parameters: &[ParameterSpec::size("relative_gain", "", [-0.9, 1.0], 3e-4)],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SensorGain {
    relative_gain: f64,
}

impl Signal for SensorGain {
    fn new(values: &[f64], _tick_s: f64) -> Result<Self, ModelError> {
        Ok(SensorGain {
            relative_gain: values[0],
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.step(input)
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        input + self.relative_gain * input
    }
}
