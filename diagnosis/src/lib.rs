//! Measured data in, fitted material and pictures out.
//!
//! [`MeasuredLoops::read`] takes a table and refuses it with a sentence or gives loops in SI units; [`fit()`] finds one
//! parameter set for all loops and says how well the data fix it; [`material_text`] and [`picture`] write the result.
//! Nothing here prints or writes: files and progress bars belong to the executable.

mod checks;
pub mod columns;
pub mod data;
pub mod diagnose;
mod error;
pub mod fit;
mod material;
mod noise;
pub mod page;
pub mod parallel;
pub mod parameters;
mod picture;
pub mod plot;
mod progress;
mod quantity;
pub mod report;
mod residuals;
mod rows;
mod run;
mod search;
mod sheet;
pub mod simulate;
mod strain;
pub mod study;
mod summary;
pub mod sweep;
mod uncertainty;
mod warnings;

pub use columns::{Column, ColumnMapping, Columns};
pub use data::{MeasuredLoop, MeasuredLoops, ReadOptions};
pub use error::{DiagnosisError, Place};
pub use fit::{Curves, Fit, FitOptions, FittedLoop, FittedStrain, fit};
pub use material::material_text;
pub use noise::{LEAST_NOISE_SAMPLES, NoiseFloor, NoiseSource, noise_floor, resolution, rests};
pub use parameters::{Bounds, Fixed, Parameter};
pub use picture::picture;
pub use progress::{Progress, Stage};
pub use quantity::Quantity;
pub use report::FitReport;
pub use rows::RowRange;
pub use run::{INPUTS, LEAST_RUN_ROWS, MeasuredRun, OUTPUTS, RunReadOptions};
pub use simulate::Beginning;
