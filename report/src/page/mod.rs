//! One self-contained HTML page: text, tables, pictures and verdicts, with nothing to fetch and nothing to run.
//!
//! Whatever a caller says is escaped; words between `backticks` become code. The page reads in light and dark and
//! prints; it is well-formed as XML too, so that it can be checked.

mod badge;
mod document;
mod html;
mod table;

pub use badge::{Badge, Verdict};
pub use document::{Block, Footer, Note, Page, Section};
pub use table::{Cell, Table};
