//! y ← min(max(y, u − w), u + w): the play operator, a dead band of half width w that the output is dragged through.
//!
//! u measured field, y field for the models, w half width (all A/m). A rate-independent model takes every sign change of a noisy
//! dH for a reversal and ratchets; through a play of about three standard deviations noise makes no reversals.
//! The price is a lag of up to w after a true reversal. The stop/play pair is Prandtl's; the paper has a noise-free field.

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require_not_negative};

/// Play with its output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Play {
    half_width: f64,
    output: f64,
}

impl Play {
    /// `half_width` in the unit of the input, 0 = straight through; the output starts at 0.
    pub fn new(half_width: f64) -> Result<Self, ModelError> {
        require_not_negative(half_width, "half width of the play", "(unit of its input)")?;
        Ok(Play {
            half_width,
            output: 0.0,
        })
    }

    /// The same play with its output at rest there, in the middle of the dead band.
    pub fn resting_at(self, output: f64) -> Self {
        Play { output, ..self }
    }

    /// Drags the output along with the input and returns it; a NaN input leaves it where it is.
    pub fn follow(&mut self, input: f64) -> f64 {
        if input - self.half_width > self.output {
            self.output = input - self.half_width;
        } else if input + self.half_width < self.output {
            self.output = input + self.half_width;
        }
        self.output
    }

    pub fn output(&self) -> f64 {
        self.output
    }

    pub fn half_width(&self) -> f64 {
        self.half_width
    }
}
