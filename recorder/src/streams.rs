//! The streams of a run: the file, which gets everything, and the server for live viewers, which gets thinned plots only,
//! because viewers keep all they are sent in memory.

use crate::error::Writing as _;
use crate::events::{Event, StateChange, VERDICT};
use crate::extremes::{Column, kept_rows};
use crate::file::File;
use crate::flags::{FLAGS, LANES};
use crate::layout::{APPLICATION, Arranged};
use crate::loops::Loops;
use crate::plots::{PLOTS, Plot, Series, present};
use crate::row::{Presence, Row};
use crate::run::Level;
use crate::tokens::{self, TICK_ENTITY, TIMELINE, Tokens, chunk};
use crate::{RecorderError, RecorderSettings, RunInfo};
use rerun::external::arrow::array::Float64Array;
use rerun::log::{Chunk, TimeColumn};
use rerun::{RecordingStream, RecordingStreamBuilder, SerializedComponentBatch};
use rerun_types::archetypes::{Scalars, SeriesLines, TextLog};
use rerun_types::components::Color;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Rows that fit into the nearest cache.
const NEAR: usize = 32;
/// What live viewers may find of the past when they join.
const LIVE_MEMORY: &str = "200MB";
/// How long the end of a run waits for live viewers.
const FLUSH_LIMIT: Duration = Duration::from_secs(60);

/// One stream and what is drawn on it.
pub(crate) struct Stream {
    pub rerun: RecordingStream,
    /// Ticks of which a plot shows the extremes.
    stretch: usize,
    /// Where all tokens go; live viewers get none.
    file: Option<(File, Tokens)>,
    drawn: Option<Drawn>,
}

/// What a stream draws; known when the first rows show what the run has.
struct Drawn {
    plots: Vec<Drawing>,
    /// Of the rows of the plots that wait to be sent.
    times_ns: Vec<i64>,
    /// First and last tick of what waits of constant lines.
    ends: Option<[u64; 2]>,
    loops: Loops,
}

/// One plot being drawn.
struct Drawing {
    plot: &'static Plot,
    series: Vec<&'static Series>,
    /// Rows that wait to be sent.
    values: Vec<f64>,
}

fn builder(run: &RunInfo) -> RecordingStreamBuilder {
    // Enabled whatever `RERUN=off` says: the scenario asked for a recording.
    RecordingStreamBuilder::new(APPLICATION)
        .recording_id(run.run_id.as_str())
        .recording_name(run.name.as_str())
        .send_properties(true)
        .enabled(true)
}

impl Drawn {
    /// Writes how all of it looks.
    fn declare(&self, stream: &RecordingStream, run: &RunInfo) -> Result<(), RecorderError> {
        for Drawing { plot, series, .. } in &self.plots {
            let style = SeriesLines::new()
                .with_names(series.iter().map(|series| series.name))
                .with_colors(series.iter().map(|series| Color::from_u32(series.color)))
                .with_widths(series.iter().map(|series| series.width));
            stream.log_static(plot.entity, &style).writing(plot.entity)?;
        }
        self.loops.declare(stream, &run.scales)
    }

    /// Draws rows, thinned by `stretch`.
    fn rows(&mut self, run: &RunInfo, rows: &[Row], stretch: usize) {
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
            return;
        };
        let begun = self.ends.map_or(first.tick, |[begun, _]| begun);
        self.ends = Some([begun, last.tick]);
        // So few that all series find them in the nearest cache.
        for rows in rows.chunks(stretch * NEAR.div_ceil(stretch)) {
            let times = kept_rows(rows.len(), stretch).map(|row| run.time_ns(rows[row].tick));
            let before = self.times_ns.len();
            self.times_ns.extend(times);
            let kept = self.times_ns.len() - before;
            for Drawing { series, values, .. } in self.plots.iter_mut().filter(|own| !own.plot.constant) {
                let (begun, width) = (values.len(), series.len());
                values.resize(begun + kept * width, f64::NAN);
                for (column, series) in series.iter().enumerate() {
                    let mut column = Column::new(&mut values[begun..], column, width);
                    (series.draw)(rows, run, stretch, &mut column);
                }
            }
        }
        self.loops.rows(run, rows);
    }

    /// Takes what waits, but for the loops; of constant lines only where they end if `all` is asked for.
    fn take(&mut self, run: &RunInfo, all: bool) -> Result<Vec<Chunk>, RecorderError> {
        let Some(ends) = self.ends else {
            return Ok(Vec::new());
        };
        if all {
            self.ends = None;
        }
        let times = TimeColumn::new_duration_nanos(TIMELINE, self.times_ns.drain(..));
        let ends = times_of(run, ends.into_iter());
        let due = |own: &Drawing| if own.plot.constant { all } else { !own.values.is_empty() };
        let due = self.plots.iter_mut().filter(|own| due(own));
        let taken = due.map(|Drawing { plot, series, values }| {
            let times = if plot.constant { &ends } else { &times };
            if plot.constant {
                let rows = [Row::default(); 2];
                values.resize(rows.len() * series.len(), f64::NAN);
                for (column, own) in series.iter().enumerate() {
                    (own.draw)(&rows, run, 1, &mut Column::new(values, column, series.len()));
                }
            }
            let (rows, room) = (values.len() / series.len(), values.len());
            let values = std::mem::replace(values, Vec::with_capacity(room));
            let values = Arc::new(Float64Array::from(values));
            let column = SerializedComponentBatch::new(values, Scalars::descriptor_scalars())
                .partitioned(std::iter::repeat_n(series.len(), rows))
                .writing(plot.entity)?;
            chunk(plot.entity, times.clone(), column)
        });
        taken.collect()
    }
}

