//! The equations of the domain wall law with one division a slope, and one step of the classical fourth-order Runge-Kutta rule.
//!
//! He = H + αM + b₃M³, and α in a slope stands for its tangent α + 3b₃M².
//! With Man = Ms·x·P/Q and ∂Man/∂He = (Ms/a)·B/Q² (see `curve.rs`), A = Q(Man − M), E = kδQ − α̂A,
//! r = (c·Ms/a)·B:  dM/dH = (A·Q² + r·E) / (E·(Q² − α·r))  where δ̂ = 1,  r / (Q² − α·r)  where δ̂ = 0.
//! `CUBIC` says at compile time whether there is a b₃: without it nothing is paid for it, and the bits are those of b₃ = 0.

use std::marker::PhantomData;

use super::Hysteresis;
use crate::kernel::{Curve, Fraction};
use crate::number::Number;

/// Where δ̂ is 1.
#[derive(Clone, Copy)]
pub(super) struct Point<N> {
    pub field: N,
    pub magnetization: N,
    /// dM/dH there.
    pub slope: N,
}

/// The parameters as the equations use them, for one direction of the field.
pub(super) struct Coefficients<N, C, const CUBIC: bool> {
    pub saturation: N,
    pub shape: N,
    pub inverse_shape: N,
    pub coupling: N,
    /// α̂ = α/(1 − c).
    pub coupling_hat: N,
    /// 3b₃, m²/A².
    pub triple_cubic: N,
    /// k·δ, A/m.
    pub pinning: N,
    pub reversibility: N,
    /// 1 − c.
    pub rest: N,
    /// c·Ms/a, no unit.
    pub reversible_gain: N,
    pub curve: PhantomData<C>,
}

impl<C: Curve<f64>, const CUBIC: bool> Coefficients<f64, C, CUBIC> {
    #[inline(always)]
    pub fn of(law: &Hysteresis, direction: f64) -> Self {
        Coefficients::of_parameters(law.parameters(), law.cubic_coupling_m2_per_a2, direction)
    }
}

impl<N: Number, C: Curve<N>, const CUBIC: bool> Coefficients<N, C, CUBIC> {
    /// From Ms, a, k, α, c, in the order of [`HysteresisParameter::ALL`](super::HysteresisParameter::ALL), and b₃.
    #[inline(always)]
    pub fn of_parameters(
        [saturation, shape, pinning, coupling, reversibility]: [N; 5],
        cubic: f64,
        direction: f64,
    ) -> Self {
        let inverse_shape = N::splat(1.0) / shape;
        let rest = N::splat(1.0) - reversibility;
        Coefficients {
            saturation,
            shape,
            inverse_shape,
            coupling,
            coupling_hat: coupling / rest,
            triple_cubic: N::splat(3.0 * cubic),
            pinning: pinning * N::splat(direction),
            reversibility,
            rest,
            reversible_gain: reversibility * saturation * inverse_shape,
            curve: PhantomData,
        }
    }

    /// αM + b₃M³, A/m.
    #[inline(always)]
    pub fn coupling_field(&self, magnetization: N) -> N {
        if CUBIC {
            let cubic = self.triple_cubic * N::splat(1.0 / 3.0);
            magnetization * (self.coupling + cubic * (magnetization * magnetization))
        } else {
            self.coupling * magnetization
        }
    }

    /// α + 3b₃M².
    #[inline(always)]
    pub fn tangent(&self, magnetization: N) -> N {
        if CUBIC {
            self.coupling + self.triple_cubic * (magnetization * magnetization)
        } else {
            self.coupling
        }
    }

    /// The same for α̂.
    #[inline(always)]
    fn tangent_hat(&self, magnetization: N) -> N {
        if CUBIC {
            self.tangent(magnetization) / self.rest
        } else {
            self.coupling_hat
        }
    }

    #[inline(always)]
    pub fn curve(&self, field: N, magnetization: N) -> Fraction<N> {
        C::fraction((field + self.coupling_field(magnetization)) * self.inverse_shape)
    }

    /// Man, A/m.
    #[inline(always)]
    pub fn anhysteretic(&self, fraction: &Fraction<N>) -> N {
        (self.saturation * (fraction.x * fraction.numerator)).alone() / fraction.denominator
    }

