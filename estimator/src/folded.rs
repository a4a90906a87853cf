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
//!
//! The step is that of `scalar.rs` in units of 1/κ. Two other laws take it too, to compare with ([`Form`]):
//! - **Scalar**, the paper's (14)-(18) as they stand, with the measured displacement driving a plant of (23): its own ε
//!   beside a* and its covers over all of Θ, without a window. It stops where condition (19) stops holding: with Langevin
//!   an estimate above the truth comes down only as far as the chord of f over Θ allows, some 5 to 30 A/m on a cut
//!   (`the_scalar_law_stops_short_from_above`, `tests/laws_in_the_loop.rs`).
//! - **Gradient**, a* = 0 and φ* = Y′(θ̂): what the covers add is all the difference. It descends the square of the output
//!   error and nothing more: where Y is not monotone in θ on Θ it stops where Y′ turns the wrong way. For the material's Θ
//!   of ±7 % Y is nearly linear in θ and it does as well as any; `gradient_tests.rs` has a case where it fails (the paper's
//!   section 3, "regions of nonconvexity of f where the gradient method is insufficient").

use crate::covers::Covers;
use crate::law::is_credible;
use crate::scalar::Form;
use crate::{Correction, Law, MinMaxSettings, Prediction, Scalar, ScalarPlant};
use serde::{Deserialize, Serialize};

/// The folded min-max law, or one of those beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Folded {
    /// κ dt: a tick in the unit of time.
    tick: f64,
    /// y_f, m.
    filter: ScalarPlant,
    law: Scalar,
}

impl Folded {
    /// The law at its start: filters at zero, where a demagnetised rod at rest is.
    pub fn new(form: Form, settings: &MinMaxSettings, tick_s: f64) -> Self {
        let tick = settings.filter_per_s * tick_s;
        Self {
            tick,
            filter: ScalarPlant::new(1.0),
            law: Scalar {
                form,
                window_a_per_m: settings.window_a_per_m,
                h: tick,
                weight: tick,
                gain: settings.gain() * tick_s,
                half_gain: 0.5 * settings.gain() * tick_s,
                dead_zone: settings.dead_zone_m,
                covers: Covers::with_members(settings.members),
                shape_a_per_m: settings.start_a_per_m,
                predicted: 0.0,
            },
        }
    }
}

impl Law for Folded {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        let (grid, outputs) = (prediction.grid, prediction.displacements_m);
        if !is_credible(measured_displacement_m) {
            return self.law.hold(grid, outputs, self.filter.state());
        }
        let observed = self.filter.advance(measured_displacement_m, self.tick);
        self.law.correct(grid, outputs, observed)
    }

    fn shape_a_per_m(&self) -> f64 {
        self.law.shape_a_per_m()
    }
}

#[cfg(test)]
#[path = "gradient_tests.rs"]
mod gradient_tests;
