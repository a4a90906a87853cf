//! Numbers that carry derivatives: x + Σ x_i ε_i with ε_i ε_j = 0, so that every formula differentiates itself.
//!
//! The arithmetic is that of `num-dual`, with one exception: its quotient multiplies by 1/y, which may differ from x/y
//! in the last bit; here the value is x/y, so that a computation with dual numbers gives the same values as one with
//! `f64`. A constant has no derivatives at all (not zeros): products with it cost nothing more.

use std::ops::{Add, Div, Mul, Sub};

use nalgebra::SVector;
use num_dual::{Derivative, DualSVec64};

use super::{Number, Single};
use crate::curve::{Curve, Fraction, Kernel};

/// A value and its derivatives by `SIZE` quantities.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual<const SIZE: usize>(DualSVec64<SIZE>);

impl<const SIZE: usize> Dual<SIZE> {
    #[inline(always)]
    pub fn new(value: f64, derivatives: [f64; SIZE]) -> Self {
        Dual(DualSVec64::new(value, Derivative::some(SVector::from(derivatives))))
    }

    /// The quantity number `index` itself.
    #[inline(always)]
    pub fn variable(value: f64, index: usize) -> Self {
        let mut derivatives = [0.0; SIZE];
        derivatives[index] = 1.0;
        Dual::new(value, derivatives)
    }

    #[inline(always)]
    pub fn derivatives(self) -> [f64; SIZE] {
        self.0.eps.0.map_or([0.0; SIZE], |vector| vector.data.0[0])
    }

    /// The same derivatives with a value computed elsewhere.
    #[inline(always)]
    fn with_value(self, value: f64) -> Self {
        Dual(DualSVec64::new(value, self.0.eps))
    }

    /// A function of one number by the chain rule: its value and its derivative at `self`.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Dual(DualSVec64::new(value, self.0.eps * slope))
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

macro_rules! dual_operator {
    ($operator:ident, $method:ident) => {
        impl<const SIZE: usize> $operator for Dual<SIZE> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Dual(self.0.$method(other.0))
            }
        }
    };
}
dual_operator!(Add, add);
dual_operator!(Sub, sub);
dual_operator!(Mul, mul);

impl<const SIZE: usize> Div for Dual<SIZE> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.0.re / other.0.re;
        if other.0.eps.0.is_none() {
            return self.chain(value, 1.0 / other.0.re);
        }
        Dual(self.0 / other.0).with_value(value)
    }
}

impl<const SIZE: usize> Number for Dual<SIZE> {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Dual(DualSVec64::new(value, Derivative::none()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        if self.value() < 0.0 {
            Dual(-self.0)
        } else {
            self.with_value(f64::abs(self.value()))
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.value() > other.value() { self } else { other }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.value() < other.value() { self } else { other }
    }
    #[inline(always)]
    fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self {
        if self.value() > limit.value() { yes } else { no }
    }
    #[inline(always)]
    fn where_within(self, low: Self, high: Self, other: Self) -> Self {
        let value = self.value();
        if value >= low.value() && value <= high.value() {
            self
        } else {
            other
        }
    }
    #[inline(always)]
    fn atanh(self) -> Self {
        let value = self.value();
        self.chain(libm::atanh(value), 1.0 / ((1.0 - value) * (1.0 + value)))
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.value()
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
