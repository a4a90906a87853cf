//! Where simulation and measurement disagree: find it, name it, add it, show the gap shrink.
//!
//! [`diagnose`] takes a nominal model and measured runs and decomposes their difference: what was measured is what is
//! simulated, nuisance and what is left (`decompose.rs`), on one likelihood (`likelihood.rs`). It gives a [`Diagnosis`]: shares of the gap, values
//! with intervals, a verdict, what is left, and what could not be seen. A tie is reported as one, with the drive that would break it.

mod acquisition;
mod amended;
mod bands;
mod channel;
mod composition;
mod cost;
mod decompose;
mod decomposition;
mod diagnose;
mod diagnosis;
mod error;
mod evidence;
mod experiment;
mod fitting;
mod forms;
mod joining;
mod leaving;
mod likelihood;
mod linearised;
mod lines;
mod locate;
mod low_passes;
mod memory;
mod normal;
mod nuisance;
mod plant;
mod probes;
mod products;
mod recorder;
mod report;
mod screening;
mod search;
mod setup;
mod shape;
mod shares;
mod sight;
mod signals;
mod spectrum;
mod statistics;
mod term;
mod unknown;
mod unlisted;
mod verdict;
mod wording;

pub use amended::amended_text;
pub use cost::Cost;
pub use diagnose::diagnose;
pub use diagnosis::{
    Candidate, DataSource, Diagnosed, Diagnosis, FittedValue, FoundEffect, RunSeries, ScoreGroup, ScoreTest, Verdict,
};
pub use error::DiagnosisError;
pub use experiment::Experiment;
pub use locate::{ChannelGap, GapCell, GapOver};
pub use report::{page, report, table};
pub use setup::DiagnoseOptions;
pub use shares::{Contribution, ContributionKind};
pub use sight::{Detectable, NotExcited};
pub use statistics::rms;
pub use term::Term;
pub use unlisted::{FreeCurve, Over, UnknownTerm};
