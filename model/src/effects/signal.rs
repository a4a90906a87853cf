//! y_k = f(state, x_k): an effect with one number in and one out a tick.
//!
//! Between samples x is a straight line. The first sample counts as having stood there for ever: lags and delays begin
//! settled, temperatures at ambient, clocks at 0.

use crate::ModelError;

/// Its type is known where it is stepped, so a run costs no dispatch within a sample.
pub(crate) trait Signal: Sized {
    /// From the effect's values and the tick; an infinite tick is a sweep too slow for any memory of time.
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError>;

    /// Takes the first sample.
    fn steady_state(&mut self, input: f64) -> f64;

    /// Takes a sample one tick after the last.
    fn step(&mut self, input: f64) -> f64;
}
