//! First things first: is a run what its columns say, before any physics is blamed for a gap?
//!
//! Looked for, against the command and against what a nominal model makes of the run: a column with the other sign or in another
//! unit, two columns that changed places ([`labels`]), command and field shifted against each other ([`shift`]), a channel that is
//! cut off or stands still ([`flat`]), and what the reader had to do to the clock. Everything is decided so coarsely that no effect
//! comes near: a sign by a correlation of the other sign, a unit by powers of ten, a shift by an answer that comes before its
//! command, a dead channel by values that repeat to the last digit.

mod flat;
mod labels;
mod shift;

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

/// What a nominal model makes of a run: outputs by quantity, sample by sample; none if it cannot be run on it.
pub type Simulate<'a> = dyn Fn(&MeasuredRun) -> Option<Vec<(Quantity, Vec<f64>)>> + 'a;

/// All that is wrong with a run; nothing for one that is as its columns say.
pub fn first_things(run: &MeasuredRun, simulate: &Simulate) -> Vec<Finding> {
    let mut findings: Vec<Finding> = run.repair.iter().map(resampled).collect();
    // What comes next is looked for in the run as it should have been read.
    let labels = labels::check(run, simulate);
    findings.extend(labels.findings);
    let (run, expected) = (&labels.run, &labels.expected);
    match shift::swapped(run) {
        Some(swapped) => findings.push(swapped),
        None => findings.extend(shift::check(run, expected)),
    }
    findings.extend(flat::check(run, expected));
    findings
}

fn resampled(repair: &crate::ClockRepair) -> Finding {
    Finding {
        kind: FindingKind::Resampled,
        channel: Quantity::Time,
        sentence: repair.to_string(),
        amended_columns: Vec::new(),
        evidence: BTreeMap::from([
            ("filled_rows", repair.filled.len() as f64),
            ("gaps", repair.gaps as f64),
            ("jitter_s", repair.jitter_s),
        ]),
    }
}

/// A measured series and what it should be like.
struct Expected {
    of: Quantity,
    series: Vec<f64>,
}

/// How the column of a quantity is read now: header, scale, offset.
fn as_read(run: &MeasuredRun, quantity: Quantity) -> (&str, f64, f64) {
    run.column(quantity).map_or((quantity.header(), 1.0, 0.0), |own| {
        (&own.header, own.scale, own.offset)
    })
}

/// A quantity read from a column with its values multiplied.
fn rescaled(run: &MeasuredRun, quantity: Quantity, factor: f64) -> String {
    let (header, scale, offset) = as_read(run, quantity);
    option(quantity, header, scale * factor, offset * factor)
}

/// Each of two quantities read from the other's column, in its own unit.
fn exchanged(run: &MeasuredRun, one: Quantity, other: Quantity) -> Vec<String> {
    let from = |quantity: Quantity, of: Quantity| {
        let (header, ..) = as_read(run, of);
        let (_, scale, offset) = as_read(run, quantity);
        option(quantity, header, scale, offset)
    };
    vec![from(one, other), from(other, one)]
}

/// For a sentence: each as it is pasted.
fn pasted(options: &[String]) -> String {
    let quoted: Vec<String> = options.iter().map(|own| format!("--column '{own}'")).collect();
    quoted.join(" ")
}
