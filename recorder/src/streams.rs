//! The streams of a run: the file, which gets everything, and the server for live viewers, which gets thinned plots only,
//! because viewers keep all they are sent in memory.

use crate::error::Writing as _;
use crate::events::{Event, StateChange, VERDICT};
use crate::extremes::{kept_rows, thin};
use crate::file::File;
use crate::flags::{FLAGS, LANES};
use crate::loops::Loops;
use crate::plots::{PLOTS, Plot, Series, present};
use crate::row::{Presence, Row};
use crate::run::Level;
use crate::tokens::{self, TICK_ENTITY, TIMELINE};
use crate::{RecorderError, RecorderSettings, RunInfo};
use rerun::log::TimeColumn;
use rerun::{RecordingStream, RecordingStreamBuilder};
use rerun_types::archetypes::{Scalars, SeriesLines, TextLog};
use rerun_types::components::Color;
use std::path::Path;
use std::time::Duration;

/// The application's name: recordings and layouts of the same name belong together.
pub(crate) const APPLICATION: &str = "anhyst";
/// What live viewers may find of the past when they join.
const LIVE_MEMORY: &str = "200MB";
/// How long the end of a run waits for live viewers.
const FLUSH_LIMIT: Duration = Duration::from_secs(60);

/// One stream and what is drawn on it.
pub(crate) struct Stream {
    pub rerun: RecordingStream,
    rows_per_second: f64,
    /// Where all tokens go; live viewers get none.
    file: Option<File>,
    drawn: Option<Drawn>,
}

/// What a stream draws; known when the first rows show what the run has.
struct Drawn {
    plots: Vec<(&'static Plot, Vec<&'static Series>)>,
    loops: Loops,
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
        for (plot, series) in &self.plots {
            let style = SeriesLines::new()
                .with_names(series.iter().map(|series| series.name))
                .with_colors(series.iter().map(|series| Color::from_u32(series.color)))
                .with_widths(series.iter().map(|series| series.width));
            stream.log_static(plot.entity, &style).writing(plot.entity)?;
        }
        self.loops.declare(stream, &run.scales)
    }
}

impl Stream {
    /// Creates the file.
    pub fn file(run: &RunInfo, settings: &RecorderSettings) -> Result<Self, RecorderError> {
        let file = File::create(builder(run), &run.path)?;
        let stream = file.stream();
        Self::create(stream, settings.plot_rate_hz, Some(file), run)
    }

    /// Closes the file and goes on in another one.
    pub fn go_on(&mut self, run: &RunInfo, path: &Path) -> Result<(), RecorderError> {
        self.file.as_mut().map_or(Ok(()), |file| file.go_on(path))?;
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
        file: Option<File>,
        run: &RunInfo,
    ) -> Result<Self, RecorderError> {
        rerun.set_log_time_enabled(false);
        let stream = Self {
            rerun,
            rows_per_second,
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

    /// Sends on what was logged.
    pub fn write(&mut self) -> Result<(), RecorderError> {
        self.file.as_mut().map_or(Ok(()), File::write)
    }

    /// Sends on what was logged, and no more.
    pub fn close(&mut self) -> Result<(), RecorderError> {
        match &mut self.file {
            Some(file) => file.close(),
            None => self.rerun.flush_with_timeout(FLUSH_LIMIT).writing("the end of the run"),
        }
    }

    fn draw(&mut self, run: &RunInfo, has: Presence) -> Result<&mut Drawn, RecorderError> {
        let drawn = match self.drawn.take() {
            Some(drawn) => drawn,
            None => {
                let plots = PLOTS.iter().map(|plot| (plot, present(plot, has).collect::<Vec<_>>()));
                let drawn = Drawn {
                    plots: plots.filter(|(_, series)| !series.is_empty()).collect(),
                    loops: Loops::new(run, has),
                };
                drawn.declare(&self.rerun, run)?;
                drawn
            }
        };
        Ok(self.drawn.insert(drawn))
    }

    /// Writes the rows of a block.
    pub fn rows(&mut self, run: &RunInfo, has: Presence, rows: &[Row]) -> Result<(), RecorderError> {
        let stream = self.rerun.clone();
        if self.file.is_some() {
            tokens::send(&stream, run, rows)?;
        }
        let stretch = stretch(self.rows_per_second, run);
        let stretch_times = times(run, kept_rows(rows.len(), stretch).map(|row| rows[row].tick));
        let end_times = times(run, [0, rows.len() - 1].map(|row| rows[row].tick).into_iter());
        let drawn = self.draw(run, has)?;
        for (plot, series) in &drawn.plots {
            let value = |row: &Row| series.iter().map(|series| (series.value)(row, run)).collect::<Vec<_>>();
            if plot.constant {
                let values = [0, rows.len() - 1].iter().flat_map(|row| value(&rows[*row])).collect();
                send_wide(&stream, plot.entity, &end_times, values, series.len())?;
            } else {
                let mut values = Vec::with_capacity(rows.len() * series.len());
                for row in rows {
                    values.extend(series.iter().map(|series| (series.value)(row, run)));
                }
                let values = thin(&values, series.len(), stretch);
                send_wide(&stream, plot.entity, &stretch_times, values, series.len())?;
            }
        }
        drawn.loops.rows(&stream, run, rows)
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
            let times = times(run, of_lane().map(|change| change.tick));
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

/// Writes rows of `width` values.
fn send_wide(
    stream: &RecordingStream,
    entity: &str,
    times: &TimeColumn,
    values: Vec<f64>,
    width: usize,
) -> Result<(), RecorderError> {
    let rows = values.len() / width.max(1);
    let columns = Scalars::new(values)
        .columns(std::iter::repeat_n(width, rows))
        .writing(entity)?;
    stream.send_columns(entity, [times.clone()], columns).writing(entity)
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

fn times(run: &RunInfo, ticks: impl Iterator<Item = u64>) -> TimeColumn {
    TimeColumn::new_duration_nanos(TIMELINE, ticks.map(|tick| run.time_ns(tick)))
}
