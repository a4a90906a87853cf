//! Complex numbers with what a loop needs, in operations that have the same bits everywhere.

use serde::{Deserialize, Serialize};

/// A complex number, with what is needed here.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Complex {
    pub re: f64,
    pub im: f64,
}

impl Complex {
    pub const ZERO: Self = Self { re: 0.0, im: 0.0 };

    pub fn real(re: f64) -> Self {
        Self { re, im: 0.0 }
    }

    pub fn unit(angle: f64) -> Self {
        let (im, re) = libm::sincos(angle);
        Self { re, im }
    }

    pub fn plus(self, other: Self) -> Self {
        Self {
            re: self.re + other.re,
            im: self.im + other.im,
        }
    }

    pub fn minus(self, other: Self) -> Self {
        self.plus(other.scaled(-1.0))
    }

    pub fn conjugate(self) -> Self {
        Self {
            re: self.re,
            im: -self.im,
        }
    }

    /// |z|².
    pub fn square(self) -> f64 {
        self.re * self.re + self.im * self.im
    }

    pub fn scaled(self, factor: f64) -> Self {
        Self {
            re: self.re * factor,
            im: self.im * factor,
        }
    }

    pub fn times(self, other: Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    pub fn over(self, other: Self) -> Self {
        let square = other.square();
        self.times(Self {
            re: other.re / square,
            im: -other.im / square,
        })
    }

    pub fn magnitude(self) -> f64 {
        libm::hypot(self.re, self.im)
    }
}
