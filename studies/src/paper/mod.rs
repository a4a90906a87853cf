//! The paper's examples, computed: what each figure shows, what the paper says of it, what comes out, and what the printed
//! errata cost.
//!
//! Every figure is a function without arguments that gives the same bits each time. Section 5's constants throughout: Terfenol-D,
//! Θ = [6300, 7300] A/m, true `a` 7012 A/m, first estimate 6800 A/m.

mod figure_2;
mod figure_4;
mod figure_5;
mod figure_6;
mod figure_7;

mod printed;
mod publish;

pub use publish::publish;

use anhyst_identify::parallel;
use anhyst_launch::error::RunError;
use anhyst_report::chart::Chart;
use anhyst_report::table::Table;
use serde::Serialize;

/// True `a`, A/m.
const TRUTH_A_PER_M: f64 = 7012.0;
/// First estimate, A/m.
const START_A_PER_M: f64 = 6800.0;
/// Θ, A/m.
const RANGE_A_PER_M: (f64, f64) = (6300.0, 7300.0);
/// Models in a bank over Θ.
const MEMBERS: usize = 33;

/// Abscissa and ordinate.
type Points = Vec<[f64; 2]>;

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

/// All figures, in the paper's order; `progress` is told each one that is done.
///
/// # Errors
/// None that the fixed constants can cause; they pass through the same checks as a user's.
pub fn figures(progress: impl Fn() + Sync) -> Result<Vec<Figure>, RunError> {
    type Make = fn() -> Result<Figure, RunError>;
    let makes: [Make; 5] = [
        figure_2::figure,
        figure_4::figure,
        figure_5::figure,
        figure_6::figure,
        figure_7::figure,
    ];
    let made = parallel::map(parallel::available(), &makes, |make| {
        let figure = make();
        progress();
        figure
    });
    made.into_iter().collect()
}

fn finding(what: &str, paper: &str, found: String, as_printed: &str) -> Finding {
    Finding {
        what: what.into(),
        paper: paper.into(),
        found,
        as_printed: as_printed.into(),
    }
}

/// An error of the model or a law in the words of a run.
fn refused(error: impl std::fmt::Display) -> RunError {
    RunError::Setup(error.to_string())
}
