//! The iceoryx2 resources of a run: names that no other run has, their removal, and what crashed runs have left.

use crate::disk::mebibytes;
use rustix::fs::Access;
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// A run's iceoryx2 resources: a prefix and a directory that no other run has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resources {
    /// Prefix of the run's files in /dev/shm.
    pub prefix: String,
    /// Directory of the run's sockets and service files.
    pub root: PathBuf,
}

/// What stands for the launcher's number in the names of processes that were started by hand.
pub const HAND: &str = "hand";

/// Every prefix begins with this, so that leftovers of crashed runs can be told from other people's files.
pub const PREFIX: &str = "anhyst_";

/// The directory that holds the runs' roots: one a user, because iceoryx2's own default belongs to its first user.
pub fn user_root() -> PathBuf {
    // A socket path has 108 bytes, of which iceoryx2 needs about 60: TMPDIR may be too long, /tmp is not.
    PathBuf::from("/tmp").join(format!("anhyst-{}", rustix::process::getuid().as_raw()))
}

/// A socket's path has 108 bytes, of which iceoryx2 needs about 40 for its own names.
const MAX_ROOT_AND_PREFIX: usize = 68;
/// The shortest prefix that a user may choose: all files that begin with it are removed after the run.
const MIN_PREFIX: usize = 8;

/// Checks that a socket's path has room for both.
fn check_length(root: &Path, prefix: &str) -> Result<(), String> {
    let length = root.as_os_str().len() + prefix.len();
    if length > MAX_ROOT_AND_PREFIX {
        return Err(format!(
            "--root and --service-prefix have {length} characters together; a socket's path leaves room for {MAX_ROOT_AND_PREFIX}"
        ));
    }
    Ok(())
}

fn unusable(root: &Path, error: &dyn Display) -> String {
    format!("--root {} cannot be used: {error}", root.display())
}

/// Checks that iceoryx2 can make its folders there.
fn check_root(root: &Path) -> Result<(), String> {
    if !root.to_str().is_some_and(|text| text.is_ascii()) {
        return Err(format!(
            "--root {} must be written in ASCII: iceoryx2 takes no other paths",
            root.display()
        ));
    }
    // It is not made here: iceoryx2 makes it as it wants it, and other processes of the run may be about to.
    let whole = std::path::absolute(root).map_err(|error| unusable(root, &error))?;
    let nearest = whole.ancestors().find(|folder| folder.exists()).unwrap_or(&whole);
    rustix::fs::access(nearest.join("."), Access::WRITE_OK | Access::EXEC_OK).map_err(|error| unusable(&whole, &error))
}

impl Resources {
    /// Resources under names that the user chose (each may be left to us), so that a driver can know them beforehand.
    ///
    /// # Errors
    /// A sentence, if a name is too long, or so short that cleaning up could meet somebody else's files.
    pub fn chosen(prefix: Option<&str>, root: Option<&Path>) -> Result<Self, String> {
        let unique = Self::unique();
        let root = root.map_or_else(|| Ok(unique.root), std::path::absolute);
        let chosen = Self {
            prefix: prefix.map_or(unique.prefix, str::to_owned),
            root: root.map_err(|error| format!("--root cannot be used: {error}"))?,
        };
        chosen.check()?;
        Ok(chosen)
    }

    /// Checks names that somebody chose.
    ///
    /// # Errors
    /// As [`Resources::chosen`].
    pub fn check(&self) -> Result<(), String> {
        let prefix = &self.prefix;
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !(prefix.len() >= MIN_PREFIX && prefix.chars().all(plain) && prefix.ends_with('_') && prefix != PREFIX) {
            return Err(format!(
                "--service-prefix {prefix:?} must have at least {MIN_PREFIX} letters, digits and '_', end with '_', and not be {PREFIX}: files that begin with it are removed after the run"
            ));
        }
        check_length(&self.root, prefix)?;
        check_root(&self.root)
    }

