//! One self-contained HTML page: text, tables, verdicts, shares, and charts to zoom into, hover over and hide curves of,
//! with nothing to fetch.
//!
//! Whatever a caller says is escaped; words between `backticks` become code. The page reads in light and dark and
//! prints; it is well-formed as XML too, so that it can be checked. Charts are drawn by uPlot 1.6.32 (Leon Sorokin, MIT;
//! `uplot/`), which is put into the page, as are their points in single precision.

mod bars;
mod document;
mod escaped;
mod heat;
mod html;
mod interactive;

pub use bars::{Bar, Bars, Segment, Shares};
pub use document::{Block, Footer, Note, Page, Section};
pub use heat::{HeatMap, MOST_CELLS};
