//! Parameters out of measured data, and how well the data fix them.
//!
//! [`engine`] is the one least squares and the one covariance. [`fit()`] finds a material's set for all its loops and reports on
//! it; [`material_text`] writes it as a material file; [`estimate`] finds constants of an actuator from a run. Nothing here prints, draws or
//! writes: files, pictures and progress bars belong to the executable.

pub mod engine;
mod error;
pub mod estimate;
mod first_things;
mod fit;
mod free_run;
pub mod laws;
mod material;
mod modelled;
mod observed;
pub mod order;
pub mod parallel;
mod parameters;
pub mod prepared;
mod progress;
pub mod report;
mod residuals;
mod search;
mod simulate;
mod strain;
mod summary;
mod uncertainty;
mod warnings;

pub use error::IdentifyError;
pub use first_things::first_things;
pub use fit::{Curves, Fit, FitOptions, fit};
pub use material::material_text;
pub use modelled::{FittedLoop, FittedStrain};
pub use parameters::{Bounds, Fixed};
pub use progress::{Progress, Stage};
pub use report::FitReport;
pub use simulate::Beginning;
