//! Measured runs: what went into an actuator and what came out, sample by sample, over time or as one slow sweep.
//!
//! M = B/μ0 − H where a run holds flux density and measured field but no magnetization: M magnetization, H field
//! (A/m), B flux density (T), μ0 (T·m/A). All series are in SI units and of one length. Assumption: one clock, so that
//! time is uniform; a run without time is a quasi-static sweep whose rows stand in the order of measuring.

mod read;
mod record;
mod selection;
mod time;
mod units;

pub use read::RunReadOptions;
pub use record::{INPUTS, MeasuredRun, OUTPUTS};
pub use selection::LEAST_RUN_ROWS;
