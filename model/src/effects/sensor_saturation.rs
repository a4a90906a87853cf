//! y = limit(u, ±L): the sensor's range ends, with an edge unless told otherwise (`limit.rs`).
//!
//! u displacement, y what the sensor says, L limit (m). Assumption: symmetric about zero.
//! Source: ranges of capacitive probes, 10-500 μm.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::limit::{Limit, SHARPNESS};
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::{ParameterSpec, Signal as Measured};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    needs_time: false,
    differentiable: false,
    summary: "what the sensor says is clipped at a limit",
    signature: "flat tops in the displacement at one level, with a clean field",
    source: "ranges of capacitive probes, 10-500 μm",
    confused_with: &["amplifier_saturation", "parameter_Ms"],
    parameters: &[
        ParameterSpec::limit("limit_m", "m", [1e-8, 1.0], 1e-4, Measured::Output),
        SHARPNESS,
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SensorSaturation {
    limit: Limit,
}

impl Signal for SensorSaturation {
    fn new(values: &[f64], _tick_s: f64) -> Result<Self, ModelError> {
        Ok(SensorSaturation {
            limit: Limit::new(values[0], values[1]),
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.step(input)
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        self.limit.of(input)
    }
}
