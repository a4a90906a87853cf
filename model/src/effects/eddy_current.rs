//! τ dH_in/dt = H − H_in: eddy currents delay the field inside the material behind that in the coil.
//!
//! H coil field, H_in field in the material (A/m), τ diffusion time of the first mode (s), about μ₀μ_r D²/(23 ρ):
//! 73 μs for a solid Terfenol-D rod of 12.7 mm. Propagated exactly, see `field_lag.rs`.
//! Assumptions: first mode only, constant permeability. Source: magnetic diffusion in a cylinder.

use serde::{Deserialize, Serialize};

use super::description::{CoilNeed, Description, Stage};
use super::field_lag::FieldLag;
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Field,
    coil: CoilNeed::Always,
    summary: "eddy currents make the field in the material lag behind the coil's",
    signature: "measured field clean, magnetization and displacement lag; loops widen with frequency, gap proportional to rate",
    source: "magnetic diffusion in a cylinder, first mode",
    confused_with: &["amplifier_bandwidth", "loop_delay", "sensor_delay", "excess_loss"],
    parameters: &[ParameterSpec::size("time_constant_s", "s", [0.0, 0.02], 1e-6).by_ratio()],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EddyCurrent(FieldLag);

impl FieldEffect for EddyCurrent {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(EddyCurrent(FieldLag::new(values[0], tick_s)))
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.0.steady_state(input)
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        self.0.follow(piece, output);
    }
}
