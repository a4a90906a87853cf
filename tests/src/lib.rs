//! What the tests across processes share: unique names, time limits, and the check that nothing is left behind.

mod command;
mod identity;
mod resources;

pub use command::{Finished, anhyst, children, python, repository, start};
pub use identity::{assert_same, first_difference, trail};
pub use resources::{SharedMemory, files_with};
