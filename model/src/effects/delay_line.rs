//! The last samples of a signal, by age in ticks.

use serde::{Deserialize, Serialize};

use crate::ModelError;
use crate::error::require;

/// More samples than this are not kept; it is 0.05 s at 2 MHz.
const MAX_SAMPLES: f64 = 1e5;

/// Ring of samples; allocates when made and never again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DelayLine {
    samples: Vec<f64>,
    newest: usize,
}

impl DelayLine {
    /// For ages up to `oldest_ticks`, and a few more for interpolation.
    pub fn new(oldest_ticks: f64) -> Result<Self, ModelError> {
        let short = (0.0..=MAX_SAMPLES).contains(&oldest_ticks);
        require(
            short,
            "a delay",
            oldest_ticks,
            "ticks",
            "at least 0 and at most 100000 ticks",
        )?;
        Ok(DelayLine {
            samples: vec![0.0; oldest_ticks as usize + 4],
            newest: 0,
        })
    }

    pub fn fill(&mut self, sample: f64) {
        self.samples.fill(sample);
    }

    #[inline]
    pub fn push(&mut self, sample: f64) {
        self.newest = if self.newest == 0 {
            self.samples.len() - 1
        } else {
            self.newest - 1
        };
        self.samples[self.newest] = sample;
    }

    /// The sample of `age` ticks ago, 0 being the newest.
    #[inline]
    pub fn sample(&self, age: usize) -> f64 {
        let index = self.newest + age;
        let length = self.samples.len();
        self.samples[if index < length { index } else { index - length }]
    }
}
