//! The room that is left for results. A disk that fills up is noticed while there is still enough to close the recording and
//! to write the digests, and the sentence says how much is left.

use anhyst_ipc::{LinkError, NodeId};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Reports, summary, logs, the last block of a recording.
const END_BYTES: u64 = 4 << 20;
/// Of a node's digest, a tick.
const DIGEST_BYTES: u64 = 8;
/// Between two looks: at hundreds of megabytes a second the end still has its room, and asking costs a run nothing.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// The disk of a run's folder.
#[derive(Debug)]
pub struct Disk {
    folder: PathBuf,
    needed_bytes: u64,
    looked: Option<Instant>,
}

impl Disk {
    /// With room for what a run of `ticks` ticks writes at its end.
    pub fn of_run(folder: &Path, ticks: u64) -> Self {
        Self {
            folder: folder.to_owned(),
            needed_bytes: END_BYTES + NodeId::LOOP_ORDER.len() as u64 * DIGEST_BYTES * ticks,
            looked: None,
        }
    }

    /// Looks whether there still is that much, if the last look is a while ago.
    ///
    /// # Errors
    /// If not. A disk that cannot be asked is good enough.
    pub fn check(&mut self) -> Result<(), LinkError> {
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK_PERIOD) {
            return Ok(());
        }
        self.looked = Some(Instant::now());
        let too_little = |free_bytes: &u64| *free_bytes < self.needed_bytes;
        free_bytes(&self.folder)
            .filter(too_little)
            .map_or(Ok(()), |free_bytes| {
                Err(LinkError::System {
                    operation: format!("go on recording to {}", self.folder.display()),
                    cause: format!(
                        "{} are left on its disk, and the end of the run needs {}",
                        mebibytes(free_bytes),
                        mebibytes(self.needed_bytes)
                    ),
                })
            })
    }
}

/// What a user may still write there; none if the system does not say.
pub fn free_bytes(path: &Path) -> Option<u64> {
    let status = path.ancestors().find_map(|path| rustix::fs::statvfs(path).ok())?;
    Some(status.f_bavail * status.f_frsize)
}

/// True if a write failed because there is no more room.
pub fn is_full(cause: &std::io::Error) -> bool {
    matches!(
        cause.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    )
}

/// The rest of a sentence about a write that failed: the room that is left, if that is why.
pub fn left_after(path: &Path, cause: &std::io::Error) -> String {
    let free_bytes = free_bytes(path).filter(|_| is_full(cause));
    free_bytes.map_or_else(String::new, |free_bytes| {
        format!("; {} are left on its disk", mebibytes(free_bytes))
    })
}

/// In MiB, to a thousandth.
pub fn mebibytes(bytes: u64) -> String {
    format!("{:.3} MiB", bytes as f64 / f64::from(1 << 20))
}
