//! H_in = H + H_b: the permanent magnets' field is not what it was taken for.
//!
//! H coil field, H_in field in the material, H_b shift (A/m). From the demagnetised state the material first goes to
//! H_b on its initial curve. Assumption: constant shift. Source: bias magnets and their temperature.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Field,
    needs_time: false,
    summary: "a constant field is added to the coil's",
    signature: "even harmonics, another gain, and an offset at zero input; loops shift sideways",
    source: "bias magnets and their temperature",
    confused_with: &["sensor_drift", "quadratic_magnetostriction"],
    parameters: &[ParameterSpec::size("bias_field_a_per_m", "A/m", [-5e4, 5e4], 10.0)],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct BiasShift {
    bias_field_a_per_m: f64,
}

impl FieldEffect for BiasShift {
    fn new(values: &[f64], _tick_s: f64) -> Result<Self, ModelError> {
        Ok(BiasShift {
            bias_field_a_per_m: values[0],
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        input + self.bias_field_a_per_m
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        output.push(Piece {
            span: piece.span,
            to: piece.to + self.bias_field_a_per_m,
            mean: piece.mean + self.bias_field_a_per_m,
        });
    }
}
