//! Results to look at: charts as SVG, to zoom into, or in letters; tables for terminal, page and document, self-contained HTML pages.
//!
//! Nothing here knows what it shows.

pub mod chart;
pub mod course;
pub mod decomposition;
mod error;
pub mod number;
pub mod page;
mod picture;
pub mod table;

pub use error::ReportError;
