//! One writer a folder: an advisory lock on the folder itself, which the system lifts when its process ends, however it ends.
//!
//! No file is left behind, and none can be stale. Processes that a run starts do not inherit the lock.

use crate::error::RunError;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// A folder that nobody else writes to for as long as this lives.
#[derive(Debug)]
pub struct Claimed {
    /// Where it is.
    pub path: PathBuf,
    _lock: File,
}

/// Makes the folder `wanted`, or a new one, `runs/NAME-UTC`, and claims it.
///
/// # Errors
/// If somebody else has claimed it, or it cannot be made.
pub fn claimed(wanted: Option<&Path>, name: &str) -> Result<Claimed, RunError> {
    let made = match wanted {
        Some(wanted) => std::fs::create_dir_all(wanted).map(|()| wanted.to_owned()),
        None => create_unused(name),
    };
    let path = made.map_err(|cause| RunError::Write {
        path: wanted.unwrap_or(Path::new("runs")).to_owned(),
        cause,
    })?;
    let lock = claim(&path)?;
    Ok(Claimed { path, _lock: lock })
}

fn claim(folder: &Path) -> Result<File, RunError> {
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

/// Creates `runs/NAME-UTC`, with a counter if two runs start in one second. Creating is the test: of two runs that start at
/// once only one gets a name.
fn create_unused(name: &str) -> std::io::Result<PathBuf> {
    let runs = Path::new("runs");
    std::fs::create_dir_all(runs)?;
    let time = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S");
    let mut candidate = runs.join(format!("{name}-{time}"));
    let mut n = 1;
    loop {
        match std::fs::create_dir(&candidate) {
            Ok(()) => return Ok(candidate),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => n += 1,
            Err(error) => return Err(error),
        }
        candidate = runs.join(format!("{name}-{time}-{n}"));
    }
}
