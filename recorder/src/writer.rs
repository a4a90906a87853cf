//! What the logger thread does with a block: rows to every stream, status words to the watch, and the layout at both ends. Blocks are as
//! small as a cache; what comes of several is written at a time.

use crate::events::Watch;
use crate::fitting::Sizes;
use crate::layout::Arranged;
use crate::parts::{Kept, Parts};
use crate::pipe::{Consumer, Totals};
use crate::row::{Block, Presence};
use crate::run::Level;
use crate::streams::{Stream, stretch};
use crate::timing::Timing;
use crate::views::Layout;
use crate::{RecorderError, RecorderSettings, RunInfo};
use std::time::{Duration, Instant};

/// Blocks that are drawn at a time, where no clock on the wall and no live viewer follows: of what is drawn, a chunk costs more than the
/// rows in it that come of a block.
const DRAWN_BLOCKS: usize = 10;

/// After so long a file is laid out, for the case that its run is killed. Of one that ends before, the layout that fits it is enough:
/// it takes as long to make as twenty thousand ticks take to write.
const UNARRANGED: Duration = Duration::from_secs(1);

/// The far end of the pipe.
pub(crate) struct Logger {
    run: RunInfo,
    layout: Layout,
    /// As it is before anything is known, once it was needed.
    first: Option<Arranged>,
    /// Whether the file is laid out, and since when it waits for that.
    laid_out: bool,
    begun: Instant,
    /// The file, then the server for live viewers.
    streams: Vec<Stream>,
    parts: Parts,
    watch: Watch,
    has: Option<Presence>,
    last_tick: u64,
    /// Rows that wait to be sent: the first one's tick, and how many; and how many are sent at a time.
    waiting: Option<(u64, usize)>,
    sent_ticks: usize,
    /// Blocks of them that are drawn at a time, and those that are not yet.
    drawn_blocks: usize,
    undrawn_blocks: usize,
    sizes: Sizes,
    verdict: Option<(Level, String)>,
    timing: Option<Timing>,
}

impl Logger {
    /// Creates the streams. Live viewers get a layout at once.
    pub fn create(settings: &RecorderSettings, run: RunInfo, sent_ticks: usize) -> Result<Self, RecorderError> {
        // The port first: if it is taken, no file is overwritten.
        let live = settings
            .live
            .map(|port| Stream::live(&run, settings, port))
            .transpose()?;
        let mut streams: Vec<_> = std::iter::once(Stream::file(&run, settings)?).chain(live).collect();
        let layout = Layout {
            zoom_s: run.zoom_s(),
            scales: run.scales.clone(),
            // Stated in nm, whatever is drawn in.
            error_axis: settings.error_axis_nm.map(|nm| nm * (run.scales.error.factor * 1e-9)),
            timed: run.realtime,
            tolerance: run.tolerance_m * run.scales.error.factor,
            shows_field_limit: true,
            shows_shape_range: true,
            shows_parameters: false,
        };
        streams.iter_mut().try_for_each(Stream::write)?;
        let mut watch = Watch::default();
        let tick_us = run.tick_s * 1e6;
        watch.about_run(
            0,
            Level::Info,
            format!(
                "{} starts: {} (tick {tick_us} µs; plots show the smallest and the largest of every {} ticks, tokens are whole)",
                run.run_id,
                run.name,
                stretch(settings.plot_rate_hz, &run)
            ),
        );
        let mut logger = Self {
            timing: run.realtime.then(Timing::new),
            parts: Parts::new(&run, settings),
            layout,
            first: None,
            laid_out: false,
            begun: Instant::now(),
            streams,
            watch,
            has: None,
            last_tick: 0,
            waiting: None,
            sent_ticks,
            drawn_blocks: if run.realtime || settings.live.is_some() {
                1
            } else {
                DRAWN_BLOCKS
            },
            undrawn_blocks: 0,
            sizes: Sizes::default(),
            verdict: None,
            run,
        };
        // Live viewers have nothing else to go by.
        (1..logger.streams.len()).try_for_each(|stream| logger.arrange(stream))?;
        Ok(logger)
    }

    fn send_timing(&mut self, always: bool) -> Result<(), RecorderError> {
        let streams: Vec<_> = self.streams.iter().map(|stream| &stream.rerun).collect();
        let (run, tick) = (&self.run, self.last_tick);
        self.timing
            .as_mut()
            .map_or(Ok(()), |timing| timing.send(&streams, run, tick, always))
    }

    fn send_events(&mut self) -> Result<(), RecorderError> {
        for stream in &self.streams {
            stream.events(&self.run, &self.watch.events, &self.watch.changes)?;
        }
        self.watch.events.clear();
        self.watch.changes.clear();
        Ok(())
    }

