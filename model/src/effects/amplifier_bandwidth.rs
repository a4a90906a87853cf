//! τ dH/dt = u − H: the current loop follows with a first-order lag.
//!
//! u command, H coil field (A/m), τ = 1/(2π bandwidth) (s). Propagated exactly, see `field_lag.rs`.
//! It stands in series with a nominal bandwidth. Assumption: small signal, one pole.
//! Source: current amplifiers of giant magnetostrictive actuators, 1-5 kHz.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::field_lag::FieldLag;
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Amplifier,
    summary: "the coil field follows the command with a first-order lag",
    signature: "seen in the measured field: −20 dB a decade and phase −atan ωτ; gap proportional to rate, not to temperature",
    source: "current amplifiers of magnetostrictive actuators, 1-5 kHz",
    confused_with: &["eddy_current", "loop_delay", "sensor_delay"],
    parameters: &[ParameterSpec::size("time_constant_s", "s", [0.0, 0.02], 1e-6).by_ratio()],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AmplifierBandwidth(pub FieldLag);

impl FieldEffect for AmplifierBandwidth {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(AmplifierBandwidth(FieldLag::new(values[0], tick_s)))
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.0.steady_state(input)
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        self.0.follow(piece, output);
    }
}
