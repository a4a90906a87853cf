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
    /// The loop itself, until it repeats; a record that does not come round begins as [`Start::FarEnd`].
    Cycled,
    /// The end of the whole input range that the record moves away from, as a first-order reversal curve does from saturation.
    FarEnd,
}

impl Start {
    pub const ALL: [Start; 3] = [Start::Cycled, Start::FarEnd, Start::Rest];

    /// As reports say it.
    pub fn words(self) -> &'static str {
        match self {
            Start::Rest => "each record begins at rest at input 0",
            Start::Cycled => "each loop had been run before",
            Start::FarEnd => "each record comes from the far end of the input's range",
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
                let rises = first_move(&record.input) > 0.0;
                let far = if rises { input_extent[0] } else { input_extent[1] };
                // Over the other end, so that nothing of the rest is left.
                model.advance(&mut state, input_extent[0] + input_extent[1] - far);
                model.advance(&mut state, far);
                model.advance(&mut state, record.input[0]);
                // It has stood there for long.
                model.pass(&mut state, f64::INFINITY);
            }
        }
        state
    }
}

/// Which way the input goes first, past the noise: to whichever of its ends comes first.
fn first_move(input: &[f64]) -> f64 {
    let at = |better: fn(&f64, &f64) -> bool| {
        let mut best = 0;
        for sample in 1..input.len() {
            if better(&input[sample], &input[best]) {
                best = sample;
            }
        }
        best
    };
    let (lowest, highest) = (at(|a, b| a < b), at(|a, b| a > b));
    // The end that the record begins at is no move.
    let to_lowest = (input[lowest] - input[0]).abs();
    let to_highest = (input[highest] - input[0]).abs();
    match (
        lowest < highest,
        to_lowest > 0.1 * to_highest,
        to_highest > 0.1 * to_lowest,
    ) {
        (true, true, _) | (false, _, false) => -1.0,
        _ => 1.0,
    }
}
