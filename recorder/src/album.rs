//! Finished curves as a recording: pages of charts, one tab a page, lines over time or in a plane.
//!
//! Unlike a run nothing is streamed: everything is known before the file is opened.

use crate::RecorderError;
use crate::axes::{Axes, Extent, legend_below};
use crate::error::Writing as _;
use crate::layout;
use crate::tokens::TIMELINE;
use crate::views::{Desk, Span};
use rerun::blueprint::{ContainerLike, Grid, Tabs, TextDocumentView};
use rerun::log::TimeColumn;
use rerun::{RecordingStream, RecordingStreamBuilder};
use rerun_types::archetypes::{LineStrips2D, Scalars, SeriesLines, TextDocument};
use rerun_types::components::{Color, Radius};
use std::path::Path;
use std::time::Duration;

/// Another application than that of runs: the viewer keeps one layout for each.
const APPLICATION: &str = "anhyst_album";
const FLUSH_LIMIT: Duration = Duration::from_secs(60);
/// Told apart by people who do not see red and green alike (Okabe and Ito).
const COLORS: [u32; 7] = [
    0x56B4_E9FF,
    0xE69F_00FF,
    0x009E_73FF,
    0xCC79_A7FF,
    0xD55E_00FF,
    0xF0E4_42FF,
    0x9CA3_AFFF,
];

/// One line of a chart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChartLine {
    /// For the legend.
    pub name: String,
    /// Abscissa (seconds in a chart over time) and ordinate. Points that are no numbers are left out.
    pub points: Vec<[f64; 2]>,
}

/// A coordinate system.
#[derive(Debug, Clone, PartialEq)]
pub enum Chart {
    /// Lines over time, in seconds.
    OverTime {
        /// With the ordinate's unit.
        title: String,
        /// The lines.
        lines: Vec<ChartLine>,
    },
    /// Lines in a plane.
    Plane {
        /// Above the plane.
        title: String,
        /// Names of abscissa and ordinate, with units.
        axes: [String; 2],
        /// The lines.
        lines: Vec<ChartLine>,
    },
}

/// Charts that are seen together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlbumPage {
    /// Name of the tab.
    pub title: String,
    /// What it shows, as Markdown; may be empty.
    pub notes: String,
    /// Its charts.
    pub charts: Vec<Chart>,
}

/// A recording of finished curves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Album {
    /// Name of the recording.
    pub name: String,
    /// Its pages.
    pub pages: Vec<AlbumPage>,
}

impl Album {
    /// Writes the recording with its layout.
    ///
    /// # Errors
    /// If the file cannot be created or written.
    pub fn save(&self, path: &Path) -> Result<(), RecorderError> {
        let create = |error: &dyn std::fmt::Display| RecorderError::Create {
            path: path.to_owned(),
            cause: error.to_string(),
        };
        // Rerun's own thread would tell a missing folder to the log only.
        std::fs::File::create(path).map_err(|error| create(&error))?;
        let stream = RecordingStreamBuilder::new(APPLICATION)
            .recording_name(self.name.as_str())
            .enabled(true)
            .save(path)
            .map_err(|error| create(&error))?;
        stream.set_log_time_enabled(false);
        let mut desk = Desk::default();
        let mut tabs = Vec::with_capacity(self.pages.len());
        for (number, page) in self.pages.iter().enumerate() {
            tabs.push(page.write(&stream, &mut desk, number)?);
        }
        let root: ContainerLike = Tabs::new(tabs).into();
        let (messages, activation) = layout::messages(APPLICATION, (root, desk.properties))?;
        stream.send_blueprint(messages, activation);
        stream.flush_with_timeout(FLUSH_LIMIT).writing("the end of the album")
    }
}

impl AlbumPage {
    fn write(&self, stream: &RecordingStream, desk: &mut Desk, number: usize) -> Result<ContainerLike, RecorderError> {
        let mut views = Vec::with_capacity(self.charts.len() + 1);
        for (at, chart) in self.charts.iter().enumerate() {
            views.push(chart.write(stream, desk, &format!("page{number}/chart{at}"))?);
        }
        if !self.notes.is_empty() {
            let entity = format!("page{number}/notes");
            stream
                .log_static(entity.as_str(), &TextDocument::from_markdown(self.notes.as_str()))
                .writing("notes")?;
            views.push(TextDocumentView::new("Notes").with_origin(entity).into());
        }
        Ok(Grid::new(views).with_name(self.title.as_str()).into())
    }
}

