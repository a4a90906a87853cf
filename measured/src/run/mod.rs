//! Measured runs: what went into an actuator and what came out, sample by sample, over time or as one slow sweep.
//!
//! M = B/μ0 − H where a run holds flux density and measured field but no magnetization: M magnetization, H field inside the
//! material (A/m), B flux density (T), μ0 (T·m/A). All series are in SI units and of one length; the zero of strain is arbitrary.
//! Assumption: one clock, so that time is uniform; a run without time, or a loop, is a quasi-static sweep whose rows stand in the
//! order of measuring, its field free of the demagnetising one.

mod options;
mod read;
mod record;
mod records;
mod repair;
mod resample;
mod selection;
mod sweeps;
mod time;

pub use options::RunReadOptions;
pub use record::{INPUTS, LAW_INPUTS, LAW_OUTPUTS, MeasuredRun, OUTPUTS};
pub use repair::ClockRepair;
pub use selection::MIN_RUN_ROWS;

pub(crate) use read::OF_LOOPS;
pub(crate) use record::Series;
pub(crate) use selection::{Selection, chosen};
pub(crate) use sweeps::correlation;
pub(crate) use time::{gaps, median_step_s};
