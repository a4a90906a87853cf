//! ẏ = −k y + f(u, θ),  ŷ′ = −k ŷ + f(u, θ̂) − (ε + a*) sat(ỹ/ε),  θ̂′ = −γ ỹ_ε φ*,  ỹ = ŷ − y,  ỹ_ε = ỹ − ε sat(ỹ/ε)
//!
//! f magnetization that the bank predicts (A/m), y state of the first-order plant that it drives and ŷ the law's copy
//! (A s/m), k decay (1/s), θ̂ estimate of the shape parameter on Θ (A/m), ε half-width of the dead zone (A s/m), γ gain
//! (1/s²), φ* slope and a* = |f(θ̂) − cover(θ̂)| of the cover of f over all of Θ: the convex one where ỹ > 0, the
//! concave one where ỹ < 0.
//! Source: the paper's (14)-(18) with f = M(u, a) of (23), errata as in `folded.rs`; the paper has γ = 1. It asks for
//! the state y, which no rod has: `folded.rs` makes one of the measured displacement, with f in metres and time counted
//! in 1/k, and takes the same step with or without the ε beside a*, with covers over a window, or with f's own slope.
//!
//! **In discrete time** with h = k·dt, backward Euler for plant and law: y⁺ = (y + dt f(θ))/(1 + h) and, with
//! z = ŷ⁺ − y⁺,
//!   (1 + h) z + dt (ε + a*) sat(z/ε) + h d z_ε = ŷ + dt f(θ̂) − (1 + h) y⁺,   d = max(0, γ dt φ*²/(2k) − 1),
//! which is the folded law's equation with (ε + a*)/k in place of a*. V = ỹ_ε² + θ̃²/γ never grows: the proof there,
//! with dt in place of h before f, leaves z_ε²(γ dt² φ*² − 2h(1 + d)) − 2 dt ε z_ε ≤ 0.

use crate::covers::{CoverPoint, Covers};
use crate::{Correction, Grid};
use serde::{Deserialize, Serialize};

/// Which terms the step has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Form {
    /// a* and φ* of covers: the folded law.
    Folded,
    /// The paper's own ε beside a*.
    Scalar,
    /// No covers: a* = 0 and φ* the slope of f itself, for comparison.
    Gradient,
}

/// Which cover goes with ỹ > 0.
#[derive(Clone, Copy, PartialEq)]
enum Pairing {
    /// The convex one: what the proof needs.
    Derived,
    /// The concave one: (18) as printed. Wrong; here so that tests can show what it costs.
    #[cfg(test)]
    Printed,
}

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

    pub(crate) fn state(&self) -> f64 {
        self.state
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
    pub(crate) form: Form,
    pub(crate) window_a_per_m: Option<f64>,
    /// k dt.
    pub(crate) h: f64,
    /// dt, what f is weighed by.
    pub(crate) weight: f64,
    /// γ dt.
    pub(crate) gain: f64,
    /// γ dt/2k, what d is made of.
    pub(crate) half_gain: f64,
    pub(crate) dead_zone: f64,
    pub(crate) covers: Covers,
    pub(crate) shape_a_per_m: f64,
    /// ŷ, A s/m.
    pub(crate) predicted: f64,
}

/// z of the file's head for a drive R ≥ 0 and the threshold dt (ε + a*): two straight pieces that meet at z = ε.
fn output_error(drive: f64, h: f64, threshold: f64, damping: f64, dead_zone: f64) -> f64 {
    if drive <= (1.0 + h) * dead_zone + threshold {
        return drive / (1.0 + h + threshold / dead_zone);
    }
    let beyond = drive - threshold;
    if damping == 0.0 {
        // A product, since the law waits for this: the quotient of constants is ready long before.
        return beyond * (1.0 / (1.0 + h));
    }
    (beyond + h * damping * dead_zone) / (1.0 + h + h * damping)
}

impl Scalar {
    /// The paper's law at its start, for a bank of `members`.
    pub fn new(settings: ScalarSettings, members: usize, tick_s: f64) -> Self {
        Self {
            form: Form::Scalar,
            window_a_per_m: None,
            h: settings.decay_per_s * tick_s,
            weight: tick_s,
            gain: settings.gain * tick_s,
            half_gain: 0.5 * settings.gain * tick_s / settings.decay_per_s,
            dead_zone: settings.dead_zone,
            covers: Covers::with_members(members),
            shape_a_per_m: settings.start_a_per_m,
            predicted: 0.0,
        }
    }

    /// Where the estimate stands, A/m.
    pub fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }

    /// What f is at the estimate, and its covers there.
    #[inline(always)]
    fn look(&mut self, grid: &Grid, values: &[f64]) -> (f64, CoverPoint, CoverPoint) {
        let at = self.shape_a_per_m;
        if self.form == Form::Gradient {
            let own = grid.smooth(values, at);
            let cover = CoverPoint {
                value: own.value,
                slope: own.slope,
            };
            return (own.value, cover, cover);
        }
        let value = grid.linear(values, at);
        let seen = grid.members_seen(at, self.window_a_per_m);
        let (lower, upper) = self.covers.around(grid, seen, values, at);
        (value, lower, upper)
    }

    /// A step without an observation, which stays at `observed`: nothing moves.
    #[cold]
    pub(crate) fn hold(&mut self, grid: &Grid, values: &[f64], observed: f64) -> Correction {
        let (value, lower, upper) = self.look(grid, values);
        Correction {
            shape_a_per_m: self.shape_a_per_m,
            output_error_m: self.predicted - observed,
            predicted_output_m: value,
            lower_cover_m: lower.value,
            upper_cover_m: upper.value,
            at_edge: grid.is_edge(self.shape_a_per_m),
            held: true,
            ..Correction::default()
        }
    }

    /// One step with the bank's magnetizations (A/m, one per member of the grid) and the plant's state (A s/m), both at
    /// its end. The outputs of the correction are magnetizations (A/m) here, its error is ỹ (A s/m), its slope has no
    /// unit.
    pub fn correct(&mut self, grid: &Grid, magnetizations_a_per_m: &[f64], observed: f64) -> Correction {
        self.correct_paired(grid, magnetizations_a_per_m, observed, Pairing::Derived)
    }

    #[inline(always)]
    fn correct_paired(&mut self, grid: &Grid, values: &[f64], observed: f64, pairing: Pairing) -> Correction {
        let (value, lower, upper) = self.look(grid, values);
        let drive = self.predicted + self.weight * value - (1.0 + self.h) * observed;
        let cover = if (drive > 0.0) == (pairing == Pairing::Derived) {
            lower
        } else {
            upper
        };
        let beside = if self.form == Form::Scalar { self.dead_zone } else { 0.0 };
        let threshold = self.weight * (beside + (value - cover.value).abs());
        let damping = (self.half_gain * cover.slope * cover.slope - 1.0).max(0.0);
        let error = output_error(drive.abs(), self.h, threshold, damping, self.dead_zone).copysign(drive);
        self.predicted = error + observed;
        let outside = error - error.clamp(-self.dead_zone, self.dead_zone);
        self.shape_a_per_m = grid.project(self.shape_a_per_m - self.gain * outside * cover.slope);
        Correction {
            shape_a_per_m: self.shape_a_per_m,
            output_error_m: error,
            predicted_output_m: value,
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

#[cfg(test)]
#[path = "folded_tests.rs"]
mod folded_tests;
