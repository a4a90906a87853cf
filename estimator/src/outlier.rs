//! |y − f(u, θ̂)| > ν: a measurement that this rod cannot have given is left out.
//!
//! y measured displacement, f(u, θ̂) the displacement that the models predict at the estimate, ν the bound (m). One spike of
//! a sensor would otherwise move the estimate in the very tick in which the guard notices it, and in the ticks after through the
//! law's filter. After so many outliers in a row it is the prediction that is not believed: whatever has changed, the law must see it.
//! Assumption: healthy innovations stay below ν. Source: innovation gating of Kalman filters (Bar-Shalom, Li, Kirubarajan
//! 2001), with a bound instead of a covariance, because a min-max law has none.

use serde::{Deserialize, Serialize};

/// Looks at one measurement a tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OutlierTest {
    innovation_limit_m: f64,
    most_in_a_row: u64,
    in_a_row: u64,
}

impl OutlierTest {
    /// A test that has seen nothing.
    pub fn new(innovation_limit_m: f64, at_most_s: f64, tick_s: f64) -> Self {
        Self {
            innovation_limit_m,
            // The cast saturates: a time of years is for ever.
            most_in_a_row: libm::round(at_most_s / tick_s) as u64,
            in_a_row: 0,
        }
    }

    /// Whether this measurement is to be left out. What is no number has its own rule, and counts for neither side.
    pub fn leaves_out(&mut self, measured_m: f64, predicted_m: f64) -> bool {
        if !measured_m.is_finite() {
            return false;
        }
        if (measured_m - predicted_m).abs() <= self.innovation_limit_m {
            self.in_a_row = 0;
            return false;
        }
        self.in_a_row = self.in_a_row.saturating_add(1);
        self.in_a_row <= self.most_in_a_row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the bound itself, both signs, and that a fault of the model does not hold the estimate for ever.
    #[test]
    fn a_few_are_left_out_and_many_are_believed() {
        // Powers of two, so that the bound is met to the bit.
        let mut test = OutlierTest::new(0.5, 1.5e-4, 5e-5);
        assert!(!test.leaves_out(1.5, 1.0) && !test.leaves_out(-1.5, -1.0));
        assert!(test.leaves_out(1.51, 1.0) && test.leaves_out(-1.51, -1.0) && test.leaves_out(1e300, 0.0));
        assert!(!test.leaves_out(2.0, 0.0) && !test.leaves_out(2.0, 0.0));
        // One that fits ends the row; what is no number neither ends nor lengthens it.
        assert!(!test.leaves_out(0.0, 0.0) && test.leaves_out(2.0, 0.0));
        assert!(!test.leaves_out(f64::NAN, 0.0) && test.leaves_out(2.0, 0.0) && test.leaves_out(2.0, 0.0));
        assert!(!test.leaves_out(2.0, 0.0));
    }
}