    /// Lays a stream out by what is known before anything is.
    fn arrange(&mut self, stream: usize) -> Result<(), RecorderError> {
        let arranged = match self.first.take() {
            Some(arranged) => arranged,
            None => self.layout.arranged()?,
        };
        self.streams[stream].arrange(self.first.insert(arranged))
    }

    /// Writes the tokens that wait, and what is drawn of them if it is due or `all` is to be written.
    fn send(&mut self, all: bool) -> Result<(), RecorderError> {
        if let Some((first_tick, rows)) = self.waiting.take() {
            self.streams
                .iter_mut()
                .try_for_each(|stream| stream.send_tokens(&self.run))?;
            self.parts.note(first_tick, rows, self.watch.matters());
            self.undrawn_blocks += 1;
        }
        if !self.laid_out && self.begun.elapsed() > UNARRANGED {
            self.laid_out = true;
            self.arrange(0)?;
        }
        if all || self.undrawn_blocks >= self.drawn_blocks || self.watch.matters() {
            self.undrawn_blocks = 0;
            let all = all || self.drawn_blocks == 1 || self.watch.matters();
            self.streams
                .iter_mut()
                .try_for_each(|stream| stream.send_drawn(&self.run, all))?;
            self.send_timing(false)?;
            self.send_events()?;
            self.streams.iter_mut().try_for_each(Stream::write)?;
        }
        Ok(())
    }

    fn next_part(&mut self) -> Result<(), RecorderError> {
        self.send(true)?;
        let path = self.parts.next_path();
        self.streams[0].go_on(&self.run, &path)?;
        self.arrange(0)?;
        self.laid_out = true;
        self.watch.tell_states_again();
        self.parts.turn()
    }

    /// Says how the run ended, and chooses the height of the error plot now that the errors are known.
    fn sum_up(&mut self, totals: Totals) -> Result<(), RecorderError> {
        let (rows, dropped, seconds) = (totals.rows, totals.dropped, totals.rows as f64 * self.run.tick_s);
        let (level, end) = if totals.finished {
            (Level::Info, "ended")
        } else {
            (Level::Warning, "not finished, recording ended")
        };
        self.watch.about_run(
            self.last_tick,
            if dropped > 0 { Level::Warning } else { level },
            format!(
                "{end} after {rows} ticks ({seconds:.3} s), {dropped} dropped; largest error after settling {:.1} {}",
                self.sizes.largest_error_m() * self.run.scales.error.factor,
                self.run.scales.error.unit
            ),
        );
        let failed = matches!(self.verdict, Some((Level::Error, _)));
        if let Some((level, text)) = self.verdict.take() {
            self.watch.judge(level, text);
        }
        self.send_events()?;
        self.send_timing(true)?;
        self.sizes.fit(&mut self.layout, &self.run, failed);
        let arranged = self.layout.arranged()?;
        self.streams
            .iter_mut()
            .try_for_each(|stream| stream.arrange(&arranged))?;
        arranged.save(&self.run.path.with_extension("rbl"))
    }
}

impl Consumer for Logger {
    fn block(&mut self, block: &Block) -> Result<(), RecorderError> {
        let rows = block.rows();
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
            return Ok(());
        };
        if self.waiting.is_none() && self.parts.is_over(self.last_tick) {
            self.next_part()?;
        }
        let has = *self.has.get_or_insert_with(|| Presence::of(rows));
        if block.dropped_before > 0 {
            let lost = format!("recorder dropped {} ticks before this one", block.dropped_before);
            self.watch.about_run(first.tick, Level::Warning, lost);
        }
        self.watch.rows(rows, has, &self.run);
        for row in rows {
            self.sizes.note(row, has, &self.run);
            if let Some(timing) = &mut self.timing {
                timing.row(row, &self.run);
            }
        }
        for stream in &mut self.streams {
            stream.rows(&self.run, has, rows)?;
        }
        self.last_tick = last.tick;
        let (begun, waiting) = self.waiting.unwrap_or((first.tick, 0));
        self.waiting = Some((begun, waiting + rows.len()));
        if waiting + rows.len() >= self.sent_ticks {
            self.send(false)?;
        }
        Ok(())
    }

    fn verdict(&mut self, level: Level, text: String) {
        self.verdict = Some((level, text));
    }

    fn close(mut self, totals: Totals) -> Result<Kept, RecorderError> {
        let summed_up = self.send(true).and_then(|()| self.sum_up(totals));
        self.streams.iter_mut().try_for_each(Stream::close)?;
        self.streams.clear();
        summed_up.map(|()| self.parts.kept())
    }
}
