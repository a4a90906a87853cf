//! What the tests across processes share: unique names, time limits, and the check that nothing is left behind.

mod command;
mod example;
mod hosts;
mod identity;
mod real_time;
mod resources;

pub use command::{Finished, anhyst, children, repository, start};
pub use example::{c_amplifier, iio_device, python};
pub use hosts::Hosts;
pub use identity::{assert_same, first_difference, trail};
pub use real_time::{A_FEW, summary_as_judged};
pub use resources::{SharedMemory, files_with};
