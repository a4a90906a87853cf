//! Numbers that the equations are written in: one `f64`, [`lanes::Lanes`] side by side, or one with its derivatives ([`dual::Dual`]).
//!
//! The equations exist once and are generic over [`Number`]: a single model uses `f64`, a bank lanes, sensitivities dual
//! numbers. Every operation is an IEEE basic operation in a fixed order, and no fused multiply-add is used, so scalar,
//! AVX2 and AVX-512 code give the same bits.

pub(crate) mod dual;
pub(crate) mod lanes;
pub(crate) mod single;

use std::ops::{Add, Div, Mul, Sub};

pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Many side by side, of which some go on while others wait: what counts is the number of operations, not how long they depend.
    const SIDE_BY_SIDE: bool = false;
    fn splat(value: f64) -> Self;
    /// The same bits, of one operation that goes on alone: where a single number is what is waited for, the compiler would put it into one
    /// register with its neighbours, and every shuffle that takes makes the wait longer.
    #[inline(always)]
    fn alone(self) -> Self {
        self
    }
    fn abs(self) -> Self;
    /// The larger of the two where they compare, else `other`.
    fn max(self, other: Self) -> Self;
    /// The smaller of the two where they compare, else `other`.
    fn min(self, other: Self) -> Self;
    /// `yes` where `self > limit`, else `no`.
    fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self;
    /// `self` where `low ≤ self ≤ high`, else `other`.
    fn where_within(self, low: Self, high: Self, other: Self) -> Self;
    /// Inverse hyperbolic tangent.
    fn atanh(self) -> Self;
    /// The largest of its values.
    fn largest(self) -> f64;
}

impl Number for f64 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn alone(mut self) -> Self {
        // SAFETY: no instruction stands there.
        unsafe {
            std::arch::asm!("/* {0} */", inout(xmm_reg) self, options(pure, nomem, nostack, preserves_flags));
        }
        self
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self {
        if self > limit { yes } else { no }
    }
    #[inline(always)]
    fn where_within(self, low: Self, high: Self, other: Self) -> Self {
        if self >= low && self <= high { self } else { other }
    }
    #[inline(always)]
    fn atanh(self) -> Self {
        libm::atanh(self)
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self
    }
}