impl Stream {
    /// Creates the file.
    pub fn file(run: &RunInfo, settings: &RecorderSettings) -> Result<Self, RecorderError> {
        let file = File::create(builder(run), &run.path)?;
        let stream = file.stream();
        Self::create(stream, settings.plot_rate_hz, Some((file, Tokens::new())), run)
    }

    /// Closes the file and goes on in another one.
    pub fn go_on(&mut self, run: &RunInfo, path: &Path) -> Result<(), RecorderError> {
        self.file.as_mut().map_or(Ok(()), |(file, _)| file.go_on(path))?;
        self.declare(run)?;
        self.drawn
            .as_ref()
            .map_or(Ok(()), |drawn| drawn.declare(&self.rerun, run))
    }

    /// Opens the port for live viewers.
    pub fn live(run: &RunInfo, settings: &RecorderSettings, port: u16) -> Result<Self, RecorderError> {
        let refuse = |cause: String| RecorderError::Live { port, cause };
        // The server's own thread would only complain to the log.
        std::net::TcpListener::bind(("127.0.0.1", port)).map_err(|error| refuse(error.to_string()))?;
        let memory_limit = rerun::MemoryLimit::parse(LIVE_MEMORY).map_err(refuse)?;
        let options = rerun::ServerOptions {
            memory_limit,
            ..Default::default()
        };
        let rerun = builder(run)
            .serve_grpc_opts("127.0.0.1", port, options)
            .map_err(|error| refuse(error.to_string()))?;
        Self::create(rerun, settings.live_rate_hz, None, run)
    }

    fn create(
        rerun: RecordingStream,
        rows_per_second: f64,
        file: Option<(File, Tokens)>,
        run: &RunInfo,
    ) -> Result<Self, RecorderError> {
        rerun.set_log_time_enabled(false);
        let stream = Self {
            rerun,
            stretch: stretch(rows_per_second, run),
            file,
            drawn: None,
        };
        stream.declare(run)?;
        Ok(stream)
    }

    /// Writes what is known before the first tick: names, styles, notes.
    fn declare(&self, run: &RunInfo) -> Result<(), RecorderError> {
        let stream = &self.rerun;
        if self.file.is_some() {
            stream
                .log_static(TICK_ENTITY, &Scalars::single(run.tick_s))
                .writing("the tick")?;
            tokens::declare(stream)?;
        }
        let notes = format!("# {}\n\n{}", run.name, run.notes);
        stream
            .log_static("notes", &rerun_types::archetypes::TextDocument::from_markdown(notes))
            .writing("the notes")?;
        for (channel, idle) in LANES {
            let flags = FLAGS.iter().filter(|flag| flag.channel == channel);
            let states = std::iter::once((idle, None)).chain(flags.map(|flag| (flag.state, Some(flag.level))));
            let (values, colors): (Vec<_>, Vec<_>) = states.map(|(state, level)| (state, state_color(level))).unzip();
            let looks = rerun_types::archetypes::StateConfiguration::new()
                .with_values(values)
                .with_colors(colors);
            stream
                .log_static(lane_entity(channel), &looks)
                .writing("the looks of the states")?;
        }
        stream.flush_blocking().writing("the head")
    }

    /// Lays it out.
    pub fn arrange(&mut self, layout: &Arranged) -> Result<(), RecorderError> {
        match &mut self.file {
            Some((file, _)) => file.arrange(layout),
            None => {
                layout.send(&self.rerun);
                Ok(())
            }
        }
    }

    /// Sends on what was logged.
    pub fn write(&mut self) -> Result<(), RecorderError> {
        self.file.as_mut().map_or(Ok(()), |(file, _)| file.write())
    }

