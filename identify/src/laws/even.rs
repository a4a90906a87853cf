//! Strain over a hysteresis law: y = y₀ + γ₁m² + γ₂m⁴, m the law's output without its zero.
//!
//! A magnetostrictive strain is no hysteresis of the field but an even function of the magnetization, which is. Where the
//! magnetization was measured beside the strain, the law is fitted to that, and the three numbers to the strain along the law's free run;
//! what is kept back is kept back from both.
//! Source: the paper's (8) and its next even term.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// y₀, γ₁, γ₂.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvenCurve {
    pub zero: f64,
    pub square: f64,
    pub fourth: f64,
}

/// How many numbers a curve is.
pub(super) const NUMBERS: usize = 3;

impl EvenCurve {
    /// At an output of the law whose zero is `zero`.
    pub fn at(&self, output: f64, zero: f64) -> f64 {
        let square = (output - zero).powi(2);
        self.zero + self.square * square + self.fourth * square * square
    }

    /// By least squares over pairs (output of the law, measured).
    pub(super) fn fitted(pairs: &[(f64, f64)], zero: f64) -> Option<Self> {
        let scale = pairs
            .iter()
            .map(|(output, _)| (output - zero).abs())
            .fold(0.0, f64::max);
        let row = |output: f64| {
            let square = ((output - zero) / scale).powi(2);
            [1.0, square, square * square]
        };
        let design = DMatrix::from_fn(pairs.len(), NUMBERS, |i, j| row(pairs[i].0)[j]);
        let measured = DVector::from_iterator(pairs.len(), pairs.iter().map(|(_, measured)| *measured));
        let found = design.svd(true, true).solve(&measured, 1e-12).ok()?;
        let square = scale * scale;
        let own = EvenCurve {
            zero: found[0],
            square: found[1] / square,
            fourth: found[2] / (square * square),
        };
        [own.zero, own.square, own.fourth]
            .iter()
            .all(|number| number.is_finite())
            .then_some(own)
    }
}
