//! From commands and answers to findings. What follows from an earlier fault is not judged a second time: an answer that
//! does not move has no gain, and a gain in the wrong unit is not also called inexact.

mod constant;
mod dynamics;
mod faults;
mod limits;
mod timing;

pub use dynamics::{Response, StepResponse};

use super::expectation::Expectation;
use super::findings::Findings;
use super::program::{Part, Program};
use super::transcript::{Aftermath, End, Transcript};
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

/// What the pictures need beside the evidence.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curves {
    /// Mean of the small steps.
    pub step: Option<StepResponse>,
    /// Frequency response of the process and of the model.
    pub response: Vec<Response>,
}

/// Gain, offset and noise, found on constant commands.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Levels {
    gain: f64,
    offset_a_per_m: f64,
    noise_a_per_m: f64,
}

const NOT_REACHED: &str = "the process did not answer so far";
const STUCK: &str = "the answer does not follow the command at all";

/// Judges everything that can be judged.
pub fn judge(evidence: &Evidence) -> (Findings, Curves) {
    let mut findings = Findings::default();
    let mut curves = Curves::default();
    timing::judge(evidence, &mut findings);
    faults::finite(evidence, &mut findings);
    faults::stuck(evidence, &mut findings);
    let levels = constant::judge(evidence, &mut findings);
    curves.step = dynamics::step(evidence, levels, &mut findings);
    curves.response = dynamics::bandwidth(evidence, &mut findings);
    limits::judge(evidence, levels, &mut findings);
    faults::recovery(evidence, levels, &mut findings);
    faults::dead_controller(evidence, &mut findings);
    (findings, curves)
}

impl Evidence<'_> {
    /// The answers of the judged ticks of every stretch of a kind, A/m; none if one of them was not reached.
    fn judged(&self, part: Part) -> Option<Vec<Vec<f64>>> {
        self.program
            .of(part)
            .map(|segment| self.transcript.fields(&segment.judged))
            .collect()
    }

    /// Why the program did not reach its end.
    fn unreached(&self) -> String {
        match &self.transcript.end {
            End::Silent(words) | End::Gone(words) => format!("{NOT_REACHED}: {words}"),
            End::Stopped => "stopped on request".into(),
            End::Complete => NOT_REACHED.into(),
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Root mean square about the mean.
fn rms(values: &[f64]) -> f64 {
    let middle = mean(values);
    let squares: Vec<f64> = values.iter().map(|value| (value - middle) * (value - middle)).collect();
    mean(&squares).sqrt()
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    // A value that is no number is the largest of all: a fold with `max` would pass over it.
    values.into_iter().fold(0.0, |most, value| {
        if value.is_nan() || most.is_nan() {
            f64::NAN
        } else {
            most.max(value)
        }
    })
}
