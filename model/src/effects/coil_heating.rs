//! H = u/(1 + β ΔT),  dΔT/dt = r (H/H₀)² − ΔT/τ: driven by a voltage, a warm coil passes less current.
//!
//! u command as the field that the cold coil would have, H coil field (A/m), ΔT rise of the coil (K), β = 0.0039 1/K of
//! copper, r heating (K/s) at H₀ = 10 kA/m, τ loss time (s). ΔT is that of the tick before: it moves over seconds.
//! A current-controlled amplifier does not have it. Source: copper; coils of such actuators take 1-5 minutes.

use serde::{Deserialize, Serialize};

use super::description::{CoilNeed, Description, Stage};
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use super::warming::{WARMED, Warming, heating};
use crate::ModelError;
use crate::parameter::ParameterSpec;

/// β, 1/K.
pub(crate) const COPPER_PER_K: f64 = 0.0039;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Amplifier,
    coil: CoilNeed::Always,
    summary: "under voltage drive the coil's resistance grows as it warms, and the field falls",
    signature: "measured field over command falls with the integral of the square, over seconds to minutes, and recovers \
                at rest; absent under current drive",
    source: "copper's +0.39 % a kelvin; coil time constants of 1-5 minutes",
    confused_with: &["thermal_drift", "sensor_gain"],
    parameters: &[
        heating(0.3),
        ParameterSpec::fixed("loss_time_s", "s", [0.1, 1e4], 100.0)
            .by_ratio()
            .believed(0.7),
        WARMED,
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CoilHeating {
    warming: Warming,
    /// Part of the tick that has passed.
    passed: f64,
    /// H/u in this tick.
    factor: f64,
}

impl FieldEffect for CoilHeating {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(CoilHeating {
            warming: Warming::of([values[0], values[1], values[2]], tick_s),
            passed: 0.0,
            factor: 1.0,
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.warming.steady_state(input);
        (self.passed, self.factor) = (0.0, 1.0 / (1.0 + COPPER_PER_K * self.warming.rise_k()));
        input * self.factor
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        let field = piece.to * self.factor;
        output.push(Piece {
            span: piece.span,
            to: field,
            mean: piece.mean * self.factor,
        });
        self.passed += piece.span;
        // The spans of a tick add up to 1 but for rounding.
        if self.passed > 1.0 - 1e-9 {
            let rise_k = self.warming.step(field);
            (self.passed, self.factor) = (0.0, 1.0 / (1.0 + COPPER_PER_K * rise_k));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the loop through the resistance: the steady field solves H(1 + βrτ(H/H₀)²) = u.
    #[test]
    fn the_field_settles_where_heat_and_loss_balance() {
        let (heating, loss_time_s, command) = (5.0, 3.0, 8e3);
        let mut coil = CoilHeating::new(&[heating, loss_time_s, 0.0], 1e-3).unwrap();
        coil.steady_state(command);
        let mut intersample = IntersampleField::empty();
        for _ in 0..60_000 {
            intersample.clear();
            coil.follow(Piece::straight(1.0, command, command), &mut intersample);
        }
        let field = intersample.end();
        let square = (field / 1e4) * (field / 1e4);
        let balance = field * (1.0 + COPPER_PER_K * heating * loss_time_s * square);
        assert!((balance - command).abs() < 1e-6, "{field}");
        assert!(field < 0.97 * command);
    }

    /// Guards the first sample of a coil that has been heated at 5 K/s for 4 s: it is 20 K warm, and cools from there.
    #[test]
    fn a_warm_coil_begins_with_less_field() {
        let mut coil = CoilHeating::new(&[5.0, 3.0, 4.0], 1e-3).unwrap();
        assert_eq!(coil.steady_state(8e3), 8e3 * (1.0 / (1.0 + COPPER_PER_K * 20.0)));
        for _ in 0..3000 {
            coil.follow(Piece::straight(1.0, 0.0, 0.0), &mut IntersampleField::empty());
        }
        // The first tick comes from the field at which it stood.
        let expected_k = 20.0 * libm::exp(-1.0);
        assert!(
            (coil.warming.rise_k() - expected_k).abs() < 2e-3,
            "{}",
            coil.warming.rise_k()
        );
    }
}