    /// Mirr = (M − c·Man)/(1 − c), A/m.
    #[inline(always)]
    pub fn irreversible(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        (magnetization - self.reversibility * self.anhysteretic(fraction)) / self.rest
    }

    /// H* where Man = Mirr = M, from curve⁻¹(Mirr/Ms).
    #[inline(always)]
    pub fn switch_field(&self, argument: N, irreversible: N) -> N {
        self.shape * argument - self.coupling_field(irreversible)
    }

    /// Q·(Man − M).
    #[inline(always)]
    pub fn lag(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        // Ms·x is known long before P.
        ((self.saturation * fraction.x) * fraction.numerator - magnetization * fraction.denominator).alone()
    }

    /// Numerator and denominator of dM/dH with δ̂ = 1, from a curve already evaluated.
    #[inline(always)]
    fn ratio_from(&self, fraction: &Fraction<N>, magnetization: N) -> [N; 2] {
        let lag = self.lag(fraction, magnetization);
        let q = fraction.denominator;
        let q_squared = q * q;
        let wall = self.pinning * q - self.tangent_hat(magnetization) * lag;
        let bending = self.reversible_gain * fraction.derivative;
        [
            lag * q_squared + (bending * wall).alone(),
            wall * (q_squared - self.coupled(fraction, magnetization)),
        ]
    }

    /// dM/dH with δ̂ = 1, from a curve already evaluated.
    #[inline(always)]
    pub fn slope_from(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        let [rise, run] = self.ratio_from(fraction, magnetization);
        rise / run
    }

    /// dM/dH with δ̂ = 0.
    #[inline(always)]
    pub fn reversible_slope(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        let bending = (self.reversible_gain * fraction.derivative).alone();
        bending / (fraction.denominator * fraction.denominator - self.coupled(fraction, magnetization))
    }

    /// α·r.
    #[inline(always)]
    fn coupled(&self, fraction: &Fraction<N>, magnetization: N) -> N {
        // The constants first: B is what is waited for.
        (self.tangent(magnetization) * self.reversible_gain) * fraction.derivative
    }

    /// Numerator and denominator of dM/dH with δ̂ = 1: who needs dH/dM divides once.
    #[inline(always)]
    pub fn ratio(&self, field: N, magnetization: N) -> [N; 2] {
        self.ratio_from(&self.curve(field, magnetization), magnetization)
    }

    /// dM/dH with δ̂ = 1.
    #[inline(always)]
    pub fn slope(&self, field: N, magnetization: N) -> N {
        self.slope_from(&self.curve(field, magnetization), magnetization)
    }

    /// dM/dH with δ̂ = 1 at a field and at M = `magnetization` + `step`·`slope`; what does not wait for the slope is worked out apart.
    #[inline(always)]
    fn slope_along(&self, field: N, magnetization: N, step: N, slope: N) -> N {
        let reached = magnetization + step * slope;
        let known = (field + self.coupling * magnetization) * self.inverse_shape;
        let linear = known + (step * (self.coupling * self.inverse_shape)) * slope;
        let argument = if CUBIC {
            let cubic = self.triple_cubic * N::splat(1.0 / 3.0);
            linear + cubic * (reached * reached * reached) * self.inverse_shape
        } else {
            linear
        };
        self.slope_from(&C::fraction(argument), reached)
    }

    /// After a field step: M, and its mean over the step from the same slopes, M + (h/6)(k₁ + k₂ + k₃), fourth order.
    #[inline(always)]
    pub fn step(&self, from: Point<N>, step: N) -> (N, N) {
        let Point {
            field,
            magnetization,
            slope: first,
        } = from;
        let half = N::splat(0.5) * step;
        let middle = field + half;
        let second = self.slope_along(middle, magnetization, half, first);
        let third = self.slope_along(middle, magnetization, half, second);
        let fourth = self.slope_along(field + step, magnetization, step, third);
        let sum = (first + fourth) + N::splat(2.0) * (second + third);
        let sixth = step * N::splat(1.0 / 6.0);
        (
            magnetization + sixth * sum,
            magnetization + sixth * (first + second + third),
        )
    }
}
