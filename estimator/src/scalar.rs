//! ẏ = −k y + f(u, θ),  ŷ′ = −k ŷ + f(u, θ̂) − (ε + a*) sat(ỹ/ε),  θ̂′ = −γ ỹ_ε φ*,  ỹ = ŷ − y,  ỹ_ε = ỹ − ε sat(ỹ/ε)
//!
//! f magnetization that the bank predicts (A/m), y state of the first-order plant that it drives and ŷ the law's copy
//! (A s/m), k decay (1/s), θ̂ estimate of the shape parameter on Θ (A/m), ε half-width of the dead zone (A s/m), γ gain
//! (1/s²), φ* slope and a* = |f(θ̂) − cover(θ̂)| of the cover of f over all of Θ: the convex one where ỹ > 0, the
//! concave one where ỹ < 0.
//! Source: the paper's (14)-(18) with f = M(u, a) of (23), errata as in `folded.rs`; the paper has γ = 1. It asks for
//! the state y, which no rod has: `scalar_law.rs` makes one of the measured displacement.
//!
//! **In discrete time** with h = k·dt, backward Euler for plant and law: y⁺ = (y + dt f(θ))/(1 + h) and, with
//! z = ŷ⁺ − y⁺,
//!   (1 + h) z + dt (ε + a*) sat(z/ε) + h d z_ε = ŷ + dt f(θ̂) − (1 + h) y⁺,   d = max(0, γ dt² φ*²/(2h) − 1),
//! which is the folded law's equation with (ε + a*)/k in place of a*. V = ỹ_ε² + θ̃²/γ never grows: the proof there,
//! with dt in place of h before f, leaves z_ε²(γ dt² φ*² − 2h(1 + d)) − 2 dt ε z_ε ≤ 0.

use crate::covers::{CoverPoint, Covers};
use crate::folded::output_error;
use crate::{Correction, Grid};
use serde::{Deserialize, Serialize};

/// Constants of the scalar form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalarSettings {
    /// Where the estimate starts, A/m.
    pub start_a_per_m: f64,
    /// k, 1/s.
    pub decay_per_s: f64,
    /// ε, A s/m.
    pub dead_zone: f64,
    /// γ, 1/s².
    pub gain: f64,
}

/// The plant of (23): what the scalar form observes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalarPlant {
    decay_per_s: f64,
    state: f64,
}

impl ScalarPlant {
    /// At rest.
    pub fn new(decay_per_s: f64) -> Self {
        Self {
            decay_per_s,
            state: 0.0,
        }
    }

    /// One step of `tick_s` with the magnetization at its end; the state there, A s/m.
    pub fn advance(&mut self, magnetization_a_per_m: f64, tick_s: f64) -> f64 {
        self.state = (self.state + tick_s * magnetization_a_per_m) / (1.0 + self.decay_per_s * tick_s);
        self.state
    }
}

/// The scalar form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scalar {
    settings: ScalarSettings,
    tick_s: f64,
    covers: Covers,
    shape_a_per_m: f64,
    /// ŷ, A s/m.
    predicted: f64,
    /// ỹ, A s/m.
    error: f64,
}

impl Scalar {
    /// The law at its start, for a bank of `members`.
    pub fn new(settings: ScalarSettings, members: usize, tick_s: f64) -> Self {
        Self {
            settings,
            tick_s,
            covers: Covers::with_members(members),
            shape_a_per_m: settings.start_a_per_m,
            predicted: 0.0,
            error: 0.0,
        }
    }

    /// What f is at the estimate, and its covers there.
    fn look(&mut self, grid: &Grid, values: &[f64]) -> (f64, CoverPoint, CoverPoint) {
        let at = self.shape_a_per_m;
        let (lower, upper) = self.covers.around(grid, 0..values.len(), values, at);
        (grid.linear(values, at), lower, upper)
    }

    /// A step without an observation: nothing moves.
    pub fn hold(&mut self, grid: &Grid, magnetizations_a_per_m: &[f64]) -> Correction {
        let (magnetization, lower, upper) = self.look(grid, magnetizations_a_per_m);
        Correction {
            shape_a_per_m: self.shape_a_per_m,
            output_error_m: self.error,
            predicted_output_m: magnetization,
            lower_cover_m: lower.value,
            upper_cover_m: upper.value,
            at_edge: grid.is_edge(self.shape_a_per_m),
            held: true,
            ..Correction::default()
        }
    }

    /// Where the estimate stands, A/m.
    pub fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }

    /// One step with the bank's magnetizations (A/m, one per member of the grid) and the plant's state (A s/m), both at
    /// its end. The outputs of the correction are magnetizations (A/m) here, its error is ỹ (A s/m), its slope has no
    /// unit.
    pub fn correct(&mut self, grid: &Grid, magnetizations_a_per_m: &[f64], observed: f64) -> Correction {
        let ScalarSettings {
            decay_per_s,
            dead_zone,
            gain,
            ..
        } = self.settings;
        let (magnetization, lower, upper) = self.look(grid, magnetizations_a_per_m);
        let h = decay_per_s * self.tick_s;
        let drive = self.predicted + self.tick_s * magnetization - (1.0 + h) * observed;
        let cover = if drive > 0.0 { lower } else { upper };
        let threshold = (dead_zone + (magnetization - cover.value).abs()) / decay_per_s;
        let step = self.tick_s * cover.slope;
        let damping = (0.5 * gain * step * step / h - 1.0).max(0.0);
        self.error = output_error(drive.abs(), h, threshold, damping, dead_zone).copysign(drive);
        self.predicted = observed + self.error;
        let outside = self.error - self.error.clamp(-dead_zone, dead_zone);
        self.shape_a_per_m = grid.project(self.shape_a_per_m - gain * step * outside);
        Correction {
            shape_a_per_m: self.shape_a_per_m,
            output_error_m: self.error,
            predicted_output_m: magnetization,
            lower_cover_m: lower.value,
            upper_cover_m: upper.value,
            slope_m_per_a_per_m: cover.slope,
            adapting: outside != 0.0,
            at_edge: grid.is_edge(self.shape_a_per_m),
            ..Correction::default()
        }
    }
}

#[cfg(test)]
#[path = "scalar_tests.rs"]
mod tests;
