//! A function's value and its first four time derivatives, as one number: (f·g)ⁿ = Σ C(n, i)·fⁱ·gⁿ⁻ⁱ (Leibniz).

use anhyst_model::turn::sine_and_cosine;
use std::f64::consts::TAU;

/// Value and derivatives of order 1 to 4, each per second more.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Jet(pub [f64; 5]);

const BINOMIAL: [[f64; 5]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0],
];

impl Jet {
    pub fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0, 0.0, 0.0])
    }

    /// From derivatives with respect to s, where t = `scale_s`·s.
    pub fn from_scaled(derivatives: [f64; 5], scale_s: f64) -> Self {
        let mut jet = derivatives;
        let mut power = 1.0;
        for derivative in &mut jet {
            *derivative /= power;
            power *= scale_s;
        }
        Self(jet)
    }

    pub fn scaled(self, factor: f64) -> Self {
        Self(self.0.map(|value| value * factor))
    }

    pub fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|n| self.0[n] + other.0[n]))
    }

    /// The sine of so many turns (Faà di Bruno).
    pub fn sine_of_turns(self) -> Self {
        let (sine, cosine) = sine_and_cosine(self.0[0]);
        let Self([_, a, b, c, d]) = self.scaled(TAU);
        Self([
            sine,
            cosine * a,
            cosine * b - sine * a * a,
            cosine * (c - a * a * a) - 3.0 * sine * a * b,
            cosine * (d - 6.0 * a * a * b) + sine * (a * a * a * a - 3.0 * b * b - 4.0 * a * c),
        ])
    }

    pub fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|n| {
            (0..=n).map(|i| BINOMIAL[n][i] * self.0[i] * other.0[n - i]).sum()
        }))
    }
}
