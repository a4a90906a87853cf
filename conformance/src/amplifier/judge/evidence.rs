//! What a run gave, and what every judge takes from it.

use crate::amplifier::expectation::Expectation;
use crate::amplifier::program::{Part, Program};
use crate::amplifier::transcript::{Aftermath, End, Transcript};
use anhyst_model::AmplifierOutput;

/// What a run gave, beside what was expected.
pub struct Evidence<'a> {
    /// What is expected.
    pub expected: &'a Expectation,
    /// What was commanded.
    pub program: &'a Program,
    /// What the model answers to it.
    pub model: &'a [AmplifierOutput],
    /// What the process answered.
    pub transcript: &'a Transcript,
    /// What came after the commands had ended; none if the program did not get there.
    pub aftermath: Option<&'a Aftermath>,
}

/// Gain, offset and noise, found on constant commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Levels {
    pub gain: f64,
    pub offset_a_per_m: f64,
    pub noise_a_per_m: f64,
}

pub(super) const NOT_REACHED: &str = "the process did not answer so far";
pub(super) const STUCK: &str = "the answer does not follow the command at all";

impl Evidence<'_> {
    /// The answers of the judged ticks of every stretch of a kind, A/m; none if one of them was not reached.
    pub(super) fn judged(&self, part: Part) -> Option<Vec<Vec<f64>>> {
        self.program
            .of(part)
            .map(|segment| self.transcript.fields(&segment.judged))
            .collect()
    }

    /// Why the program did not reach its end.
    pub(super) fn unreached(&self) -> String {
        match &self.transcript.end {
            End::Silent(words) | End::Gone(words) => format!("{NOT_REACHED}: {words}"),
            End::Stopped => "stopped on request".into(),
            End::Complete => NOT_REACHED.into(),
        }
    }
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Root mean square about the mean.
pub(super) fn rms(values: &[f64]) -> f64 {
    let middle = mean(values);
    let squares: Vec<f64> = values.iter().map(|value| (value - middle) * (value - middle)).collect();
    mean(&squares).sqrt()
}

pub(super) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    // A value that is no number is the largest of all: a fold with `max` would pass over it.
    values.into_iter().fold(0.0, |most, value| {
        if value.is_nan() || most.is_nan() {
            f64::NAN
        } else {
            most.max(value)
        }
    })
}
