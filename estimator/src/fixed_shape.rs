//! θ̂(t) = a: no adaptation, for comparison and for rigs whose `a` is known.
//!
//! a the fixed shape parameter (A/m). The bank has one member, so both covers are that member's output, and the output
//! error is the prediction minus the measurement, unfiltered (m).

use crate::{Correction, Law, Prediction};
use serde::{Deserialize, Serialize};

/// The law that never corrects.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FixedShape {
    shape_a_per_m: f64,
}

impl FixedShape {
    /// Fixes a, A/m.
    pub fn new(shape_a_per_m: f64) -> Self {
        Self { shape_a_per_m }
    }
}

impl Law for FixedShape {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        let predicted = prediction.grid.linear(prediction.displacements_m, self.shape_a_per_m);
        let measured = measured_displacement_m.is_finite();
        Correction {
            shape_a_per_m: self.shape_a_per_m,
            output_error_m: if measured {
                predicted - measured_displacement_m
            } else {
                0.0
            },
            predicted_output_m: predicted,
            lower_cover_m: predicted,
            upper_cover_m: predicted,
            held: !measured,
            fixed: true,
            ..Correction::default()
        }
    }

    fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }
}
