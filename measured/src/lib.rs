//! Measured tables in: loops and runs in SI units, each refusal a sentence; how loud the measurement itself is.
//!
//! [`MeasuredRun::read`] and [`MeasuredRun::read_loops`] take a table, text or Parquet, and refuse it with a sentence or give
//! series in SI units; [`survey::Survey`] lists what a file holds and how it can be read; [`noise_floor`] says how far they can be trusted; [`sweep`] makes a field fit to drive a model.

pub mod check;
mod columns;
mod error;
mod magnetization;
mod noise;
mod quantity;
mod resolution;
mod rows;
mod run;
mod sheet;
mod spelling;
pub mod survey;
pub mod sweep;
mod units;

pub use columns::{Column, ColumnMapping, Columns};
pub use error::{MeasuredError, Place};
pub use noise::{MIN_NOISE_SAMPLES, NoiseFloor, NoiseSource, noise_floor, rests};
pub use quantity::Quantity;
pub use resolution::resolution;
pub use rows::RowRange;
pub use run::{ClockRepair, INPUTS, LAW_INPUTS, LAW_OUTPUTS, MIN_RUN_ROWS, MeasuredRun, OUTPUTS, RunReadOptions};
pub use spelling::nearest;
