//! Results to look at: charts as SVG or PNG, and self-contained HTML pages of text, tables and charts.
//!
//! Nothing here knows what it shows.

#[cfg(feature = "recorder")]
pub mod album;
mod error;
pub mod figure;
pub mod page;
pub mod plot;

pub use error::ReportError;
