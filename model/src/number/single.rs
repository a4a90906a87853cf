//! Numbers that are one number, with or without derivatives, and the kernels that belong to them.

use super::Number;
use super::dual::Dual;
use crate::kernel::{Curve, Fraction, Kernel};

/// A [`Number`] that is one number, so that it can steer a computation.
pub(crate) trait Single: Number {
    /// A curve's kernel for this number.
    type Of<C: Kernel>: Curve<Self>;
    fn value(self) -> f64;
    /// A value found by a computation that carries nothing, and where `derivation` has the same value, up to rounding, and
    /// what this number carries beside it. Not called where nothing is carried.
    fn carrying(value: f64, derivation: impl FnOnce() -> Self) -> Self;
}

impl Single for f64 {
    type Of<C: Kernel> = C;
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn carrying(value: f64, _: impl FnOnce() -> Self) -> Self {
        value
    }
}

impl<const SIZE: usize> Single for Dual<SIZE> {
    type Of<C: Kernel> = Chained<C>;
    #[inline(always)]
    fn carrying(value: f64, derivation: impl FnOnce() -> Self) -> Self {
        derivation().with_value(value)
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.0.re
    }
}

/// A curve whose kernel is differentiated by x alone; the chain rule brings in the other quantities.
pub(crate) struct Chained<C>(std::marker::PhantomData<C>);

impl<const SIZE: usize, C: Curve<Dual<1>>> Curve<Dual<SIZE>> for Chained<C> {
    #[inline(always)]
    fn fraction(x: Dual<SIZE>) -> Fraction<Dual<SIZE>> {
        let inner = C::fraction(Dual::variable(x.value(), 0));
        let of = |part: Dual<1>| x.chain(part.value(), part.derivatives()[0]);
        Fraction {
            x: of(inner.x),
            numerator: of(inner.numerator),
            denominator: of(inner.denominator),
            derivative: of(inner.derivative),
        }
    }
    #[inline(always)]
    fn inverse(y: Dual<SIZE>) -> Dual<SIZE> {
        let inner = C::inverse(Dual::variable(y.value(), 0));
        y.chain(inner.value(), inner.derivatives()[0])
    }
}

impl<N: Single> Fraction<N> {
    /// The same without what it carries.
    #[inline(always)]
    pub fn values(&self) -> Fraction<f64> {
        Fraction {
            x: self.x.value(),
            numerator: self.numerator.value(),
            denominator: self.denominator.value(),
            derivative: self.derivative.value(),
        }
    }
}
