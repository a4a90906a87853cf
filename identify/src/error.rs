//! What can be wrong with a fit.

use anhyst_measured::MeasuredError;
use anhyst_model::ModelError;
use thiserror::Error;

/// One refusal: what was asked for, what it must be, and what to do about it.
#[derive(Debug, Error)]
pub enum IdentifyError {
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    #[error("\"{text}\" does not fix a parameter: write Ms, a, k, alpha or c, then = and a number, as in alpha=-0.01")]
    BadFix { text: String },
    #[error("all five parameters are fixed, so there is nothing to fit")]
    NothingFree,
    #[error("{what} is {given}, but it must be {requirement}")]
    BadOption {
        what: &'static str,
        given: f64,
        requirement: &'static str,
    },
    #[error(
        "none of the {candidates} parameter sets that were tried is valid, so no fit could start. \
         Check the fixed parameters against the data: fields to {field_a_per_m:.3e} A/m, magnetization to {magnetization_a_per_m:.3e} A/m"
    )]
    NoValidStart {
        candidates: usize,
        field_a_per_m: f64,
        magnetization_a_per_m: f64,
    },
    #[error(
        "{source_of_data}: has no strain, so the fitted material has no strain law and moves nothing; its hysteresis alone is in the report"
    )]
    NoStrain { source_of_data: String },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(
        "{source_of_data}: no output that the model \"{model}\" has: it needs displacement (with a rod in the model), magnetization, flux density or \
         strain (with a strain law), and the file holds {present}"
    )]
    NoOutput {
        source_of_data: String,
        model: String,
        present: String,
    },
    #[error(
        "{source_of_data}: neither a field command nor a measured field; name one with --column field=HEADER*SCALE"
    )]
    NoDrive { source_of_data: String },
    #[error("{source_of_data}: --settle-s {settle_s} {why}")]
    Settle {
        source_of_data: String,
        settle_s: f64,
        why: String,
    },
    #[error("the model \"{model}\" has no {parameter}, so it cannot be estimated")]
    NoSuchPart { model: String, parameter: &'static str },
    #[error("the model \"{model}\" cannot be simulated on this run")]
    NotSimulated { model: String },
    #[error("the fitted material cannot be written: {0}")]
    MaterialText(#[from] ron::Error),
}
