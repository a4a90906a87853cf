//! What the tests across processes share: unique names, time limits, and the check that nothing is left behind.

mod command;
mod example;
mod hosts;
mod identity;
mod real_time;
mod resources;
pub mod rough;
mod witness;

pub use command::{Finished, anhyst, children, digest, folders, repository, spawn, start, summary, wait_for};
pub use example::{Board, c_amplifier, iio_buffers, iio_device, python};
pub use hosts::Hosts;
pub use identity::{assert_same, digest_history, first_difference};
pub use real_time::{A_FEW, alone, summary_as_judged};
pub use resources::{SharedMemory, files_with};
pub use witness::{SensorFaults, Witness};

/// The processes of a run that is given no other placement.
pub const PROCESSES: [&str; 7] = [
    "plant-sim",
    "estimator",
    "controller",
    "inverse",
    "guard",
    "amplifier",
    "recorder",
];

/// After so long a test gives up on what hangs. Nobody's speed is judged by it.
pub const LIMIT: std::time::Duration = std::time::Duration::from_secs(1800);
