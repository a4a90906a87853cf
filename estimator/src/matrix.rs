//! ŷ′ = Λ ŷ + B (f(u, θ̂) − a* sat(z̃/ε) − d z̃_ε),  θ̂′ = −γ z̃_ε φ*,  z̃ = Re Σ ŷ_i − z,  z̃_ε = z̃ − ε sat(z̃/ε)
//!
//! for any system y′ = Λ y + B f(u, θ) with the measured output z = Re Σ y_i that is strictly positive real
//! (`modes.rs`): ŷ the law's copy of the state, θ̂ estimate of the shape parameter on Θ (A/m), ε half-width of the dead
//! zone (unit of z), γ gain ((A/m)² per unit of f, unit of z and second), d what a tick costs (0 without one), φ* slope
//! and a* = |f(θ̂) − cover(θ̂)| of the convex cover of f where z̃ > 0, of the concave one where z̃ < 0. The state
//! itself is not measured. Assumptions: Λ, B and every other parameter known, the true θ in Θ and constant.
//! Source: the paper's (20)-(21), with what its proof needs in place of what is printed: the error corrects through B
//! and not through C (a positive real output has PΛ + Λᵀ P < 0 and PB = c, so that V = eᵀPe + θ̃²/γ falls; with C
//! nothing of the kind holds, and (22) is an assumption on signs that a swinging input breaks); z̃ inside sat(); covers
//! paired as in `folded.rs`. The paper's ε sat() beside a* is left out: it has the unit of z and not of f, and would
//! only add to the threshold that a* is already.
//!
//! **In discrete time**, exact for an input that is linear between ticks (`sampled_modes.rs`): with w = f(θ̂) − i the
//! input that was really applied and everything at the new instant but θ̂ in f,
//!   z̃ = R − g i,  R = Re Σ ξ⁺ + g f(θ̂) − z,   i = a* sat(z̃/ε) + d z̃_ε,   θ̂⁺ = proj_Θ(θ̂ − γT z̃_ε φ*),
//! so z̃ + g a* sat(z̃/ε) + g d z̃_ε = R, whose left side grows with z̃ from 0: sign z̃ = sign R selects the cover
//! beforehand, and z̃ is piecewise linear in R. The paper's section 5 says that no implicit method can be used since
//! the forcing at the next step is not known; with a bank it is known for every θ, and the implicit step has a closed
//! form. f is read at θ̂ of the tick before: what enters R must not depend on z̃. ε = 0 is allowed and makes sat() a
//! sign: while |R| ≤ g a* the error is 0 and i = R/g lies between its ends.
//!
//! **Proof.** v = f(θ̂) − f(θ) − i drives the error, ξ̃⁺ = Φ ξ̃ + B′ v, z̃ = Re Σ ξ̃ + g v. Re 1/G_d ≥ η on the unit
//! circle gives a P > 0 with  Δ(ξ̃ᵀPξ̃) ≤ 2 z̃ v − 2 η z̃².  Take z̃ > 0 (else turn the signs). The cover says that
//! f(θ̂) − f(θ) ≤ a* + φ*θ̃, and the projection only helps, so with V = ξ̃ᵀPξ̃ + θ̃²/(γT):
//!   ΔV ≤ 2 z̃ (φ*θ̃ + a* − i) − 2 η z̃² − 2 z̃_ε φ*θ̃ + γT φ*² z̃_ε².
//! 1. ε = 0:  ΔV ≤ z̃² (γT φ*² − 2d − 2η) ≤ 0 with d = max(0, γT φ*²/2 − η). **V never grows**, for any tick, gain,
//!    input and history. From rest, ξ̃ = 0, this bounds |θ̃| by its first value for ever.
//! 2. ε > 0:  ΔV ≤ 2 min(|z̃|, ε) |φ*θ̃| + 2 |z̃| a* (1 − |z̃|/ε)₊ ≤ 2 ε |φ*θ̃| + ε a*/2 in a tick. The storage speaks
//!    of z̃, the adaptation of z̃_ε, and their difference ε φ*θ̃ is left; the folded law has one state, whose square
//!    may be counted from ε, and pays nothing. The price vanishes with ε; where z̃ φ*θ̃ < 0 only its
//!    second part is left.
//!
//! The window around θ̂ is that of `folded.rs`: the proof holds while it contains θ.

use crate::covers::Covers;
use crate::modes::Modes;
use crate::sampled_modes::SampledModes;
use crate::{Correction, EstimatorError, Grid};
use serde::{Deserialize, Serialize};

