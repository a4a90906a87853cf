//! ŷ′ = κ(Y(θ̂) − ŷ) − κ a* sat(ỹ/ε),  ẏ_f = κ(y − y_f),  θ̂′ = −γ ỹ_ε φ*,  ỹ = ŷ − y_f,  ỹ_ε = ỹ − ε sat(ỹ/ε)
//!
//! y measured displacement, Y(θ) displacement that the bank predicts through the known rod, ŷ and y_f filtered versions
//! of both (m); θ̂ estimate of the shape parameter on Θ (A/m); κ filter (1/s); ε half-width of the dead zone (m);
//! γ gain ((A/m)²/(m² s)); φ* slope at θ̂ (m per A/m) of the convex cover of Y where ỹ > 0, of the concave one where
//! ỹ < 0; a* = |Y(θ̂) − that cover| (m).
//! Assumptions: the rod and every other parameter are known, the true θ lies in Θ and is constant.
//! Source: the paper's (14)-(18), folded through the rod so that the displacement alone is needed. The covers are paired
//! with the sign of ỹ as the derivation says, not as (18) is printed.
//!
//! **In discrete time** with h = κ·dt, everything taken at the new instant except θ̂ in Y (backward Euler):
//! y_f⁺ = (y_f + h y)/(1 + h) and, with z = ŷ⁺ − y_f⁺ and R = ŷ + h Y(θ̂) − (1 + h) y_f⁺,
//!   (1 + h) z + h a* sat(z/ε) + h d z_ε = R,   θ̂⁺ = proj_Θ(θ̂ − γ dt z_ε φ*),   d = max(0, γ dt φ*²/2 − 1).
//! The left side grows with z from 0, so sign z = sign R, which selects the cover beforehand, and z is piecewise linear
//! in R: a closed form. The damping d is the price of a step in time; it is 0 unless γ dt φ*² > 2.
//!
//! **V = ỹ_ε² + (κ/γ)(θ̂ − θ)² never grows, for any dt, κ, γ, ε, input and history**, when y = Y(θ). Proof: subtracting
//! (1 + h) y_f⁺ = y_f + h Y(θ) gives (1 + h) z + h a* sat(z/ε) + h d z_ε = ỹ + h (Y(θ̂) − Y(θ)).
//! 1. |z| ≤ ε: ỹ_ε becomes 0 and θ̂ stays.
//! 2. z > ε: a* = Y(θ̂) − L(θ̂), and Y(θ) ≥ L(θ) ≥ L(θ̂) + φ*(θ − θ̂) for the convex cover L, so with θ̃ = θ̂ − θ
//!    z − ỹ = h (Y(θ̂) − Y(θ) − a* − z − d z_ε) ≤ h (φ*θ̃ − z − d z_ε).
//!    As z_ε − ỹ_ε ≤ z − ỹ for z > ε, and x² − w² ≤ 2x(x − w):  Δ(ỹ_ε²) ≤ 2h z_ε(φ*θ̃ − z_ε − d z_ε).
//!    The projection only brings θ̂ nearer to θ:  (κ/γ)Δ(θ̃²) ≤ −2h z_ε φ*θ̃ + h γ dt z_ε² φ*².
//!    The sum is at most h z_ε²(γ dt φ*² − 2 − 2d) ≤ 0.
//! 3. z < −ε: the same with signs turned and the concave cover.
//!
//! **The window.** a* is a threshold: while f is convex the estimate is raised or lowered, according to the sign of f, only by
//! errors larger than the gap between f and its chord over Θ, and on a periodic input that gap can hold it some 20 A/m away
//! from θ on one side for ever (condition (b) after the paper's (19)). Covers over the members within a window around θ̂
//! have a gap that shrinks with the window's square. The proof holds with the window in place of Θ: V cannot grow in a step
//! whose window contains θ. Outside, the law is the gradient law with a slope averaged over the window.
//!
//! (Limiting γ instead of adding d would not do: V weighs θ̃² by κ/γ with the nominal γ, and the cross terms
//! ±2h z_ε φ*θ̃ cancel only if the step used that same γ.)

use crate::covers::{CoverPoint, Covers};
use crate::law::is_credible;
use crate::{Correction, FoldedSettings, Law, Prediction};
use serde::{Deserialize, Serialize};

