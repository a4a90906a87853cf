//! What the logger thread does with a block: rows to every stream, status words to the watch, and the layout at both ends.

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

/// The far end of the pipe.
pub(crate) struct Logger {
    run: RunInfo,
    layout: Layout,
    /// As it is before anything is known: with what every part begins.
    arranged: Arranged,
    /// The file, then the server for live viewers.
    streams: Vec<Stream>,
    parts: Parts,
    watch: Watch,
    has: Option<Presence>,
    last_tick: u64,
    sizes: Sizes,
    verdict: Option<(Level, String)>,
    timing: Option<Timing>,
}

impl Logger {
    /// Creates the streams and sends the first layout, so that live viewers and files of killed runs have one.
    pub fn create(settings: &RecorderSettings, run: RunInfo) -> Result<Self, RecorderError> {
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
        let arranged = layout.arranged()?;
        for stream in &mut streams {
            arranged.send(&stream.rerun);
            stream.write()?;
        }
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
        Ok(Self {
            timing: run.realtime.then(Timing::new),
            parts: Parts::new(&run, settings),
            run,
            layout,
            arranged,
            streams,
            watch,
            has: None,
            last_tick: 0,
            sizes: Sizes::default(),
            verdict: None,
        })
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

    fn next_part(&mut self) -> Result<(), RecorderError> {
        let path = self.parts.next_path();
        self.streams[0].go_on(&self.run, &path)?;
        self.arranged.send(&self.streams[0].rerun);
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
        self.streams.iter().for_each(|stream| arranged.send(&stream.rerun));
        arranged.save(&self.run.path.with_extension("rbl"))
    }
}

impl Consumer for Logger {
    fn block(&mut self, block: &Block) -> Result<(), RecorderError> {
        let (Some(first), Some(last)) = (block.rows.first(), block.rows.last()) else {
            return Ok(());
        };
        if self.parts.is_over(self.last_tick) {
            self.next_part()?;
        }
        let has = *self.has.get_or_insert_with(|| Presence::of(&block.rows));
        if block.dropped_before > 0 {
            let lost = format!("recorder dropped {} ticks before this one", block.dropped_before);
            self.watch.about_run(first.tick, Level::Warning, lost);
        }
        for row in &block.rows {
            self.watch.row(row, has, &self.run);
            self.sizes.note(row, has, &self.run);
            if let Some(timing) = &mut self.timing {
                timing.row(row, &self.run);
            }
        }
        for stream in &mut self.streams {
            stream.rows(&self.run, has, &block.rows)?;
        }
        self.last_tick = last.tick;
        self.send_timing(false)?;
        self.parts.note(first.tick, block.rows.len(), self.watch.matters());
        self.send_events()?;
        self.streams.iter_mut().try_for_each(Stream::write)
    }

    fn verdict(&mut self, level: Level, text: String) {
        self.verdict = Some((level, text));
    }

    fn close(mut self, totals: Totals) -> Result<Kept, RecorderError> {
        let summed_up = self.sum_up(totals);
        self.streams.iter_mut().try_for_each(Stream::close)?;
        self.streams.clear();
        summed_up.map(|()| self.parts.kept())
    }
}
