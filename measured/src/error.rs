//! What can be wrong with measured data and with how it is read.

use std::path::PathBuf;

use thiserror::Error;

/// Where a value stands in a file. Rows count from 0 at the first row after the header; lines count from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    pub file: PathBuf,
    pub row: u64,
    /// Only text has lines.
    pub line: Option<u64>,
    pub column: String,
}

impl std::fmt::Display for Place {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Place { row, column, .. } = self;
        write!(formatter, "{}, row {row}", self.file.display())?;
        if let Some(line) = self.line {
            write!(formatter, " (line {line})")?;
        }
        write!(formatter, ", column \"{column}\"")
    }
}

/// How a bad row is got rid of: a loop does without it, a run would have a gap there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Remedy {
    DropRow,
    CutRun,
}

impl Remedy {
    /// The advice as the end of a sentence.
    pub fn of(self, row: u64) -> String {
        let after = row + 1;
        match self {
            Remedy::DropRow => format!("Mend the file, or drop the row with --drop-rows {row}..{after}"),
            Remedy::CutRun => {
                format!(
                    "Mend the file, leave the row out with --drop-rows {row}..{after}, or keep what stands before or after it: --rows ..{row} or --rows {after}.."
                )
            }
        }
    }
}

/// One refusal: value, limit, place and what to do about it.
#[derive(Debug, Error)]
pub enum MeasuredError {
    #[error("{file} cannot be read: {source}")]
    Unreadable { file: PathBuf, source: std::io::Error },
    #[error("{file}: is empty")]
    Empty { file: PathBuf },
    #[error("{file}: is not a table: it looks like {looks_like}")]
    NotATable { file: PathBuf, looks_like: String },
    #[error("{file}: is not a table of comma-separated values: {source}")]
    NotCsv { file: PathBuf, source: csv::Error },
    #[error("{file}: is not a Parquet file that can be read: {source}")]
    NotParquet {
        file: PathBuf,
        source: Box<parquet::errors::ParquetError>,
    },
    #[error("{file}: is no {format} file that can be read: {reason}")]
    NotReadable {
        file: PathBuf,
        format: &'static str,
        reason: String,
    },
    #[error("{file}: has no header, its first line is {found}. Put a line with the names of the columns before it")]
    NoHeader { file: PathBuf, found: String },
    #[error(
        "{file}, row {row} (line {line}): is not a table there: it has {cells} cells, but the header has {expected}. {remedy}"
    )]
    Ragged {
        file: PathBuf,
        row: u64,
        line: u64,
        cells: usize,
        expected: usize,
        remedy: String,
    },
    #[error("{file}: there is no column \"{header}\", which was named for the {quantity}. {meant}It has {present}")]
    NoSuchHeader {
        file: PathBuf,
        header: String,
        quantity: &'static str,
        meant: String,
        present: String,
    },
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
    #[error(
        "{file}: column \"{column}\" stands there {times} times, so nobody knows which one is meant. Rename all but one"
    )]
    HeaderTwice {
        file: PathBuf,
        column: String,
        times: usize,
    },
    #[error(
        "{file}: column \"{column}\" names the unit {named_unit}, which is not known. Give the scale that takes it to {unit}, as \
         {quantity_key}={column}*SCALE"
    )]
    StrangeUnit {
        file: PathBuf,
        column: String,
        named_unit: &'static str,
        unit: &'static str,
        quantity_key: &'static str,
    },
    #[error("{place}: \"{text}\" is not a number. {remedy}")]
    NotANumber {
        place: Box<Place>,
        text: String,
        remedy: String,
    },
    #[error("{place}: the value is {value}, but every value must be finite. {remedy}")]
    NotFinite {
        place: Box<Place>,
        value: f64,
        remedy: String,
    },
    #[error("{file}, loop {loop_id}: has {rows} rows after dropping, but a loop needs at least {least}")]
    TooFewRows {
        file: PathBuf,
        loop_id: String,
        rows: usize,
        least: usize,
    },
    #[error(
        "{place}: time is {value} s after {previous} s, but it must increase from row to row. Sort the rows, or cut the file there"
    )]
    TimeRunsBack {
        place: Box<Place>,
        value: f64,
        previous: f64,
    },
    #[error(
        "{place}: time {value} s is that of the row before, as in {repeats} rows of the file. Write times with more digits, or drop one of the rows"
    )]
    TimeRepeats {
        place: Box<Place>,
        value: f64,
        repeats: usize,
    },
    #[error(
        "{place}: time jumps from {from_s} s to {to_s} s, so {missing} samples are missing ({gaps} such gaps in all; up to {most} rows in a row and 5 % in all are filled). \
         Cut the run there: the longest stretch without a gap is --rows {keep_from}..{keep_to}"
    )]
    Gap {
        place: Box<Place>,
        from_s: f64,
        to_s: f64,
        missing: u64,
        gaps: usize,
        most: u64,
        keep_from: u64,
        keep_to: u64,
    },
    #[error(
        "{place}: time {value} s is {off_s:.3e} s off a uniform clock of {tick_s:.6e} s, at most {limit_s:.3e} s is allowed. \
         Resample the run to uniform time, or cut the uneven part off with --rows"
    )]
    Jitter {
        place: Box<Place>,
        value: f64,
        off_s: f64,
        tick_s: f64,
        limit_s: f64,
    },
    #[error("{place}: {what} {size:.4e} {unit}, but {bound} {limit:e} {unit} is likely: {reason}. {remedy}")]
    Unlikely {
        place: Box<Place>,
        what: String,
        size: f64,
        unit: &'static str,
        bound: &'static str,
        limit: f64,
        reason: &'static str,
        remedy: String,
    },
    #[error("{file}: has no {side} column: one of {wanted} is needed, and it has {present}. Name one, as in {example}")]
    OneSided {
        file: PathBuf,
        side: &'static str,
        wanted: String,
        present: String,
        example: &'static str,
    },
    #[error(
        "{file}: {rows} of its {in_file} rows are kept, but a run needs at least {least}. Keep more with --rows, or measure longer"
    )]
    RunTooShort {
        file: PathBuf,
        rows: usize,
        in_file: usize,
        least: usize,
    },
    #[error(
        "{place}: loop {second} begins after loop {first}, but a run is one record without a break. \
         Choose one, as in --rows {first_row}..{end_row}"
    )]
    SeveralLoops {
        place: Box<Place>,
        first: String,
        second: String,
        first_row: u64,
        end_row: u64,
    },
    #[error(
        "{place}: the value is {value} {unit} in all {rows} rows, so nothing can be learnt from it. \
         Check that the channel was connected, or leave it out with {quantity_key}=-"
    )]
    ConstantInRun {
        place: Box<Place>,
        quantity_key: &'static str,
        value: f64,
        unit: &'static str,
        rows: usize,
    },
    #[error("{source_of_data}: the {quantity} has {samples} samples, but the first series has {expected}")]
    UnequalLengths {
        source_of_data: String,
        quantity: &'static str,
        samples: usize,
        expected: usize,
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
        "{file}, column \"{column}\": its name says {named_unit}, which needs a scale of {expected}, but the scale is {scale}. Leave the scale out, or rename the column"
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
    #[error(
        "\"{text}\" does not name a column: {meant}write {keys}, then = and the header, then * and a scale if the unit is not SI, as in \
         field=H_raw*1000 or temperature=T*1+273.15. A header of - leaves the quantity out"
    )]
    BadMapping { text: String, meant: String, keys: String },
    #[error("the {quantity_key} is named twice, as \"{first}\" and as \"{second}\": name one column")]
    MappedTwice {
        quantity_key: &'static str,
        first: String,
        second: String,
    },
    #[error("{quantity_key}=... names a quantity that is not read here: {wanted} can be named")]
    NotWanted { quantity_key: &'static str, wanted: String },
    #[error("\"{text}\" is not a range of rows: write 1139.. or 0..10 (row 10 is not in it)")]
    BadRows { text: String },
    #[error("{file}: has neither flux density nor magnetization, and the hysteresis is fitted to one of them")]
    NothingToFit { file: PathBuf },
}
