//! The slope with one division, and one step of the classical fourth-order Runge-Kutta rule.
//!
//! With Man = Ms·x·P/Q and ∂Man/∂He = (Ms/a)·B/Q² (see `curve.rs`), A = Q(Man − M), E = kδQ − α̂A,
//! r = (c·Ms/a)·B:  dM/dH = (A·Q² + r·E) / (E·(Q² − α·r)).
//! Valid where δ̂ = 1; where δ̂ = 0 no integration is needed, because Mirr is frozen.
//! Generic over [`Number`], so a single model and a bank run the same equations.

use crate::curve::{Curve, Fraction};
use crate::law::domain_wall::Hysteresis;
use crate::number::lanes::Number;

/// The parameters as the slope uses them; `pinning` carries the direction's sign.
#[derive(Clone, Copy)]
pub(crate) struct Coefficients<N> {
    pub saturation: N,
    pub inverse_shape: N,
    pub coupling: N,
    /// α̂ = α/(1 − c).
    pub coupling_hat: N,
    /// k·δ, A/m.
    pub pinning: N,
    /// c·Ms/a, no unit.
    pub reversible_gain: N,
}

impl Coefficients<f64> {
    #[inline(always)]
    pub fn of(hysteresis: &Hysteresis, direction: f64) -> Self {
        Coefficients::of_parameters(hysteresis.parameters(), direction)
    }
}

impl<N: Number> Coefficients<N> {
    /// From Ms, a, k, α, c, in the order of [`HysteresisParameter::ALL`](super::HysteresisParameter::ALL).
    #[inline(always)]
    pub fn of_parameters([saturation, shape, pinning, coupling, reversibility]: [N; 5], direction: f64) -> Self {
        let inverse_shape = N::splat(1.0) / shape;
        Coefficients {
            saturation,
            inverse_shape,
            coupling,
            coupling_hat: coupling / (N::splat(1.0) - reversibility),
            pinning: pinning * N::splat(direction),
            reversible_gain: reversibility * saturation * inverse_shape,
        }
    }

    #[inline(always)]
    pub fn curve<C: Curve<N>>(&self, field: N, magnetization: N) -> Fraction<N> {
        C::fraction((field + self.coupling * magnetization) * self.inverse_shape)
    }

    /// Q·(Man − M).
    #[inline(always)]
    pub fn lag(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        self.saturation * (fraction.x * fraction.numerator) - magnetization * fraction.denominator
    }

    /// dM/dH with δ̂ = 1, from a curve already evaluated.
    #[inline(always)]
    pub fn slope_from(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        let lag = self.lag(fraction, magnetization);
        let q = fraction.denominator;
        let q_squared = q * q;
        let wall = self.pinning * q - self.coupling_hat * lag;
        let bending = self.reversible_gain * fraction.derivative;
        (lag * q_squared + bending * wall) / (wall * (q_squared - self.coupling * bending))
    }

    /// dM/dH with δ̂ = 0.
    #[inline(always)]
    pub fn bending_slope(&self, fraction: &Fraction<N>) -> N {
        let bending = self.reversible_gain * fraction.derivative;
        bending / (fraction.denominator * fraction.denominator - self.coupling * bending)
    }

    /// dM/dH with δ̂ = 1.
    #[inline(always)]
    pub fn slope<C: Curve<N>>(&self, field: N, magnetization: N) -> N {
        self.slope_from(&self.curve::<C>(field, magnetization), magnetization)
    }

    /// Magnetization after the field step, the first slope being known.
    #[inline(always)]
    pub fn step_from<C: Curve<N>>(&self, field: N, magnetization: N, step: N, first: N) -> N {
        self.step_with_mean::<C>(field, magnetization, step, first).0
    }

    /// The same, and the mean magnetization over the step from the same slopes: M + (h/6)(k₁ + k₂ + k₃), fourth order.
    #[inline(always)]
    pub fn step_with_mean<C: Curve<N>>(&self, field: N, magnetization: N, step: N, first: N) -> (N, N) {
        let half = N::splat(0.5) * step;
        let middle = field + half;
        let second = self.slope::<C>(middle, magnetization + half * first);
        let third = self.slope::<C>(middle, magnetization + half * second);
        let fourth = self.slope::<C>(field + step, magnetization + step * third);
        let sum = (first + fourth) + N::splat(2.0) * (second + third);
        let sixth = step * N::splat(1.0 / 6.0);
        (
            magnetization + sixth * sum,
            magnetization + sixth * (first + second + third),
        )
    }
}
