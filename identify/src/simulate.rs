//! A hysteresis model run freely along a measured sweep: it hears the field and never the measured response.
//!
//! How the run begins is a statement about the measurement, not about the material, so it is a choice ([`Beginning`]).

use anhyst_model::{Hysteresis, MagneticState};
use serde::{Deserialize, Serialize};

use crate::prepared::Start;

/// In which state the material was when the sweep began.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Beginning {
    /// Closed quasi-static loop: the sweep is run twice and the second run compared ([`Start::Cycled`]).
    Cycled,
    /// The first measured magnetization, less the offset of the instrument, is true.
    Measured,
    /// The first magnetization is unknown and fitted.
    Fitted,
}

impl Beginning {
    /// A closed sweep is cycled; any other begins at what was measured, which is fitted because a single sample carries the noise of
    /// the instrument.
    pub(crate) fn of(start: Start) -> Self {
        match start {
            Start::Cycled(_) => Beginning::Cycled,
            _ => Beginning::Fitted,
        }
    }
}

/// Largest less smallest.
pub(crate) fn range(series: &[f64]) -> f64 {
    let (low, high) = anhyst_measured::sweep::extremes(series);
    high - low
}

/// Magnetization (A/m) along `field`, from a state through one whole sweep, then recorded on the second.
pub(crate) fn cycled(hysteresis: &Hysteresis, mut state: MagneticState, field: &[f64], magnetization: &mut Vec<f64>) {
    for &to in field {
        state = hysteresis.advance(state, to);
    }
    record(hysteresis, state, field, magnetization);
}

/// Magnetization (A/m) along `field`, the first sample being `first_a_per_m`.
pub(crate) fn from_first(hysteresis: &Hysteresis, field: &[f64], first_a_per_m: f64, magnetization: &mut Vec<f64>) {
    let field_a_per_m = field.first().copied().unwrap_or_default();
    let state = MagneticState {
        field_a_per_m,
        magnetization_a_per_m: first_a_per_m,
    };
    record(hysteresis, state, field, magnetization);
}

fn record(hysteresis: &Hysteresis, mut state: MagneticState, field: &[f64], magnetization: &mut Vec<f64>) {
    magnetization.clear();
    magnetization.extend(field.iter().map(|&to| {
        state = hysteresis.advance(state, to);
        state.magnetization_a_per_m
    }));
}
