//! Numbers side by side, worked on together; selects stand in place of branches.
//!
//! In pairs of pairs of registers, and not in arrays: the compiler would unroll a loop for every operation and then look for what goes
//! into one instruction, and need longer for that than for all other code here.

use std::ops::{Add, Div, Mul, Sub};

use super::Number;

/// Two that are always worked on together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<N>(N, N);

/// Two, four and eight.
pub(crate) type Two<N> = Pair<N>;
pub(crate) type Four<N> = Pair<Two<N>>;
pub(crate) type Eight<N> = Pair<Four<N>>;
pub(crate) type Sixteen<N> = Pair<Eight<N>>;
pub(crate) type ThirtyTwo<N> = Pair<Sixteen<N>>;

/// Numbers that lie side by side in a slice.
pub(crate) trait Lanes: Number {
    const WIDTH: usize;
    /// The first of a slice.
    fn load(slice: &[f64]) -> Self;
    fn store(self, slice: &mut [f64]);
}

impl Lanes for f64 {
    const WIDTH: usize = 1;
    #[inline(always)]
    fn load(slice: &[f64]) -> Self {
        slice[0]
    }
    #[inline(always)]
    fn store(self, slice: &mut [f64]) {
        slice[0] = self;
    }
}

impl<N: Lanes> Lanes for Pair<N> {
    const WIDTH: usize = 2 * N::WIDTH;
    #[inline(always)]
    fn load(slice: &[f64]) -> Self {
        let (one, other) = slice[..Self::WIDTH].split_at(N::WIDTH);
        Pair(N::load(one), N::load(other))
    }
    #[inline(always)]
    fn store(self, slice: &mut [f64]) {
        let (one, other) = slice[..Self::WIDTH].split_at_mut(N::WIDTH);
        self.0.store(one);
        self.1.store(other);
    }
}

