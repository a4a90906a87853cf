//! Hysteresis laws out of measured data: each fitted, and judged by what it predicts of the data that were kept back.
//!
//! A law is linear in its weights, which are not negative, and in the data's zero; the few numbers inside (radii, warps, a
//! density's shape) are searched for around that. [`fit_laws`] fits every [`Family`], freely running along the records, and takes the
//! one of the fewest numbers among those within [`TIE`] of the best prediction.
//! Sources: non-negative least squares: Kim and Park, SIAM J. Sci. Comput. 33 (2011) 3261; the search outside: variable projection,
//! Golub and Pereyra (1973), by the method of Nelder and Mead (1965).

mod circumstances;
mod data;
mod error;
mod even;
mod family;
mod file;
mod gram;
mod nnls;
mod options;
mod parts;
mod predict;
mod search;
mod start;
mod through;
mod verdict;

pub use data::{LawData, LawRecord, Reaction};
pub use error::LawError;
pub use even::EvenCurve;
pub use family::Family;
pub use file::LawFile;
pub use options::LawOptions;
pub use predict::{Distance, Prediction, predict};
pub use search::{FittedLaw, fit_law};
pub use start::Start;
pub use verdict::{LawCandidate, LawFit, LawReport, TIE, fit_each, fit_laws};
