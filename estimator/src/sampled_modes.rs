//! y_i⁺ = Φ_i y_i + Γ0_i w + Γ1_i (w⁺ − w),  z = Re Σ y_i: the modes over one tick.
//!
//! Exact for an input that is linear within the tick.
//! Φ = e^{λT},  Γ0 = T φ₁(λT) B,  Γ1 = T φ₂(λT) B,  φ₁(x) = (eˣ − 1)/x,  φ₂(x) = (eˣ − 1 − x)/x²; T tick (s).
//! With ξ_i = y_i − Γ1_i w the input enters twice, but each at its own instant:
//!   ξ_i⁺ = Φ_i ξ_i + B′_i w,  B′ = ΦΓ1 + Γ0 − Γ1,  z = Re Σ ξ_i + g w,  g = Re Σ Γ1_i.
//! So everything in z⁺ but g w⁺ is known before w⁺ is chosen: what the law in `matrix.rs` needs to choose it.
//! Transfer function G_d = g + Re-pairs Σ B′_i/(e^{jΩ} − Φ_i), Ω = 2πfT angle per tick.
//!
//! **Every tick keeps an output positive real.** The input's hat functions have the transform T sinc² ≥ 0, so the
//! sampled transfer function is a positive sum over the aliases, Re G_d(Ω) = Σ_m sinc²(Ω/2 + πm) Re G(j(Ω + 2πm)/T). A
//! held input or an Euler step has no such sum. The check is made nevertheless, on the numbers that the law will use.
//! Source: partial fractions, and the aliases of a sampled signal.

use crate::EstimatorError;
use crate::modes::{Modes, magnitude};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Frequencies of the check, evenly spread, and as many again spread by decades.
const FREQUENCIES: u32 = 2048;
/// Frequencies about every mode.
const ABOUT_A_MODE: i32 = 64;

/// One mode over one tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SampledMode {
    /// Φ.
    transition: Complex64,
    /// B′.
    input: Complex64,
}

/// The modes over one tick, with their state ξ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SampledModes {
    modes: Vec<SampledMode>,
    /// g.
    feedthrough: f64,
    /// ξ.
    state: Vec<Complex64>,
}

impl SampledModes {
    /// At rest.
    pub fn new(modes: &Modes, tick_s: f64) -> Self {
        let mut sampled = Vec::with_capacity(modes.kept().len());
        let mut feedthrough = 0.0;
        for mode in modes.kept() {
            let exponent = mode.eigenvalue_per_s * tick_s;
            let second = second_phi(exponent);
            let transition = exponential(exponent);
            let held = (second * exponent + 1.0) * mode.input * tick_s;
            let changing = second * mode.input * tick_s;
            feedthrough += changing.re;
            sampled.push(SampledMode {
                transition,
                input: transition * changing + held - changing,
            });
        }
        Self {
            state: vec![Complex64::ZERO; sampled.len()],
            modes: sampled,
            feedthrough,
        }
    }

    /// g: how much of the input is in the output at once.
    pub fn feedthrough(&self) -> f64 {
        self.feedthrough
    }

    /// Moves one tick on from the input `w` at its start; z⁺ − g w⁺, the output at its end without what the input there
    /// adds.
    pub fn advance(&mut self, input: f64) -> f64 {
        let mut sum = 0.0;
        for (state, mode) in self.state.iter_mut().zip(&self.modes) {
            *state = mode.transition * *state + mode.input * input;
            sum += state.re;
        }
        sum
    }

    /// Re Σ Φ_iᵖ B′_i: the output p + 1 ticks after a unit input of one tick.
    pub fn response_after(&self, ticks: u32) -> f64 {
        let after = |mode: &SampledMode| (0..ticks).fold(mode.input, |product, _| product * mode.transition).re;
        self.modes.iter().map(after).sum()
    }

    /// The coefficients of z² − d₁ z + d₀ for two poles: (d₁, d₀), sum and product of the transitions.
    pub fn pole_sum_and_product(&self) -> (f64, f64) {
        match self.modes.as_slice() {
            [pair] => (2.0 * pair.transition.re, pair.transition.norm_sqr()),
            [one, other, ..] => (
                one.transition.re + other.transition.re,
                one.transition.re * other.transition.re,
            ),
            [] => (0.0, 0.0),
        }
    }

    /// G_d(e^{jΩ}). A mode stands for its conjugate too, so its fraction is that of both.
    fn transfer(&self, angle: f64) -> Complex64 {
        let z = Complex64::new(libm::cos(angle), libm::sin(angle));
        let one = |mode: &SampledMode| {
            let fraction = |transition: Complex64, input: Complex64| input / (z - transition);
            0.5 * (fraction(mode.transition, mode.input) + fraction(mode.transition.conj(), mode.input.conj()))
        };
        self.modes.iter().map(one).sum::<Complex64>() + self.feedthrough
    }

    /// η = min Re 1/G_d over all frequencies: how much every error loses by itself, so that Re G_d ≥ η |G_d|².
    ///
    /// # Errors
    /// The frequency at which Re G_d is not above 0.
    pub fn passivity(&self, modes: &Modes, tick_s: f64) -> Result<f64, EstimatorError> {
        let mut least = f64::INFINITY;
        for angle in frequencies(modes, tick_s) {
            let transfer = self.transfer(angle);
            let size = transfer.norm_sqr();
            if !(transfer.re > 0.0 && size.is_finite()) {
                return Err(EstimatorError::NotPositiveReal {
                    frequency_hz: angle / (2.0 * PI * tick_s),
                    real_part: transfer.re,
                    at_rest: self.transfer(0.0).re,
                });
            }
            least = least.min(transfer.re / size);
        }
        Ok(least)
    }
}

/// Angles per tick from 0 to π: evenly, by decades, and close about every mode, however weakly it is damped.
fn frequencies(modes: &Modes, tick_s: f64) -> impl Iterator<Item = f64> {
    let even = (0..=FREQUENCIES).map(|i| PI * f64::from(i) / f64::from(FREQUENCIES));
    let decades = (0..FREQUENCIES).map(|i| PI * libm::pow(10.0, -12.0 * f64::from(i) / f64::from(FREQUENCIES)));
    let about_modes = modes.kept().iter().flat_map(move |mode| {
        let Complex64 { re, im } = mode.eigenvalue_per_s * tick_s;
        (-ABOUT_A_MODE..=ABOUT_A_MODE).map(move |i| {
            // Even steps of the phase of 1/(jΩ − λ).
            let away = libm::tan(0.49 * PI * f64::from(i) / f64::from(ABOUT_A_MODE));
            let angle = libm::remainder(im + re * away, 2.0 * PI);
            angle.abs().min(PI)
        })
    });
    even.chain(decades).chain(about_modes)
}

fn exponential(exponent: Complex64) -> Complex64 {
    let size = libm::exp(exponent.re);
    Complex64::new(size * libm::cos(exponent.im), size * libm::sin(exponent.im))
}

/// φ₂(x) = (eˣ − 1 − x)/x²; its series Σ xⁿ/(n + 2)! where the difference would cancel.
fn second_phi(x: Complex64) -> Complex64 {
    if magnitude(x) > 1.0 {
        return (exponential(x) - 1.0 - x) / (x * x);
    }
    let mut term = Complex64::new(0.5, 0.0);
    let mut sum = term;
    for n in 1..20_u32 {
        term = term * x / f64::from(n + 2);
        sum += term;
    }
    sum
}

#[cfg(test)]
#[path = "sampled_modes_tests.rs"]
pub(crate) mod tests;
