//! What can be wrong with measured data, with how it is read, and with a fit.

use std::path::PathBuf;

use thiserror::Error;

/// Where a value stands in a file. Rows count from 0 at the first row after the header; lines count from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    pub file: PathBuf,
    pub row: u64,
    pub line: u64,
    pub column: String,
}

impl std::fmt::Display for Place {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Place { row, line, column, .. } = self;
        write!(
            formatter,
            "{}, row {row} (line {line}), column \"{column}\"",
            self.file.display()
        )
    }
}

/// One refusal: value, limit, place and what to do about it.
#[derive(Debug, Error)]
pub enum DiagnosisError {
    #[error("{file} cannot be read: {source}")]
    Unreadable { file: PathBuf, source: std::io::Error },
    #[error("{file}: is not a table of comma-separated values: {source}")]
    NotCsv { file: PathBuf, source: csv::Error },
    #[error(
        "{file}: has no column for the {quantity}; it has {present}. Name one with {quantity_key}=HEADER or {quantity_key}=HEADER*SCALE"
    )]
    MissingColumn {
        file: PathBuf,
        quantity: &'static str,
        quantity_key: &'static str,
        present: String,
    },
    #[error(
        "{file}: columns \"{first}\" and \"{second}\" both hold the {quantity}. Name one with {quantity_key}=HEADER"
    )]
    TwoColumns {
        file: PathBuf,
        quantity: &'static str,
        quantity_key: &'static str,
        first: String,
        second: String,
    },
    #[error("{place}: \"{text}\" is not a number")]
    NotANumber { place: Box<Place>, text: String },
    #[error("{place}: the value is {value}, but every value must be finite. Drop the row or mend the file")]
    NotFinite { place: Box<Place>, value: f64 },
    #[error(
        "{file}, loop {loop_id}: column \"{column}\" is {value} in all {rows} rows, so nothing can be learnt from it"
    )]
    Constant {
        file: PathBuf,
        loop_id: String,
        column: String,
        value: f64,
        rows: usize,
    },
    #[error("{file}, loop {loop_id}: has {rows} rows after dropping, but a loop needs at least {least}")]
    TooFewRows {
        file: PathBuf,
        loop_id: String,
        rows: usize,
        least: usize,
    },
    #[error("{place}: time is {value} s after {previous} s, but it must increase from row to row")]
    TimeRunsBack {
        place: Box<Place>,
        value: f64,
        previous: f64,
    },
    #[error(
        "{file}, loop {loop_id}: the field turns round {reversals} times in {rows} rows, at most {limit} can be a sweep. \
         Are the rows sorted, is column \"{column}\" the field, and is it free of noise?"
    )]
    NotASweep {
        file: PathBuf,
        loop_id: String,
        column: String,
        reversals: usize,
        rows: usize,
        limit: usize,
    },
    #[error(
        "{place}: the {quantity} is {value:.4e} {unit}, but {limit} {unit} is never exceeded: {reason}. Is the unit right? Give a scale with {quantity_key}=HEADER*SCALE"
    )]
    UnitSuspected {
        place: Box<Place>,
        quantity: &'static str,
        quantity_key: &'static str,
        value: f64,
        limit: f64,
        unit: &'static str,
        reason: &'static str,
    },
    #[error(
        "{file}, column \"{column}\": its name says {named_unit}, which needs a scale of {expected}, but the scale is {scale}"
    )]
    ScaleContradictsName {
        file: PathBuf,
        column: String,
        named_unit: &'static str,
        expected: f64,
        scale: f64,
    },
    #[error(
        "{file}, loop {loop_id}: the magnetization falls while the field rises (correlation {correlation:.2}), but it must follow the field. \
         The unit or the sign of column \"{field_column}\" or \"{response_column}\" is wrong"
    )]
    MagnetizationFalls {
        file: PathBuf,
        loop_id: String,
        field_column: String,
        response_column: String,
        correlation: f64,
    },
    #[error("\"{text}\" does not name a column: write {expected}")]
    BadMapping { text: String, expected: &'static str },
    #[error("\"{text}\" is not a range of rows: write 1139.. or 0..10 (the end is not dropped)")]
    BadRows { text: String },
    #[error("\"{text}\" does not fix a parameter: write Ms, a, k, alpha or c, then = and a number, as in alpha=-0.01")]
    BadFix { text: String },
    #[error("{file}: has neither flux density nor magnetization, and the hysteresis is fitted to one of them")]
    NothingToFit { file: PathBuf },
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
    #[error("the fitted material cannot be written: {0}")]
    MaterialText(#[from] ron::Error),
    #[error("the picture cannot be drawn: {0}")]
    Picture(String),
}
