//! What happened before a record: nobody measured it, and a law with memory has to begin somewhere.

use anhyst_model::{HysteresisLaw, LawModel, LawModelState};
use serde::{Deserialize, Serialize};

use super::LawRecord;

/// Rounds after which a loop of any law here repeats itself.
const ROUNDS: usize = 2;

/// The history that is assumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Start {
    /// None: from rest at input 0 to the first sample.
    Rest,
    /// The loop itself, until it repeats; a record that does not come round begins as [`Start::Onward`].
    Cycled,
    /// From the end of the whole input range that the record moves away from: it goes on in the direction in which it came.
    Onward,
    /// From the other end: it turned round at its first sample, as a first-order reversal curve does.
    Turned,
    /// From far below the input's range, where a magnet keeps what it was given.
    FromBelow,
    /// From far above.
    FromAbove,
}

/// Of the input's largest: so far nothing is left of what was before.
const FAR: f64 = 3.0;

impl Start {
    /// As reports say it.
    pub fn words(self) -> &'static str {
        match self {
            Start::Rest => "each record begins at rest at input 0",
            Start::Cycled => "each loop had been run before",
            Start::Onward => "each record comes from one end of the input's range and goes on to the other",
            Start::FromBelow => "each record comes from far below the input's range",
            Start::FromAbove => "each record comes from far above the input's range",
            Start::Turned => {
                "each record turned round where it begins, coming from the end of the input's range that it goes to"
            }
        }
    }

    /// The state at a record's first sample.
    pub fn state(self, model: &LawModel, record: &LawRecord, input_extent: [f64; 2]) -> LawModelState {
        let mut state = model.rest();
        match self {
            Start::Rest => model.advance(&mut state, record.input[0]),
            Start::Cycled if record.is_closed() => {
                for _ in 0..ROUNDS {
                    record.input.iter().for_each(|input| model.advance(&mut state, *input));
                }
                model.advance(&mut state, record.input[0]);
            }
            _ => {
                let far = FAR * input_extent[0].abs().max(input_extent[1].abs());
                let ([low, high], from_low) = match self {
                    Start::FromBelow => ([-far, far], true),
                    Start::FromAbove => ([-far, far], false),
                    _ => (input_extent, rises_first(&record.input) != (self == Start::Turned)),
                };
                let (far, other) = if from_low { (low, high) } else { (high, low) };
                // Over the other end, so that nothing of the rest is left.
                for input in [other, far, record.input[0]] {
                    model.advance(&mut state, input);
                }
                // It has stood there for long.
                model.pass(&mut state, f64::INFINITY);
            }
        }
        state
    }
}

/// Whether the input comes to its highest value before its lowest, where it does not begin at one of them.
fn rises_first(input: &[f64]) -> bool {
    let (mut lowest, mut highest) = (0, 0);
    for (sample, value) in input.iter().enumerate() {
        if *value < input[lowest] {
            lowest = sample;
        }
        if *value > input[highest] {
            highest = sample;
        }
    }
    let (down, up) = (input[0] - input[lowest], input[highest] - input[0]);
    // The end that it begins at is no way to go.
    if down < 0.1 * up || up < 0.1 * down {
        up > down
    } else {
        highest < lowest
    }
}
