//! One writer a folder: an advisory lock on the folder itself, which the system lifts when its process ends, however it ends.
//!
//! No file is left behind, and none can be stale. Processes that a run starts do not inherit the lock.

use crate::error::RunError;
use std::fs::{File, TryLockError};
use std::path::Path;

/// Claims a folder that exists for as long as the file lives.
///
/// # Errors
/// If somebody else has claimed it, or it cannot be opened.
pub fn claim(folder: &Path) -> Result<File, RunError> {
    let refuse = |cause| RunError::Write {
        path: folder.to_owned(),
        cause,
    };
    let opened = File::open(folder).map_err(refuse)?;
    match opened.try_lock() {
        Err(TryLockError::WouldBlock) => Err(RunError::Claimed {
            path: folder.to_owned(),
        }),
        // A file system without locks keeps nobody out; that is no reason not to run.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(opened),
    }
}
