//! One harmonic of what repeats: its way through the loop and its amplitudes.

use super::way::Way;
use crate::complex::Complex;
use serde::{Deserialize, Serialize};

/// One harmonic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Harmonic {
    pub way: Way,
    /// C, the one before it, and that of the best cycle.
    pub amplitude_m: Complex,
    pub before_m: Complex,
    pub best_m: Complex,
    /// Σ w·e·e^{−jnθ}.
    pub sum_m: Complex,
    /// E of the cycle before, while nothing is learned yet.
    pub heard_m: Complex,
    pub gain: f64,
}

impl Harmonic {
    pub fn move_to(&mut self, wanted_m: Complex, limit_m: f64) {
        let size_m = wanted_m.magnitude();
        let new_m = if size_m > limit_m {
            wanted_m.scaled(limit_m / size_m)
        } else {
            wanted_m
        };
        self.way.changed(new_m.minus(self.amplitude_m));
        self.amplitude_m = new_m;
    }
}