    /// Keeps the names for this run, for as long as what is given lives: a lock that the system lifts when its process ends,
    /// however it ends, and that is seen wherever /dev/shm is, also where process numbers are others.
    ///
    /// # Errors
    /// A sentence, if another run has them: its files would be taken for this one's, and removed.
    pub fn claim(&self) -> Result<Option<Claim>, String> {
        match Claim::take(&self.prefix, File::try_lock) {
            Err(TryLockError::WouldBlock) => Err(format!(
                "--service-prefix {} is another run's: wait for its end, or give this one a prefix of its own",
                self.prefix
            )),
            Ok(claim) => Ok(Some(claim)),
            // A system without such locks keeps nobody out; that is no reason not to run.
            Err(TryLockError::Error(_)) => Ok(None),
        }
    }

    /// New resources, named after this process and the moment.
    pub fn unique() -> Self {
        let id = format!("{}_{:x}", std::process::id(), anhyst_ipc::monotonic_ns());
        Self {
            prefix: format!("{PREFIX}{id}_"),
            root: user_root().join(id),
        }
    }

    /// Removes everything that bears the prefix. Only when no process of the run lives.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn remove(&self) -> std::io::Result<()> {
        // What cannot be removed keeps nothing else.
        let mut removed = Ok(());
        for entry in std::fs::read_dir("/dev/shm")? {
            let entry = entry?;
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                removed = removed.and(ignore_missing(std::fs::remove_file(entry.path())));
            }
        }
        removed.and(remove_within(&self.root, &self.prefix))
    }
}

/// The names of a run, kept for one who works under them.
#[derive(Debug)]
pub struct Claim {
    file: File,
    path: PathBuf,
}

impl Claim {
    /// For a process that was started by hand: several share a prefix. None if a launcher has the names, or without locks.
    pub fn shared(prefix: &str) -> Option<Self> {
        Self::take(prefix, File::try_lock_shared).ok()
    }

    fn take(prefix: &str, lock: impl Fn(&File) -> Result<(), TryLockError>) -> Result<Self, TryLockError> {
        let path = claim_path(prefix);
        loop {
            let options = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
            let file = options.map_err(TryLockError::Error)?;
            lock(&file)?;
            let claim = Self {
                file,
                path: path.clone(),
            };
            // Whoever had it may just have removed it.
            if claim.is_in_place() {
                return Ok(claim);
            }
        }
    }

    fn is_in_place(&self) -> bool {
        let number = |file: std::io::Result<Metadata>| file.ok().map(|file| file.ino());
        number(self.file.metadata()) == number(std::fs::metadata(&self.path))
    }

