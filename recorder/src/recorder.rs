//! The recorder as a block of the loop: it hears everything and says nothing.

use crate::pipe::{Pipe, PipeSettings};
use crate::run::Level;
use crate::streams::stretch;
use crate::writer::Logger;
use crate::{RecorderError, RecorderSettings, RunInfo};
use anhyst_ipc::{Block, Everything, NodeId};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What became of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecorderReport {
    /// Ticks recorded.
    pub rows: u64,
    /// Ticks that the logger could not take.
    pub dropped: u64,
    /// Size of all parts.
    pub bytes: u64,
    /// Files that it is in.
    pub parts: u64,
    /// Ticks of which the plots show the smallest and the largest value of each line.
    pub plotted_ticks: u64,
    /// Of the ticks recorded, those that a ring has left out again.
    pub removed_rows: u64,
}

type Slot = Arc<Mutex<Option<Result<RecorderReport, RecorderError>>>>;

/// The report of a recorder that was given away, for example into a node: filled when the recorder finishes or is dropped.
#[derive(Debug, Clone)]
pub struct Outcome(Slot);

impl Outcome {
    /// What became of the recording.
    ///
    /// # Errors
    /// What went wrong, or that the recorder still lives.
    pub fn report(&self) -> Result<RecorderReport, RecorderError> {
        let slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        slot.clone().unwrap_or(Err(RecorderError::StillOpen))
    }
}

/// Records every token of a run.
pub struct Recorder {
    pipe: Pipe,
    plotted_ticks: u64,
    outcome: Outcome,
}

impl Recorder {
    /// Creates the file, writes its head and layout, opens the port for live viewers, and starts the logger thread.
    ///
    /// # Errors
    /// If a setting is refused, the file cannot be created or the port is taken.
    pub fn create(settings: &RecorderSettings, run: RunInfo) -> Result<Self, RecorderError> {
        settings.validate()?;
        run.validate()?;
        let patience = if settings.lossless { settings.patience_s } else { 0.0 };
        let plotted_ticks = stretch(settings.plot_rate_hz, &run);
        let sent_ticks = sent_ticks(settings, &run);
        let block_ticks = (plotted_ticks * (HANDED_TICKS / plotted_ticks).max(1)).min(sent_ticks);
        let pipe_settings = PipeSettings {
            block_ticks,
            first_ticks: sent_ticks,
            blocks: settings.blocks * sent_ticks.div_ceil(block_ticks),
            ready: run.realtime,
            patience: Duration::from_secs_f64(patience),
        };
        let pipe = Pipe::start(pipe_settings, Logger::create(settings, run, sent_ticks)?)?;
        Ok(Self {
            pipe,
            plotted_ticks: plotted_ticks as u64,
            outcome: Outcome(Slot::default()),
        })
    }

    /// Where the report will be found once the recorder has finished or was dropped.
    pub fn outcome(&self) -> Outcome {
        self.outcome.clone()
    }

    /// Records a tick.
    #[inline]
    pub fn hear(&mut self, tick: u64, tokens: &Everything) {
        self.pipe.push(tick, tokens);
    }

    /// Says what the run came to, once: the first of its events. One that failed ([`Level::Error`]) is laid out for what failed.
    pub fn conclude(&mut self, level: Level, verdict: String) {
        self.pipe.tell(level, verdict);
    }

    /// Writes what is left, the last layout and the footer.
    ///
    /// # Errors
    /// The first error of the logger thread.
    pub fn finish(mut self) -> Result<RecorderReport, RecorderError> {
        self.close(true);
        self.outcome.report()
    }

    fn close(&mut self, finished: bool) {
        let mut slot = self.outcome.0.lock().unwrap_or_else(PoisonError::into_inner);
        if slot.is_none() {
            *slot = Some(self.pipe.close(finished).map(|(totals, kept)| RecorderReport {
                rows: totals.rows,
                dropped: totals.dropped,
                bytes: kept.bytes,
                parts: kept.parts,
                plotted_ticks: self.plotted_ticks,
                removed_rows: kept.removed_rows,
            }));
        }
    }
}

/// Ticks that go to the logger at a time, about: they fit into a core's own cache.
const HANDED_TICKS: usize = 500;

/// Ticks that are written at a time. Live viewers need the time before the cursor to move on by less than its length: the viewer draws the
/// data of one frame and the axis of the next, and a window that jumps past itself shows nothing.
fn sent_ticks(settings: &RecorderSettings, run: &RunInfo) -> usize {
    let quarter = (0.25 * run.zoom_s() / run.tick_s) as usize;
    if settings.live.is_some() {
        settings.block_ticks.min(quarter.max(16))
    } else {
        settings.block_ticks
    }
}

impl Drop for Recorder {
    /// A recorder that was not finished (a run that failed) still keeps what it heard.
    fn drop(&mut self) {
        self.close(false);
    }
}

impl Block for Recorder {
    const NODE: NodeId = NodeId::Recorder;
    type Inputs = Everything;
    type Outputs = ();

    fn step(&mut self, tick: u64, inputs: Self::Inputs) {
        self.hear(tick, &inputs);
    }
}
