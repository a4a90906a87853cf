//! What is said of a run, and how to read its file instead.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::columns::option;
use crate::quantity::Quantity;
use crate::run::MeasuredRun;

/// What is wrong with a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// A column has the other sign.
    Sign,
    /// A column is in another unit.
    Scale,
    /// Two columns changed places.
    Swapped,
    /// Command and field are not of the same time.
    Shifted,
    /// A channel is cut off at an end of its range.
    Saturated,
    /// A channel stands still while it should move.
    Stuck,
    /// The clock was mended by the reader.
    Resampled,
}

/// One thing that is wrong, in words, and how to read the file instead.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    pub kind: FindingKind,
    /// Whose column it is.
    pub channel: Quantity,
    pub sentence: String,
    /// What follows `--column`, as in `displacement=displacement_m*-1`: one, two where columns are swapped, none where nothing helps.
    pub amended_columns: Vec<String>,
    /// The figures that decided.
    pub evidence: BTreeMap<&'static str, f64>,
}

/// A measured series and what it should be like.
pub(super) struct Expected {
    pub of: Quantity,
    pub series: Vec<f64>,
}

/// How the column of a quantity is read now: header, scale, offset.
pub(super) fn as_read(run: &MeasuredRun, quantity: Quantity) -> (&str, f64, f64) {
    run.column(quantity).map_or((quantity.header(), 1.0, 0.0), |own| {
        (&own.header, own.scale, own.offset)
    })
}

/// A quantity read from a column with its values multiplied.
pub(super) fn rescaled(run: &MeasuredRun, quantity: Quantity, factor: f64) -> String {
    let (header, scale, offset) = as_read(run, quantity);
    option(quantity, header, scale * factor, offset * factor)
}

/// Each of two quantities read from the other's column, in its own unit.
pub(super) fn exchanged(run: &MeasuredRun, one: Quantity, other: Quantity) -> Vec<String> {
    let from = |quantity: Quantity, of: Quantity| {
        let (header, ..) = as_read(run, of);
        let (_, scale, offset) = as_read(run, quantity);
        option(quantity, header, scale, offset)
    };
    vec![from(one, other), from(other, one)]
}

/// For a sentence: each as it is pasted.
pub(super) fn pasted(options: &[String]) -> String {
    let quoted: Vec<String> = options.iter().map(|own| format!("--column '{own}'")).collect();
    quoted.join(" ")
}
