//! The error between the samples: half a tick before each, where a rod that rings within a tick shows it.

use crate::any_number;
use crate::any_number::exceeds;
use serde::{Deserialize, Serialize};

/// Reference minus true displacement half a tick before each judged sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorBetween {
    /// Root mean square.
    #[serde(with = "any_number")]
    pub rms_m: f64,
    /// Largest.
    #[serde(with = "any_number")]
    pub max_m: f64,
    /// When it was.
    pub max_at_s: f64,
}

/// Its sums.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Between {
    samples: u64,
    #[serde(with = "any_number")]
    sum_of_squares_m2: f64,
    #[serde(with = "any_number")]
    max_m: f64,
    max_at_s: f64,
}

impl Between {
    /// Takes in the magnitude of an error.
    pub fn observe(&mut self, time_s: f64, error_m: f64) {
        self.samples += 1;
        self.sum_of_squares_m2 += error_m * error_m;
        if exceeds(error_m, self.max_m) {
            (self.max_m, self.max_at_s) = (error_m, time_s);
        }
    }

    /// What came of it; none if there was nothing to see.
    pub fn error(&self) -> Option<ErrorBetween> {
        (self.samples > 0).then(|| ErrorBetween {
            rms_m: (self.sum_of_squares_m2 / self.samples as f64).sqrt(),
            max_m: self.max_m,
            max_at_s: self.max_at_s,
        })
    }
}
