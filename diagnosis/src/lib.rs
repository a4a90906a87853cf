//! Where simulation and measurement disagree: find it, name it, add it, show the gap shrink.
//!
//! [`diagnose`] takes a nominal model and measured runs. It asks whether anything is missing (`score.rs`), tries every effect
//! of the library and every nominal parameter alone, then pairs, then with all parameters calibrated (`search.rs`), each by fits of
//! free-running simulations, and gives a [`Diagnosis`]: verdict, values ± standard deviation, evidence, and what could not be seen.
//! A verdict rests on held-out rows; a tie is reported as one, with the drive that would break it (`ties.rs`, `experiment.rs`).

mod amended;
mod decide;
mod diagnose;
mod diagnosis;
mod error;
mod experiment;
mod freeform;
mod hats;
mod locate;
mod observation;
mod plant;
mod probes;
mod remainder;
mod report;
mod score;
mod screening;
mod search;
mod select;
mod setup;
mod sight;
mod statistics;
mod system;
mod term;
mod ties;
mod wording;
mod workbench;

pub use amended::amended_text;
pub use diagnose::diagnose;
pub use diagnosis::{Candidate, DataSource, Diagnosed, Diagnosis, FittedValue, FoundEffect, RunSeries, Verdict};
pub use error::DiagnosisError;
pub use experiment::Experiment;
pub use freeform::{FreeCurve, UnknownTerm};
pub use hats::Over;
pub use locate::{ChannelGap, GapCell, GapOver};
pub use report::{page, report};
pub use score::{ScoreGroup, ScoreTest};
pub use setup::DiagnoseOptions;
pub use sight::{Detectable, NotExcited};
pub use statistics::rms;
pub use term::Term;