impl Chart {
    fn lines(&self) -> &[ChartLine] {
        match self {
            Chart::OverTime { lines, .. } | Chart::Plane { lines, .. } => lines,
        }
    }

    fn write(&self, stream: &RecordingStream, desk: &mut Desk, entity: &str) -> Result<ContainerLike, RecorderError> {
        for (at, line) in self.lines().iter().enumerate() {
            let color = COLORS[at % COLORS.len()];
            match self {
                Chart::OverTime { .. } => line.over_time(stream, &format!("{entity}/line{at}"), color)?,
                Chart::Plane { .. } => line.in_plane(stream, &format!("{entity}/raw/line{at}"), color)?,
            }
        }
        match self {
            Chart::OverTime { title, .. } => Ok(desk.plot(title, &[&format!("/{entity}/**")], Span::Run)),
            Chart::Plane { title, axes, lines } => {
                let mut extents = [Extent::default(); 2];
                for point in lines.iter().flat_map(|line| &line.points) {
                    extents[0].add(point[0]);
                    extents[1].add(point[1]);
                }
                if let [Some(x), Some(y)] = extents.map(|extent| extent.range()) {
                    let named = lines.iter().zip(COLORS.iter().cycle());
                    let curves: Vec<_> = named.map(|(line, color)| (line.name.as_str(), *color)).collect();
                    let names = [axes[0].as_str(), axes[1].as_str()];
                    Axes { x, y }.write(stream, entity, names, &curves)?;
                }
                let legend = legend_below(lines.iter().map(|line| line.name.as_str()));
                Ok(desk.plane(title, entity, legend))
            }
        }
    }
}

impl ChartLine {
    fn finite(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let known = |point: &&[f64; 2]| point.iter().all(|value| value.is_finite());
        self.points.iter().filter(known).copied()
    }

    fn over_time(&self, stream: &RecordingStream, entity: &str, color: u32) -> Result<(), RecorderError> {
        let style = SeriesLines::new()
            .with_names([self.name.as_str()])
            .with_colors([Color::from_u32(color)]);
        stream.log_static(entity, &style).writing(entity)?;
        let times = self.finite().map(|[time_s, _]| (time_s * 1e9).round() as i64);
        let times = TimeColumn::new_duration_nanos(TIMELINE, times);
        let values = Scalars::new(self.finite().map(|[_, value]| value));
        let columns = values.columns_of_unit_batches().writing(entity)?;
        stream.send_columns(entity, [times], columns).writing(entity)
    }

    fn in_plane(&self, stream: &RecordingStream, entity: &str, color: u32) -> Result<(), RecorderError> {
        let strip: Vec<[f32; 2]> = self.finite().map(|point| point.map(|value| value as f32)).collect();
        let lines = LineStrips2D::new([strip])
            .with_colors([Color::from_u32(color)])
            .with_radii([Radius::new_ui_points(1.0)])
            .with_draw_order(30.0);
        stream.log_static(entity, &lines).writing(entity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn album() -> Album {
        let lines = vec![ChartLine {
            name: "line".into(),
            points: vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]],
        }];
        let over_time = Chart::OverTime {
            title: "over time [m]".into(),
            lines: lines.clone(),
        };
        let plane = Chart::Plane {
            title: "plane".into(),
            axes: ["x [m]".into(), "y [m]".into()],
            lines,
        };
        let page = AlbumPage {
            title: "page".into(),
            notes: "what it shows".into(),
            charts: vec![over_time, plane],
        };
        Album {
            name: "album".into(),
            pages: vec![page],
        }
    }

    /// Guards: an album is a file that Rerun reads again, with its curves and its layout.
    #[test]
    fn an_album_is_written_and_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("album.rrd");
        album().save(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let decoder = rerun::external::re_log_encoding::rrd::DecoderApp::decode_eager(file).unwrap();
        let stores: Vec<_> = decoder.map(|message| message.unwrap().store_id().clone()).collect();
        assert!(stores.iter().any(|store| store.is_blueprint()));
        assert!(stores.iter().filter(|store| store.is_recording()).count() >= 4);
    }

    /// Guards: a folder that does not exist is an error, not a line in a log.
    #[test]
    fn an_album_that_cannot_be_written_says_so() {
        let error = album()
            .save(Path::new("/no/such/folder/album.rrd"))
            .unwrap_err()
            .to_string();
        assert!(error.contains("/no/such/folder/album.rrd"), "{error}");
    }
}
