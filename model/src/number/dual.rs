//! Numbers that carry derivatives: x + Σ x_i ε_i with ε_i ε_j = 0, so that every formula differentiates itself.
//!
//! The arithmetic is that of `num-dual`, with one exception: its quotient multiplies by 1/y, which may differ from x/y
//! in the last bit; here the value is x/y, so that a computation with dual numbers gives the same values as one with
//! `f64`. A constant has no derivatives at all (not zeros): products with it cost nothing more.

use std::ops::{Add, Div, Mul, Sub};

use nalgebra::SVector;
use num_dual::{Derivative, DualSVec64};

use super::Number;

/// A value and its derivatives by `SIZE` quantities.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual<const SIZE: usize>(pub(super) DualSVec64<SIZE>);

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
    pub fn with_value(self, value: f64) -> Self {
        Dual(DualSVec64::new(value, self.0.eps))
    }

    /// A function of one number by the chain rule: its value and its derivative at `self`.
    #[inline(always)]
    pub fn chain(self, value: f64, slope: f64) -> Self {
        Dual(DualSVec64::new(value, self.0.eps * slope))
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
        if self.0.re < 0.0 {
            Dual(-self.0)
        } else {
            self.with_value(f64::abs(self.0.re))
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.0.re > other.0.re { self } else { other }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.0.re < other.0.re { self } else { other }
    }
    #[inline(always)]
    fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self {
        if self.0.re > limit.0.re { yes } else { no }
    }
    #[inline(always)]
    fn where_within(self, low: Self, high: Self, other: Self) -> Self {
        let value = self.0.re;
        if value >= low.0.re && value <= high.0.re {
            self
        } else {
            other
        }
    }
    #[inline(always)]
    fn atanh(self) -> Self {
        let value = self.0.re;
        self.chain(libm::atanh(value), 1.0 / ((1.0 - value) * (1.0 + value)))
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.0.re
    }
}