/// Which cover goes with ỹ > 0.
#[derive(Clone, Copy, PartialEq)]
enum Pairing {
    /// The convex one: what the proof needs.
    Derived,
    /// The concave one: (18) as printed. Wrong; here so that tests can show what it costs.
    #[cfg(test)]
    Printed,
}

/// The folded min-max law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Folded {
    tick_s: f64,
    /// κ, 1/s.
    filter_per_s: f64,
    /// γ, (A/m)²/(m² s).
    gain: f64,
    dead_zone_m: f64,
    window_a_per_m: Option<f64>,
    covers: Covers,
    shape_a_per_m: f64,
    /// ŷ, m.
    filtered_prediction_m: f64,
    /// y_f, m.
    filtered_measurement_m: f64,
}

/// z of the file's head for a drive R ≥ 0: two straight pieces that meet at z = ε.
pub(crate) fn output_error(drive: f64, h: f64, gap: f64, damping: f64, dead_zone: f64) -> f64 {
    if drive <= (1.0 + h) * dead_zone + h * gap {
        return drive / (1.0 + h + h * gap / dead_zone);
    }
    let beyond = drive - h * gap;
    if damping == 0.0 {
        // A product, since the law waits for this: the quotient of constants is ready long before.
        return beyond * (1.0 / (1.0 + h));
    }
    (beyond + h * damping * dead_zone) / (1.0 + h + h * damping)
}

impl Folded {
    /// The law at its start: filters at zero, where a demagnetised rod at rest is.
    pub fn new(settings: &FoldedSettings, tick_s: f64) -> Self {
        Self {
            tick_s,
            filter_per_s: settings.filter_per_s,
            gain: settings.gain(),
            dead_zone_m: settings.dead_zone_m,
            window_a_per_m: settings.window_a_per_m,
            covers: Covers::with_members(settings.members),
            shape_a_per_m: settings.start_a_per_m,
            filtered_prediction_m: 0.0,
            filtered_measurement_m: 0.0,
        }
    }

    fn cover(&self, lower: CoverPoint, upper: CoverPoint, positive: bool, pairing: Pairing) -> CoverPoint {
        if positive == (pairing == Pairing::Derived) {
            lower
        } else {
            upper
        }
    }

    fn correct_paired(&mut self, prediction: Prediction<'_>, measured_m: f64, pairing: Pairing) -> Correction {
        let (grid, outputs) = (prediction.grid, prediction.displacements_m);
        let predicted = grid.linear(outputs, self.shape_a_per_m);
        let seen = match self.window_a_per_m {
            Some(window) => grid.members_around(self.shape_a_per_m, window),
            None => 0..outputs.len(),
        };
        let (lower, upper) = self.covers.around(grid, seen, outputs, self.shape_a_per_m);
        let mut correction = Correction {
            shape_a_per_m: self.shape_a_per_m,
            output_error_m: self.filtered_prediction_m - self.filtered_measurement_m,
            predicted_output_m: predicted,
            lower_cover_m: lower.value,
            upper_cover_m: upper.value,
            held: !is_credible(measured_m),
            ..Correction::default()
        };
        if !correction.held {
            let h = self.filter_per_s * self.tick_s;
            self.filtered_measurement_m = (self.filtered_measurement_m + h * measured_m) / (1.0 + h);
            let drive = self.filtered_prediction_m + h * predicted - (1.0 + h) * self.filtered_measurement_m;
            let cover = self.cover(lower, upper, drive > 0.0, pairing);
            let gap = (predicted - cover.value).abs();
            let curvature = self.gain * self.tick_s * cover.slope * cover.slope;
            let damping = (0.5 * curvature - 1.0).max(0.0);
            let error = output_error(drive.abs(), h, gap, damping, self.dead_zone_m).copysign(drive);
            self.filtered_prediction_m = error + self.filtered_measurement_m;
            let outside = error - error.clamp(-self.dead_zone_m, self.dead_zone_m);
            self.shape_a_per_m = grid.project(self.shape_a_per_m - self.gain * self.tick_s * outside * cover.slope);
            correction.shape_a_per_m = self.shape_a_per_m;
            correction.output_error_m = error;
            correction.slope_m_per_a_per_m = cover.slope;
            correction.adapting = outside != 0.0;
        }
        correction.at_edge = grid.is_edge(self.shape_a_per_m);
        correction
    }
}

impl Law for Folded {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        self.correct_paired(prediction, measured_displacement_m, Pairing::Derived)
    }

    fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }
}

#[cfg(test)]
#[path = "folded_tests.rs"]
mod tests;
