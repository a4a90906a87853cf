//! The way from the loop to the logger: a fixed number of blocks circulates, full ones forward, empty ones back. The loop waits at most
//! once, for a limited time, when it may wait at all. A block is taken again as soon as it is back, so that as long as the logger
//! follows, few are ever needed and these are still in the caches.

use crate::RecorderError;
use crate::parts::Kept;
use crate::row::Block;
use crate::run::Level;
use anhyst_ipc::Everything;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// What stands at the end of the pipe, in a thread of its own.
pub(crate) trait Consumer: Send + 'static {
    /// Takes one block.
    fn block(&mut self, block: &Block) -> Result<(), RecorderError>;
    /// Hears what the run came to, before it is closed.
    fn verdict(&mut self, _level: Level, _text: String) {}
    /// Closes. `finished` tells an orderly end from a dropped recorder.
    fn close(self, totals: Totals) -> Result<Kept, RecorderError>;
}

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Totals {
    /// Rows handed over.
    pub rows: u64,
    /// Rows dropped.
    pub dropped: u64,
    /// True if the recorder was told to finish.
    pub finished: bool,
}

/// Room of a pipe and its manners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PipeSettings {
    /// Ticks of a block, and of the first one, which shows what a run has.
    pub block_ticks: usize,
    pub first_ticks: usize,
    pub blocks: usize,
    /// All blocks are there before the first tick: the loop never allocates.
    pub ready: bool,
    /// How long to wait, once, for a consumer that cannot follow.
    pub patience: Duration,
}

enum Parcel {
    Block(Block),
    Verdict(Level, String),
    End(Totals),
}

/// The loop's end of the pipe.
pub(crate) struct Pipe {
    full: SyncSender<Parcel>,
    empty: Receiver<Block>,
    /// Empty blocks, the one that came back last on top, and how many may still be made.
    spare: Vec<Block>,
    unmade: usize,
    current: Option<Block>,
    /// Ticks of the next block, and of those after it.
    room: usize,
    block_ticks: usize,
    patience: Duration,
    totals: Totals,
    dropped_since_block: u64,
    logger: Option<JoinHandle<Result<Kept, RecorderError>>>,
}

impl Pipe {
    /// Takes all memory and starts the logger thread.
    pub fn start(settings: PipeSettings, consumer: impl Consumer) -> Result<Self, RecorderError> {
        let blocks = settings.blocks;
        // Room for every block, the verdict and the end, so that handing over never waits.
        let (full, from_loop) = sync_channel(blocks + 2);
        let (to_loop, empty) = sync_channel(blocks);
        let mut spare = Vec::with_capacity(blocks);
        if settings.ready {
            spare.extend((1..blocks).map(|_| Block::new(settings.block_ticks)));
        }
        let unmade = blocks - 1 - spare.len();
        // On top.
        spare.push(Block::new(settings.first_ticks));
        let logger = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || {
                keep_freed_memory();
                log(consumer, &from_loop, &to_loop)
            })
            .map_err(|error| RecorderError::Write {
                what: "anything".into(),
                cause: error.to_string(),
            })?;
        Ok(Self {
            full,
            empty,
            spare,
            unmade,
            current: None,
            room: settings.first_ticks,
            block_ticks: settings.block_ticks,
            patience: settings.patience,
            totals: Totals::default(),
            dropped_since_block: 0,
            logger: Some(logger),
        })
    }

    /// Appends the tokens of one tick.
    #[inline]
    pub fn push(&mut self, tick: u64, tokens: &Everything) {
        if self.current.is_none() {
            self.current = self.next_block();
        }
        let Some(block) = &mut self.current else {
            self.dropped_since_block += 1;
            self.totals.dropped += 1;
            return;
        };
        if !block.push(tick, tokens) {
            self.hand_over();
        }
    }

    fn next_block(&mut self) -> Option<Block> {
        self.spare.extend(self.empty.try_iter());
        let mut block = self.spare.pop();
        if block.is_none() && self.unmade > 0 {
            self.unmade -= 1;
            block = Some(Block::new(self.block_ticks));
        }
        if block.is_none() && !self.patience.is_zero() {
            block = self.empty.recv_timeout(self.patience).ok();
            if block.is_none() {
                // It had its chance: a loop that waited at every block would take hours to end.
                self.patience = Duration::ZERO;
            }
        }
        let mut block = block?;
        let room = std::mem::replace(&mut self.room, self.block_ticks);
        block.reuse(room, std::mem::take(&mut self.dropped_since_block));
        Some(block)
    }

    fn hand_over(&mut self) {
        let Some(block) = self.current.take() else { return };
        let rows = block.rows().len() as u64;
        if rows > 0 && self.full.try_send(Parcel::Block(block)).is_ok() {
            self.totals.rows += rows;
        } else {
            self.totals.dropped += rows;
        }
    }

    /// Hands over what the run came to.
    pub fn tell(&mut self, level: Level, text: String) {
        // Refused only if the logger is gone, or was told before.
        let _ = self.full.try_send(Parcel::Verdict(level, text));
    }

    /// Hands over what is left and waits for the logger's end.
    pub fn close(&mut self, finished: bool) -> Result<(Totals, Kept), RecorderError> {
        let Some(logger) = self.logger.take() else {
            return Ok((self.totals, Kept::default()));
        };
        self.hand_over();
        self.totals.finished = finished;
        // Refused only if the logger is gone, which joining it reports.
        let _ = self.full.try_send(Parcel::End(self.totals));
        let kept = logger.join().map_err(|_| RecorderError::LoggerDied)??;
        Ok((self.totals, kept))
    }
}

