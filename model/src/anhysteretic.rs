//! Man/Ms = L(x) = coth x − 1/x (Langevin, the paper's (1)) or tanh x (Ising, (2)), with x = He/a.
//!
//! He = H + αM effective field (A/m), a shape parameter (A/m); both x and the value are numbers without unit.
//! Near zero L is x/3 and tanh is x: with the same `a` the two curves differ by a factor 3 in slope,
//! so a value of `a` belongs to its curve.
//! Assumption: constant stress, so that thermal and magnetic energies alone are balanced.

use serde::{Deserialize, Serialize};

use crate::curve::{IsingEverywhere, LangevinByRange};
use crate::kernel::{Curve, Fraction};

/// Which anhysteretic curve the material follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Anhysteretic {
    /// coth x − 1/x: dipoles of any orientation.
    Langevin,
    /// tanh x: dipoles along one axis.
    Ising,
}

impl Anhysteretic {
    #[inline]
    fn fraction(self, x: f64) -> Fraction<f64> {
        match self {
            Anhysteretic::Langevin => LangevinByRange::fraction(x),
            Anhysteretic::Ising => IsingEverywhere::fraction(x),
        }
    }

    /// The curve at x = He/a, in [−1, 1]; relative error below 1e-15.
    #[inline]
    pub fn value(self, x: f64) -> f64 {
        let Fraction {
            x,
            numerator,
            denominator,
            ..
        } = self.fraction(x);
        x * numerator / denominator
    }

    /// Derivative of the curve with respect to x; absolute error below 1e-15.
    #[inline]
    pub fn derivative(self, x: f64) -> f64 {
        self.value_and_derivative(x).1
    }

    /// Value and derivative from one evaluation.
    #[inline]
    pub fn value_and_derivative(self, x: f64) -> (f64, f64) {
        let Fraction {
            x,
            numerator,
            denominator,
            derivative,
        } = self.fraction(x);
        (x * numerator / denominator, derivative / (denominator * denominator))
    }

    /// Derivative at x = 0, its largest value: 1/3 or 1.
    #[inline]
    pub fn initial_slope(self) -> f64 {
        match self {
            Anhysteretic::Langevin => 1.0 / 3.0,
            Anhysteretic::Ising => 1.0,
        }
    }

    /// The x at which the curve has the value y; ±∞ for |y| ≥ 1, NaN for NaN.
    pub fn inverse(self, y: f64) -> f64 {
        if y >= 1.0 {
            return f64::INFINITY;
        }
        if y <= -1.0 {
            return f64::NEG_INFINITY;
        }
        if y.is_nan() {
            return y;
        }
        match self {
            Anhysteretic::Langevin => LangevinByRange::inverse(y),
            Anhysteretic::Ising => IsingEverywhere::inverse(y),
        }
    }
}
