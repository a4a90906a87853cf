//! What can be wrong with a fit of laws.

use anhyst_measured::Quantity;
use anhyst_model::ModelError;
use thiserror::Error;

/// One refusal.
#[derive(Debug, Error)]
pub enum LawError {
    #[error(
        "{source_of_data}: nothing drives a law there; it holds {present}. Name an input, as --column voltage=HEADER, and an output"
    )]
    NoInput { source_of_data: String, present: String },
    #[error("{source_of_data}: holds no {}, which {whose}; it holds {present}", .wanted.name())]
    Missing {
        source_of_data: String,
        wanted: Quantity,
        whose: &'static str,
        present: String,
    },
    #[error("{source_of_data}: {samples} samples in all hold no law: at least {least}")]
    TooFew {
        source_of_data: String,
        samples: usize,
        least: usize,
    },
    #[error("{source_of_data}: the {} is {value} in every row: nothing to fit", .quantity.name())]
    Still {
        source_of_data: String,
        quantity: Quantity,
        value: f64,
    },
    #[error(
        "the fit of {law} ends at {nrmse:.3} % of the range, where a line comes to {line_nrmse:.3} %: it does not describe these data"
    )]
    WorseThanALine {
        law: &'static str,
        /// Per cent of the output's range.
        nrmse: f64,
        line_nrmse: f64,
    },
    #[error(transparent)]
    Model(#[from] ModelError),
}