/// The logger thread. After the first error it goes on taking blocks, so that the loop sees no difference.
/// Every block takes and frees the same megabytes. Given back to the system in between, they come back as pages to be cleared: half of
/// the logger's time.
fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: sets two numbers of the allocator.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 32 << 20);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 256 << 20);
    }
}

fn log(mut consumer: impl Consumer, full: &Receiver<Parcel>, empty: &SyncSender<Block>) -> Result<Kept, RecorderError> {
    let mut outcome = Ok(());
    let mut totals = Totals::default();
    for parcel in full {
        match parcel {
            Parcel::Block(block) => {
                if outcome.is_ok() {
                    outcome = consumer.block(&block);
                }
                // Refused only if the loop is gone.
                let _ = empty.try_send(block);
            }
            Parcel::Verdict(level, text) => consumer.verdict(level, text),
            Parcel::End(end) => {
                totals = end;
                break;
            }
        }
    }
    let closed = consumer.close(totals);
    outcome.and(closed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_ipc::Now;
    use std::sync::{Arc, Mutex};
    use std::time::Instant;

    fn silence() -> Everything {
        let (a, b, c, d, e, f, g) = Default::default();
        (Now(a), Now(b), Now(c), Now(d), Now(e), Now(f), Now(g))
    }

    struct Slow {
        pause: Duration,
        seen: Arc<Mutex<Vec<(u64, u64)>>>,
    }

    impl Consumer for Slow {
        fn block(&mut self, block: &Block) -> Result<(), RecorderError> {
            std::thread::sleep(self.pause);
            let mut seen = self.seen.lock().unwrap();
            seen.extend(block.rows().iter().map(|row| (row.tick, block.dropped_before)));
            Ok(())
        }
        fn close(self, _: Totals) -> Result<Kept, RecorderError> {
            Ok(Kept::default())
        }
    }

    fn run(pause_ms: u64, patience_ms: u64, ticks: u64) -> (Totals, Vec<(u64, u64)>, Duration) {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let consumer = Slow {
            pause: Duration::from_millis(pause_ms),
            seen: seen.clone(),
        };
        let patience = Duration::from_millis(patience_ms);
        let mut pipe = Pipe::start(
            PipeSettings {
                block_ticks: 10,
                first_ticks: 10,
                blocks: 2,
                ready: ticks.is_multiple_of(2),
                patience,
            },
            consumer,
        )
        .unwrap();
        let start = Instant::now();
        (0..ticks).for_each(|tick| pipe.push(tick, &silence()));
        let pushing = start.elapsed();
        let (totals, _) = pipe.close(true).unwrap();
        let seen = std::mem::take(&mut *seen.lock().unwrap());
        (totals, seen, pushing)
    }

    /// Guards: a logger that cannot follow costs rows, each of them counted, and no time.
    #[test]
    fn a_slow_logger_drops_and_counts_but_never_holds_up_the_loop() {
        let (totals, seen, pushing) = run(300, 0, 1000);
        assert!(
            pushing < Duration::from_millis(200),
            "the loop was held up for {pushing:?}"
        );
        assert!(totals.dropped >= 900, "{totals:?}");
        assert_eq!(totals.rows + totals.dropped, 1000);
        assert_eq!(seen.len() as u64, totals.rows);
    }

    /// Guards: with patience nothing is lost, in order.
    #[test]
    fn a_patient_loop_loses_nothing() {
        let (totals, seen, _) = run(2, 5000, 105);
        assert_eq!((totals.rows, totals.dropped), (105, 0));
        assert!(seen.iter().map(|(tick, _)| *tick).eq(0..105));
    }

    /// Guards: patience ends. A stuck logger is waited for once, not at every block.
    #[test]
    fn patience_is_spent_once() {
        let (totals, _, pushing) = run(1000, 50, 500);
        assert!(
            pushing < Duration::from_millis(300),
            "the loop was held up for {pushing:?}"
        );
        assert!(totals.dropped > 0 && totals.rows + totals.dropped == 500);
    }

    /// Guards: the block after a gap says how many rows are missing before it.
    #[test]
    fn a_gap_is_told_to_the_logger() {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let consumer = Slow {
            pause: Duration::from_millis(50),
            seen: seen.clone(),
        };
        let settings = PipeSettings {
            block_ticks: 10,
            first_ticks: 10,
            blocks: 2,
            ready: true,
            patience: Duration::ZERO,
        };
        let mut pipe = Pipe::start(settings, consumer).unwrap();
        (0..50).for_each(|tick| pipe.push(tick, &silence()));
        std::thread::sleep(Duration::from_millis(200));
        (50..55).for_each(|tick| pipe.push(tick, &silence()));
        let (totals, _) = pipe.close(true).unwrap();
        assert_eq!((totals.rows, totals.dropped), (25, 30));
        assert_eq!(seen.lock().unwrap().last(), Some(&(54, 30)));
    }
}
