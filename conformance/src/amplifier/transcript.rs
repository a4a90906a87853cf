//! What the process answered.

use std::ops::Range;

/// Why a program ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// At its end.
    Complete,
    /// The process does not answer any more; the words say since when.
    Silent(String),
    /// The process is gone; the words say how.
    Gone(String),
    /// The user asked to stop.
    Stopped,
}

/// One answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// A/m.
    pub field_a_per_m: f64,
    /// Bits: 1 amplitude limit, 2 slew limit.
    pub status: u64,
}

/// The answers to a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Transcript {
    /// One a tick; a tick without an answer has that of the tick before.
    pub answers: Vec<Answer>,
    /// From sending to the answer, s; one an answer that came in time.
    pub latencies_s: Vec<f64>,
    /// Ticks without an answer in time.
    pub missing: usize,
    /// Answers that bear a later tick than the one they answer.
    pub wrong: usize,
    /// Answers that came twice.
    pub repeated: usize,
    /// Why it ended.
    pub end: End,
}

impl Transcript {
    /// Room for a program of so many ticks.
    pub fn with_capacity(ticks: usize) -> Self {
        Self {
            answers: Vec::with_capacity(ticks),
            latencies_s: Vec::with_capacity(ticks),
            missing: 0,
            wrong: 0,
            repeated: 0,
            end: End::Complete,
        }
    }

    /// The fields of these ticks, A/m; none if the program did not get that far.
    pub fn fields(&self, ticks: &Range<usize>) -> Option<Vec<f64>> {
        let answers = self.answers.get(ticks.clone())?;
        Some(answers.iter().map(|answer| answer.field_a_per_m).collect())
    }
}

/// What came after the commands had ended.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Aftermath {
    /// Seconds since the last command, and the field, A/m.
    pub answers: Vec<(f64, f64)>,
    /// How long was listened, s.
    pub listened_s: f64,
}