    /// True if somebody who lives works under the prefix; none if nobody ever said so.
    fn is_held(prefix: &str) -> Option<bool> {
        let file = File::open(claim_path(prefix)).ok()?;
        Some(matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Only the last one removes it.
        if self.file.try_lock().is_ok() && self.is_in_place() {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn claim_path(prefix: &str) -> PathBuf {
    Path::new("/dev/shm").join(format!("{prefix}claim"))
}

/// `nodes`, `services`, and a folder of digits for each node.
fn is_made_by_iceoryx2(folder: &str) -> bool {
    folder == "nodes" || folder == "services" || folder.bytes().all(|byte| byte.is_ascii_digit())
}

/// Removes from a run's directory what bears its prefix, and the directories that are empty then: a root that the user chose
/// may hold other things.
fn remove_within(folder: &Path, prefix: &str) -> std::io::Result<()> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        let (path, is_folder) = (entry.path(), entry.file_type()?.is_dir());
        match (is_folder, entry.file_name().to_string_lossy().starts_with(prefix)) {
            (true, true) => ignore_missing(std::fs::remove_dir_all(path))?,
            (true, false) if is_made_by_iceoryx2(&entry.file_name().to_string_lossy()) => remove_within(&path, prefix)?,
            (false, true) => ignore_missing(std::fs::remove_file(path))?,
            _ => {}
        }
    }
    match std::fs::remove_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::DirectoryNotEmpty => Ok(()),
        other => ignore_missing(other),
    }
}

fn ignore_missing(result: std::io::Result<()>) -> std::io::Result<()> {
    match result {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// What the channels of a run take of shared memory, in bytes: 5 MB by `du` while the recorder keeps up, and more behind it.
pub const SHARED_MEMORY_BYTES: u64 = 16 << 20;

/// Room in /dev/shm.
///
/// # Errors
/// A sentence, if it cannot be used or has too little left: iceoryx2 would be killed by signal 7 at the first page too many.
pub fn shared_memory_left() -> Result<u64, String> {
    let status = rustix::fs::statvfs("/dev/shm").map_err(|error| format!("/dev/shm cannot be used: {error}"))?;
    let free_bytes = status.f_bavail * status.f_frsize;
    if free_bytes < SHARED_MEMORY_BYTES {
        return Err(format!(
            "/dev/shm has {} left, and a run needs {}: enlarge it (`mount -o remount,size=64m /dev/shm`, in a container `--shm-size 64m`), or run with --embedded",
            mebibytes(free_bytes),
            mebibytes(SHARED_MEMORY_BYTES)
        ));
    }
    Ok(free_bytes)
}

/// Removes what crashed runs have left. What cannot be removed (another user's) stays: it harms no other run.
pub fn sweep() {
    for leftover in leftovers().unwrap_or_default() {
        let _ = leftover.remove();
    }
}

/// Resources of launchers that no longer live: prefix and root of each.
///
/// # Errors
/// If /dev/shm or the user's root cannot be listed.
pub fn leftovers() -> std::io::Result<Vec<Resources>> {
    let mut ids: Vec<String> = Vec::new();
    let mut note = |id: &str| {
        if !launcher_lives(id) && !ids.iter().any(|known| known == id) {
            ids.push(id.into());
        }
    };
    for name in names(Path::new("/dev/shm"))? {
        if let Some(rest) = name.strip_prefix(PREFIX) {
            let parts = if rest.starts_with(HAND) { 1 } else { 2 };
            note(&rest.split('_').take(parts).collect::<Vec<_>>().join("_"));
        }
    }
    for name in names(&user_root())? {
        note(&name);
    }
    Ok(ids
        .into_iter()
        .map(|id| Resources {
            prefix: format!("{PREFIX}{id}_"),
            root: user_root().join(id),
        })
        .collect())
}

fn names(folder: &Path) -> std::io::Result<Vec<String>> {
    match std::fs::read_dir(folder) {
        Ok(entries) => entries
            .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
            .collect(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

/// True if a run under this prefix goes on.
pub fn is_running(prefix: &str) -> bool {
    Claim::is_held(prefix).unwrap_or_default()
}

/// True if somebody holds the claim. An id begins with the launcher's process number; without a claim a program of ours with
/// that number counts, too.
fn launcher_lives(id: &str) -> bool {
    let pid = id.split('_').next().unwrap_or_default();
    if pid != HAND && (pid.is_empty() || !pid.bytes().all(|byte| byte.is_ascii_digit())) {
        // Not an id of ours (a prefix that a user chose): never touched.
        return true;
    }
    let comm = || std::fs::read_to_string(format!("/proc/{pid}/comm"));
    Claim::is_held(&format!("{PREFIX}{id}_")).unwrap_or_default() || comm().is_ok_and(|comm| comm.starts_with("anhyst"))
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards a run in a container that shares /dev/shm: its launcher has no process number here, and lives.
    #[test]
    fn a_run_is_told_from_leftovers_by_its_claim() {
        // No process has such a number.
        let id = format!("4294967295_{:x}", anhyst_ipc::monotonic_ns());
        let prefix = format!("{PREFIX}{id}_");
        let file = Path::new("/dev/shm").join(format!("{prefix}left"));
        std::fs::write(&file, b"").unwrap();
        let is_leftover = || leftovers().unwrap().iter().any(|leftover| leftover.prefix == prefix);
        let claim = Claim::take(&prefix, File::try_lock).unwrap();
        assert!(!is_leftover());
        assert!(Claim::shared(&prefix).is_none());
        drop(claim);
        assert!(is_leftover());
        let shared = [Claim::shared(&prefix).unwrap(), Claim::shared(&prefix).unwrap()];
        assert!(!is_leftover());
        drop(shared);
        assert!(!claim_path(&prefix).exists());
        std::fs::remove_file(file).unwrap();
    }
}
