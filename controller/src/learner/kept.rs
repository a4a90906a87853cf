//! What was learnt at a speed.

use super::harmonic::Harmonic;
use serde::{Deserialize, Serialize};

/// Harmonics end here, as a part of the sampling rate.
pub(crate) const HIGHEST: f64 = 0.1;
/// And this far from one it was at, what was learnt there holds.
const NEAR_SPEED: f64 = 1e-2;
pub(super) const KEPT_SPEEDS: usize = 8;

/// What was learnt at a speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Kept {
    pub turns_per_s: f64,
    pub harmonics: Vec<Harmonic>,
}

impl Kept {
    /// What was learnt here holds there.
    pub fn is_near(&self, turns_per_s: f64) -> bool {
        (self.turns_per_s / turns_per_s - 1.0).abs() < NEAR_SPEED
    }
}