macro_rules! pair_operator {
    ($operator:ident, $method:ident) => {
        impl<N: $operator<Output = N>> $operator for Pair<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Pair(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}
pair_operator!(Add, add);
pair_operator!(Sub, sub);
pair_operator!(Mul, mul);
pair_operator!(Div, div);

impl<N: Number> Number for Pair<N> {
    const SIDE_BY_SIDE: bool = true;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Pair(N::splat(value), N::splat(value))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Pair(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Pair(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self {
        Pair(
            self.0.where_greater(limit.0, yes.0, no.0),
            self.1.where_greater(limit.1, yes.1, no.1),
        )
    }
    #[inline(always)]
    fn where_within(self, low: Self, high: Self, other: Self) -> Self {
        Pair(
            self.0.where_within(low.0, high.0, other.0),
            self.1.where_within(low.1, high.1, other.1),
        )
    }
    #[inline(always)]
    fn atanh(self) -> Self {
        Pair(self.0.atanh(), self.1.atanh())
    }
    /// Halves compared side by side, so that it takes few dependent operations.
    #[inline(always)]
    fn largest(self) -> f64 {
        self.0.max(self.1).largest()
    }
}

/// A register of `x86_64`. `max` and `min` give the second number where two do not compare, as they do in [`Number`].
#[cfg(target_arch = "x86_64")]
macro_rules! register {
    ($name:ident, $register:ident, $width:literal, $instructions:literal, $splat:ident, $load:ident, $store:ident,
     $(operators: $operator:ident $method:ident $by:ident;)*
     $(pairs: $pair:ident $pair_by:ident;)*
     abs: |$number:ident| $abs:expr;
     largest: |$of:ident| $largest:expr;
     greater: |$one:ident, $other:ident| $greater:expr;
     least: |$high:ident, $low:ident| $least:expr;
     and: |$left:ident, $right:ident| $and:expr;
     select: |$mask:ident, $yes:ident, $no:ident| $select:expr;) => {
        #[doc = concat!("Numbers in a register of ", $instructions, ".")]
        ///
        /// SAFETY, of all that is unsafe here: only functions that require these instructions name the type (`bank_step.rs`).
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct $name($register);

        $(impl $operator for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                $name(unsafe { $by(self.0, other.0) })
            }
        })*

        impl Lanes for $name {
            const WIDTH: usize = $width;
            #[inline(always)]
            fn load(slice: &[f64]) -> Self {
                $name(unsafe { $load(slice[..$width].as_ptr()) })
            }
            #[inline(always)]
            fn store(self, slice: &mut [f64]) {
                unsafe { $store(slice[..$width].as_mut_ptr(), self.0) }
            }
        }

        impl Number for $name {
            const SIDE_BY_SIDE: bool = true;
            #[inline(always)]
            fn splat(value: f64) -> Self {
                $name(unsafe { $splat(value) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                let $number = self.0;
                $name(unsafe { $abs })
            }
            $(#[inline(always)]
            fn $pair(self, other: Self) -> Self {
                $name(unsafe { $pair_by(self.0, other.0) })
            })*
            #[inline(always)]
            fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self {
                let ($one, $other, $yes, $no) = (self.0, limit.0, yes.0, no.0);
                $name(unsafe {
                    let $mask = $greater;
                    $select
                })
            }
            #[inline(always)]
            fn where_within(self, low: Self, high: Self, other: Self) -> Self {
                let ($yes, $no) = (self.0, other.0);
                $name(unsafe {
                    let ($high, $low) = (self.0, low.0);
                    let $left = $least;
                    let ($high, $low) = (high.0, self.0);
                    let $right = $least;
                    let $mask = $and;
                    $select
                })
            }
            #[inline(always)]
            fn atanh(self) -> Self {
                let mut numbers = [0.0; $width];
                self.store(&mut numbers);
                Self::load(&numbers.map(libm::atanh))
            }
            #[inline(always)]
            fn largest(self) -> f64 {
                let $of = self.0;
                unsafe { $largest }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
pub(crate) use registers::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod registers {
    use super::{Lanes, Number};
    use std::arch::x86_64::*;
    use std::ops::{Add, Div, Mul, Sub};

    /// # Safety
    /// As of the registers.
    #[inline(always)]
    unsafe fn largest_of_four(numbers: __m256d) -> f64 {
        // SAFETY: of the caller.
        unsafe {
            let two = _mm_max_pd(_mm256_castpd256_pd128(numbers), _mm256_extractf128_pd::<1>(numbers));
            _mm_cvtsd_f64(_mm_max_sd(two, _mm_unpackhi_pd(two, two)))
        }
    }

    register!(Avx2, __m256d, 4, "AVX2", _mm256_set1_pd, _mm256_loadu_pd, _mm256_storeu_pd,
        operators: Add add _mm256_add_pd;
        operators: Sub sub _mm256_sub_pd;
        operators: Mul mul _mm256_mul_pd;
        operators: Div div _mm256_div_pd;
        pairs: max _mm256_max_pd;
        pairs: min _mm256_min_pd;
        abs: |number| _mm256_andnot_pd(_mm256_set1_pd(-0.0), number);
        largest: |of| largest_of_four(of);
        greater: |one, other| _mm256_cmp_pd::<_CMP_GT_OQ>(one, other);
        least: |high, low| _mm256_cmp_pd::<_CMP_GE_OQ>(high, low);
        and: |left, right| _mm256_and_pd(left, right);
        select: |mask, yes, no| _mm256_blendv_pd(no, yes, mask););
    register!(Avx512, __m512d, 8, "AVX-512", _mm512_set1_pd, _mm512_loadu_pd, _mm512_storeu_pd,
        operators: Add add _mm512_add_pd;
        operators: Sub sub _mm512_sub_pd;
        operators: Mul mul _mm512_mul_pd;
        operators: Div div _mm512_div_pd;
        pairs: max _mm512_max_pd;
        pairs: min _mm512_min_pd;
        abs: |number| _mm512_abs_pd(number);
        largest: |of| largest_of_four(_mm256_max_pd(_mm512_castpd512_pd256(of), _mm512_extractf64x4_pd::<1>(of)));
        greater: |one, other| _mm512_cmp_pd_mask::<_CMP_GT_OQ>(one, other);
        least: |high, low| _mm512_cmp_pd_mask::<_CMP_GE_OQ>(high, low);
        and: |left, right| left & right;
        select: |mask, yes, no| _mm512_mask_blend_pd(mask, no, yes););
}
