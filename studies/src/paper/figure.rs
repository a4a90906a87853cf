//! What a figure of the paper is made of.
//!
//! Section 5's constants throughout: Terfenol-D, Θ = [6300, 7300] A/m, true `a` 7012 A/m, first estimate 6800 A/m.

use anhyst_launch::error::RunError;
use anhyst_report::chart::Chart;
use anhyst_report::table::Table;
use serde::Serialize;

/// True `a`, A/m.
pub(super) const TRUTH_A_PER_M: f64 = 7012.0;
/// First estimate, A/m.
pub(super) const START_A_PER_M: f64 = 6800.0;
/// Θ, A/m.
pub(super) const RANGE_A_PER_M: (f64, f64) = (6300.0, 7300.0);
/// Models in a bank over Θ.
pub(super) const MEMBERS: usize = 33;

/// Abscissa and ordinate.
pub(super) type Points = Vec<[f64; 2]>;

/// A figure behind a figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Of what.
    pub what: String,
    /// What the paper says; empty where it says nothing.
    pub paper: String,
    /// What comes out.
    pub found: String,
    /// What comes out with the printed erratum left in; empty where there is none.
    pub as_printed: String,
}

/// One figure of the paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Its number.
    pub number: u32,
    /// What it shows.
    pub title: String,
    /// What the paper says of it.
    pub paper_says: String,
    /// What we get.
    pub we_get: String,
    /// The pictures.
    pub charts: Vec<Chart>,
    /// The numbers.
    pub findings: Vec<Finding>,
}

/// The numbers behind figures.
pub fn table<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> Table {
    let mut table = Table::new(["what", "the paper", "found", "with the printed erratum"]);
    for finding in findings {
        table.push([&finding.what, &finding.paper, &finding.found, &finding.as_printed]);
    }
    table
}

pub(super) fn finding(what: &str, paper: &str, found: String, as_printed: &str) -> Finding {
    Finding {
        what: what.into(),
        paper: paper.into(),
        found,
        as_printed: as_printed.into(),
    }
}

/// An error of the model or a law in the words of a run.
pub(super) fn refused(error: impl std::fmt::Display) -> RunError {
    RunError::Setup(error.to_string())
}