/// Share of η that is used: the least between two checked frequencies is not seen.
const CERTAIN: f64 = 0.9;

/// Constants of the matrix law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MatrixConstants {
    /// Where the estimate starts, A/m.
    pub start_a_per_m: f64,
    /// ε, in the unit of z; 0 is allowed.
    pub dead_zone: f64,
    /// γ, (A/m)² per unit of f, unit of z and second.
    pub gain: f64,
    /// Covers are built over the members this near to the estimate, A/m; none: over all of Θ.
    pub window_a_per_m: Option<f64>,
}

/// The matrix law for any positive real modal system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Matrix {
    system: SampledModes,
    /// g and 1/g.
    feedthrough: f64,
    per_feedthrough: f64,
    /// η.
    passivity: f64,
    /// γT.
    gain: f64,
    dead_zone: f64,
    window_a_per_m: Option<f64>,
    covers: Covers,
    shape_a_per_m: f64,
    /// w, the input that was applied at the last tick.
    applied: f64,
}

/// z̃ of the file's head for a drive R ≥ 0 with q = g a* and r = g d: z + q sat(z/ε) + r z_ε = R.
fn output_error(drive: f64, threshold: f64, damping: f64, dead_zone: f64) -> f64 {
    let corner = dead_zone + threshold;
    if drive > corner && damping == 0.0 {
        dead_zone + (drive - corner)
    } else if drive > corner {
        dead_zone + (drive - corner) / (1.0 + damping)
    } else if dead_zone > 0.0 {
        drive * (dead_zone / corner)
    } else {
        0.0
    }
}

impl Matrix {
    /// The law at its start, for a system at rest and a bank of `members`.
    ///
    /// # Errors
    /// If the sampled output is not positive real.
    pub fn new(modes: &Modes, constants: MatrixConstants, members: usize, tick_s: f64) -> Result<Self, EstimatorError> {
        let system = SampledModes::new(modes, tick_s);
        let passivity = CERTAIN * system.passivity(modes, tick_s)?;
        Ok(Self {
            feedthrough: system.feedthrough(),
            per_feedthrough: 1.0 / system.feedthrough(),
            passivity,
            system,
            gain: constants.gain * tick_s,
            dead_zone: constants.dead_zone,
            window_a_per_m: constants.window_a_per_m,
            covers: Covers::with_members(members),
            shape_a_per_m: constants.start_a_per_m,
            applied: 0.0,
        })
    }

    /// One tick with f of every member (one per shape of the grid) and the output z, both at its end. Without a finite
    /// z the copy runs on uncorrected and the estimate stays. The correction's "output" is f; only its error is one of
    /// z.
    pub fn correct(&mut self, grid: &Grid, inputs: &[f64], measured: f64) -> Correction {
        let at = self.shape_a_per_m;
        let seen = grid.members_seen(at, self.window_a_per_m);
        let (lower, upper) = self.covers.around(grid, seen, inputs, at);
        let input = grid.linear(inputs, at);
        let predicted = self.system.advance(self.applied) + self.feedthrough * input;
        self.applied = input;
        let mut correction = Correction {
            shape_a_per_m: at,
            predicted_output_m: input,
            lower_cover_m: lower.value,
            upper_cover_m: upper.value,
            held: !measured.is_finite(),
            ..Correction::default()
        };
        if !correction.held {
            let drive = predicted - measured;
            let cover = if drive > 0.0 { lower } else { upper };
            let threshold = self.feedthrough * (input - cover.value).abs();
            let damping = (0.5 * self.gain * cover.slope * cover.slope - self.passivity).max(0.0);
            let error =
                output_error(drive.abs(), threshold, self.feedthrough * damping, self.dead_zone).copysign(drive);
            self.applied = input - (drive - error) * self.per_feedthrough;
            let outside = error - error.clamp(-self.dead_zone, self.dead_zone);
            self.shape_a_per_m = grid.project(at - self.gain * outside * cover.slope);
            correction.shape_a_per_m = self.shape_a_per_m;
            correction.output_error_m = error;
            correction.slope_m_per_a_per_m = cover.slope;
            correction.adapting = outside != 0.0;
        }
        correction.at_edge = grid.is_edge(self.shape_a_per_m);
        correction
    }

    /// Where the estimate stands, A/m.
    pub fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }
}

#[cfg(test)]
#[path = "matrix_tests.rs"]
mod tests;
