//! ŷ′ = κ(Y(θ̂) − ŷ),  ẏ_f = κ(y − y_f),  θ̂′ = −γ ỹ_ε Y′(θ̂),  ỹ = ŷ − y_f,  ỹ_ε = ỹ − ε sat(ỹ/ε)
//!
//! The symbols of `folded.rs`; Y′ = dY/dθ at the estimate (m per A/m). This is the folded law with a* = 0 and the slope of Y itself
//! in place of the slope of a cover, for comparison: what the covers add is all the difference. In discrete time the same
//! backward Euler step with the same damping.
//! It descends the square of the output error and nothing more: where Y is not monotone in θ on Θ it stops where Y′ turns the wrong
//! way. For the material's Θ of ±7 % Y is nearly linear in θ and it does as well as any; `gradient_tests.rs` has a case where it fails.
//! Source: the paper's section 3, "regions of nonconvexity of f where the gradient method is insufficient".

use crate::folded::output_error;
use crate::law::is_credible;
use crate::{Correction, GradientSettings, Law, Prediction};
use serde::{Deserialize, Serialize};

/// The plain gradient law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gradient {
    /// κ dt.
    filter: f64,
    /// γ dt, (A/m)²/m².
    gain: f64,
    dead_zone_m: f64,
    shape_a_per_m: f64,
    /// ŷ, m.
    filtered_prediction_m: f64,
    /// y_f, m.
    filtered_measurement_m: f64,
}

impl Gradient {
    /// The law at its start: filters at zero, where a demagnetised rod at rest is.
    pub fn new(settings: &GradientSettings, tick_s: f64) -> Self {
        Self {
            filter: settings.filter_per_s * tick_s,
            gain: settings.gain() * tick_s,
            dead_zone_m: settings.dead_zone_m,
            shape_a_per_m: settings.start_a_per_m,
            filtered_prediction_m: 0.0,
            filtered_measurement_m: 0.0,
        }
    }
}

impl Law for Gradient {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        let grid = prediction.grid;
        let output = grid.smooth(prediction.displacements_m, self.shape_a_per_m);
        let mut correction = Correction {
            output_error_m: self.filtered_prediction_m - self.filtered_measurement_m,
            predicted_output_m: output.value,
            lower_cover_m: output.value,
            upper_cover_m: output.value,
            slope_m_per_a_per_m: output.slope,
            held: !is_credible(measured_displacement_m),
            ..Correction::default()
        };
        if !correction.held {
            let h = self.filter;
            self.filtered_measurement_m = (self.filtered_measurement_m + h * measured_displacement_m) / (1.0 + h);
            let drive = self.filtered_prediction_m + h * output.value - (1.0 + h) * self.filtered_measurement_m;
            let damping = (0.5 * self.gain * output.slope * output.slope - 1.0).max(0.0);
            let error = output_error(drive.abs(), h, 0.0, damping, self.dead_zone_m).copysign(drive);
            self.filtered_prediction_m = error + self.filtered_measurement_m;
            let outside = error - error.clamp(-self.dead_zone_m, self.dead_zone_m);
            self.shape_a_per_m = grid.project(self.shape_a_per_m - self.gain * outside * output.slope);
            correction.output_error_m = error;
            correction.adapting = outside != 0.0;
        }
        correction.shape_a_per_m = self.shape_a_per_m;
        correction.at_edge = grid.is_edge(self.shape_a_per_m);
        correction
    }

    fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }
}

#[cfg(test)]
#[path = "gradient_tests.rs"]
mod tests;