    /// Sends on what was logged, and no more.
    pub fn close(&mut self) -> Result<(), RecorderError> {
        match &mut self.file {
            Some((file, _)) => file.close(),
            None => self.rerun.flush_with_timeout(FLUSH_LIMIT).writing("the end of the run"),
        }
    }

    fn draw(&mut self, run: &RunInfo, has: Presence) -> Result<&mut Drawn, RecorderError> {
        let drawn = match self.drawn.take() {
            Some(drawn) => drawn,
            None => {
                let drawings = PLOTS.iter().map(|plot| Drawing {
                    plot,
                    series: present(plot, has).collect(),
                    values: Vec::new(),
                });
                let drawn = Drawn {
                    plots: drawings.filter(|drawing| !drawing.series.is_empty()).collect(),
                    times_ns: Vec::new(),
                    ends: None,
                    loops: Loops::new(run, has),
                };
                drawn.declare(&self.rerun, run)?;
                drawn
            }
        };
        Ok(self.drawn.insert(drawn))
    }

    /// Takes rows, which wait to be sent.
    pub fn rows(&mut self, run: &RunInfo, has: Presence, rows: &[Row]) -> Result<(), RecorderError> {
        if let Some((_, tokens)) = &mut self.file {
            tokens.add(rows);
        }
        let stretch = self.stretch;
        self.draw(run, has)?.rows(run, rows, stretch);
        Ok(())
    }

    /// Sends the tokens that wait.
    pub fn send_tokens(&mut self, run: &RunInfo) -> Result<(), RecorderError> {
        let Some((file, tokens)) = &mut self.file else {
            return Ok(());
        };
        file.send(&tokens.take(run)?)
    }

    /// Sends what is drawn and waits; constant lines with `all` that waits.
    pub fn send_drawn(&mut self, run: &RunInfo, all: bool) -> Result<(), RecorderError> {
        let Some(drawn) = &mut self.drawn else { return Ok(()) };
        for chunk in drawn.take(run, all)? {
            match &mut self.file {
                Some((file, _)) => file.send(&chunk)?,
                None => self.rerun.send_chunk(chunk),
            }
        }
        drawn.loops.send(&self.rerun, run)
    }

    /// Writes events and state changes.
    pub fn events(&self, run: &RunInfo, events: &[Event], changes: &[StateChange]) -> Result<(), RecorderError> {
        let mut sources: Vec<_> = events.iter().map(|event| event.source).collect();
        sources.sort_unstable();
        sources.dedup();
        for source in sources {
            let of_source = || events.iter().filter(|event| event.source == source);
            let columns = TextLog::update_fields()
                .with_many_text(of_source().map(|event| format!("{}: {}", event.source, event.text)))
                .with_many_level(of_source().map(|event| event.level.text()))
                .columns_of_unit_batches()
                .writing("events")?;
            // The verdict is known last and read first: it stands a nanosecond before the run.
            let before = i64::from(source == VERDICT);
            let nanoseconds = of_source().map(|event| run.time_ns(event.tick) - before);
            let times = TimeColumn::new_duration_nanos(TIMELINE, nanoseconds);
            self.rerun
                .send_columns(format!("events/{source}"), [times], columns)
                .writing("events")?;
        }
        for (lane, (channel, _)) in LANES.iter().enumerate() {
            let of_lane = || changes.iter().filter(|change| change.lane == lane);
            if of_lane().next().is_none() {
                continue;
            }
            let columns = rerun_types::archetypes::StateChange::new()
                .with_state(of_lane().map(|change| change.state))
                .columns_of_unit_batches()
                .writing("states")?;
            let times = times_of(run, of_lane().map(|change| change.tick));
            self.rerun
                .send_columns(lane_entity(*channel), [times], columns)
                .writing("states")?;
        }
        Ok(())
    }
}

/// Ticks of which a plot shows the smallest and the largest value: two rows come of every stretch.
pub(crate) fn stretch(rows_per_second: f64, run: &RunInfo) -> usize {
    (2.0 / (rows_per_second * run.tick_s)).round().max(1.0) as usize
}

fn lane_entity(channel: anhyst_ipc::Channel) -> String {
    format!("status/{}", channel.producer().name())
}

fn state_color(level: Option<Level>) -> u32 {
    match level {
        None => 0x4755_69FF,
        Some(Level::Info) => 0x2563_EBFF,
        Some(Level::Warning) => 0xD977_06FF,
        Some(Level::Error) => 0xDC26_26FF,
    }
}

fn times_of(run: &RunInfo, ticks: impl Iterator<Item = u64>) -> TimeColumn {
    TimeColumn::new_duration_nanos(TIMELINE, ticks.map(|tick| run.time_ns(tick)))
}
