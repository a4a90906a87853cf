//! A word in shared memory by which one process of ours wakes another: a system call each for who sleeps and who wakes (futex), where
//! an event of iceoryx2, a datagram, takes five.
//!
//! `/dev/shm/PREFIXwake_ROOT_PROCESS`, ROOT a fingerprint: its process keeps the file locked while it lives. Who has a word also rings those of
//! others, so who waits for a token of such a process sleeps by its word, and for those of all others by its event.

use super::status::{asleep, is_woken};
use crate::message::Channel;
use iceoryx2::prelude::{Node, ipc};
use memmap2::{MmapOptions, MmapRaw};
use rustix::thread::futex::{Flags, wait, wake};
use std::fs::{File, OpenOptions, TryLockError};
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use xxhash_rust::xxh3::xxh3_64;

/// How often it was rung, and what its process sleeps for, 0 while it is awake.
type Words = [AtomicU32; 2];

/// Of this process or of another.
pub struct WakeWord {
    map: MmapRaw,
    /// The own one: locked, and removed at the end.
    own: Option<(File, PathBuf)>,
}

fn path(node: &Node<ipc::Service>, process: &str) -> PathBuf {
    let global = &node.config().global;
    let root = xxh3_64(global.root_path().to_string().as_bytes()) as u32;
    Path::new("/dev/shm").join(format!("{}wake_{root:08x}_{process}", global.prefix))
}

impl WakeWord {
    /// That of this process; none where a process of its name has it already, or shared memory is refused: then its event wakes it.
    pub fn create(node: &Node<ipc::Service>, process: &str) -> Option<Self> {
        let path = path(node, process);
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(&path)
            .ok()?;
        file.try_lock().ok()?;
        // Written, not made long: where shared memory is full, this says so, and a touch of the map would kill.
        file.write_all_at(&[0; size_of::<Words>()], 0).ok()?;
        let map = MmapOptions::new().len(size_of::<Words>()).map_raw(&file).ok()?;
        Some(Self {
            map,
            own: Some((file, path)),
        })
    }

    /// That of another process; none if it has none.
    pub fn of(node: &Node<ipc::Service>, process: &str) -> Option<Self> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .open(path(node, process))
            .ok()?;
        let is_held = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
            && file.metadata().ok()?.len() >= size_of::<Words>() as u64;
        let map = MmapOptions::new().len(size_of::<Words>()).map_raw(&file).ok()?;
        is_held.then_some(Self { map, own: None })
    }

    fn words(&self) -> &Words {
        // SAFETY: the map begins at a page, is as long as the words, and lives as long as `self`; whoever maps it has atomics there. Its
        // file has its length before anybody maps it.
        unsafe { &*self.map.as_ptr().cast::<Words>() }
    }

    /// How often it was rung so far.
    pub fn rung(&self) -> u32 {
        self.words()[0].load(Ordering::SeqCst)
    }

    /// Its process sleeps until a token comes on this channel.
    pub fn fall_asleep(&self, channel: Channel) {
        self.words()[1].store(asleep(Some(channel)) as u32, Ordering::SeqCst);
    }

    pub fn wake_up(&self) {
        self.words()[1].store(0, Ordering::SeqCst);
    }

    /// Sleeps until it was rung more often than `before`, at most so long, or until a signal. False once the time is over.
    pub fn wait(&self, before: u32, limit: Duration) -> bool {
        if limit.is_zero() {
            return self.rung() != before;
        }
        let limit = limit.try_into().unwrap_or_default();
        let waited = wait(&self.words()[0], Flags::empty(), before, Some(&limit));
        waited != Err(rustix::io::Errno::TIMEDOUT)
    }

    /// Wakes its process if it sleeps for a token on this channel.
    pub fn ring(&self, channel: Channel) -> rustix::io::Result<()> {
        let [rung, sleeps] = self.words();
        if !is_woken(sleeps.load(Ordering::SeqCst).into(), channel) {
            return Ok(());
        }
        rung.fetch_add(1, Ordering::SeqCst);
        wake(rung, Flags::empty(), 1).map(|_| ())
    }
}

impl Drop for WakeWord {
    fn drop(&mut self) {
        if let Some((_, path)) = &self.own {
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::iceoryx::create_node;
    use super::*;
    use std::time::Instant;

    // Guards whose words are believed: none that nobody holds (its process was killed), none twice, and none that was left.
    #[test]
    fn a_word_is_that_of_a_process_that_lives() {
        let root = std::env::temp_dir().join(format!("anhyst_word_{}", std::process::id()));
        let prefix = format!("word{}_", std::process::id());
        let node = create_node(&prefix, &root, "test").unwrap();
        let file = path(&node, "guard");
        // One is just being made.
        let empty = File::create(&file).unwrap();
        empty.lock().unwrap();
        assert!(WakeWord::of(&node, "guard").is_none());
        drop(empty);
        std::fs::write(&file, [7; 8]).unwrap();
        assert!(WakeWord::of(&node, "guard").is_none());
        let own = WakeWord::create(&node, "guard").unwrap();
        assert!(WakeWord::create(&node, "guard").is_none());
        let of_peer = WakeWord::of(&node, "guard").unwrap();
        // Nobody sleeps: nobody is woken.
        let before = own.rung();
        of_peer.ring(Channel::Demand).unwrap();
        assert_eq!(own.rung(), before);
        own.fall_asleep(Channel::Demand);
        of_peer.ring(Channel::Estimate).unwrap();
        assert!(!own.wait(before, Duration::from_millis(5)));
        let begin = Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(20));
                of_peer.ring(Channel::Demand).unwrap();
            });
            assert!(own.wait(before, Duration::from_secs(20)));
        });
        assert!(own.rung() != before && begin.elapsed() < Duration::from_secs(20));
        drop(own);
        assert!(!file.exists() && WakeWord::of(&node, "guard").is_none());
        drop(node);
        let _ = std::fs::remove_dir_all(root);
        // What iceoryx2 leaves.
        for left in std::fs::read_dir("/dev/shm").unwrap().flatten() {
            if left.file_name().to_string_lossy().starts_with(&prefix) {
                let _ = std::fs::remove_file(left.path());
            }
        }
    }
}
