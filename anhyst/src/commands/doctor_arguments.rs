//! What `anhyst doctor` is told, and its measurements.

use crate::arguments::{JsonArgument, SetArguments};
use anhyst_ipc::number_between;
use clap::Args;
use std::path::PathBuf;

/// `doctor`
#[derive(Debug, Args)]
pub struct DoctorArguments {
    /// Remove what crashed runs have left.
    #[arg(long)]
    pub clean: bool,
    /// Measure waits and placements on this machine, and the highest rate at which this scenario keeps time.
    #[arg(long, value_name = "SCENARIO", conflicts_with = "clean", group = "measured")]
    pub realtime: Option<PathBuf>,
    /// Measure what a hop between processes costs on this machine, and how this scenario runs fastest without a clock.
    #[arg(long, value_name = "SCENARIO", conflicts_with = "clean", group = "measured")]
    pub lockstep: Option<PathBuf>,
    /// Simulated time of each of about a dozen ways; the longer, the more the figures mean.
    #[arg(long, default_value_t = 5.0, value_name = "S", requires = "measured", value_parser = number_between(1e-3..=86_400.0, "s"))]
    pub duration_s: f64,
    /// Ticks per second at which the ways are compared in real time.
    #[arg(
        long,
        default_value_t = 2000.0,
        value_name = "HZ",
        requires = "realtime",
        conflicts_with = "lockstep"
    )]
    pub rate_hz: f64,
    /// Folder of the runs that are measured, each in the place of the one before.
    #[arg(long, default_value = "runs/doctor", value_name = "FOLDER", requires = "measured")]
    pub out: PathBuf,
    /// What is changed in the scenario.
    #[command(flatten)]
    pub set: SetArguments,
    /// How the findings are printed.
    #[command(flatten)]
    pub json: JsonArgument,
}
