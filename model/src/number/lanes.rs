//! `WIDTH` numbers side by side, worked on together; selects stand in place of branches.

use std::ops::{Add, Div, Mul, Sub};

use super::Number;

/// `WIDTH` numbers that are always worked on together.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Lanes<const WIDTH: usize>(pub [f64; WIDTH]);

impl<const WIDTH: usize> Lanes<WIDTH> {
    #[inline(always)]
    pub fn load(slice: &[f64]) -> Self {
        let mut lanes = [0.0; WIDTH];
        lanes.copy_from_slice(&slice[..WIDTH]);
        Lanes(lanes)
    }

    #[inline(always)]
    pub fn store(self, slice: &mut [f64]) {
        slice[..WIDTH].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn zip(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        let mut lanes = self.0;
        for (lane, &with) in lanes.iter_mut().zip(&other.0) {
            *lane = operation(*lane, with);
        }
        Lanes(lanes)
    }
}

macro_rules! lane_operator {
    ($operator:ident, $method:ident) => {
        impl<const WIDTH: usize> $operator for Lanes<WIDTH> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |left, right| left.$method(right))
            }
        }
    };
}
lane_operator!(Add, add);
lane_operator!(Sub, sub);
lane_operator!(Mul, mul);
lane_operator!(Div, div);

impl<const WIDTH: usize> Number for Lanes<WIDTH> {
    const SIDE_BY_SIDE: bool = true;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Lanes([value; WIDTH])
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.zip(self, |lane, _| f64::abs(lane))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, <f64 as Number>::max)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, <f64 as Number>::min)
    }
    #[inline(always)]
    fn where_greater(self, limit: Self, yes: Self, no: Self) -> Self {
        let mut lanes = [0.0; WIDTH];
        for (index, lane) in lanes.iter_mut().enumerate() {
            *lane = if self.0[index] > limit.0[index] {
                yes.0[index]
            } else {
                no.0[index]
            };
        }
        Lanes(lanes)
    }
    #[inline(always)]
    fn where_within(self, low: Self, high: Self, other: Self) -> Self {
        let mut lanes = [0.0; WIDTH];
        for (index, lane) in lanes.iter_mut().enumerate() {
            let within = (self.0[index] >= low.0[index]) & (self.0[index] <= high.0[index]);
            *lane = if within { self.0[index] } else { other.0[index] };
        }
        Lanes(lanes)
    }
    #[inline(always)]
    fn atanh(self) -> Self {
        Lanes(self.0.map(libm::atanh))
    }
    /// Halves compared side by side, so that it takes few dependent operations.
    #[inline(always)]
    fn largest(self) -> f64 {
        let mut lanes = self.0;
        let mut half = WIDTH / 2;
        while half > 0 {
            let mut lane = 0;
            while lane < half {
                let (one, other) = (lanes[lane], lanes[lane + half]);
                lanes[lane] = if one > other { one } else { other };
                lane += 1;
            }
            half /= 2;
        }
        lanes[0]
    }
}
