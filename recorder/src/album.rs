//! Finished curves as a recording: pages of charts, one tab a page, lines over time or in a plane.
//!
//! Unlike a run nothing is streamed: everything is known before the file is opened.

use crate::RecorderError;
use crate::axes::{Axes, Extent, legend_below};
use crate::error::Writing as _;
use crate::layout;
use crate::tokens::TIMELINE;
use crate::views::{Desk, Span};
use anhyst_report::chart::{Chart, Curve, Role};
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
            views.push(write(chart, stream, desk, &format!("page{number}/chart{at}"))?);
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

/// A chart with its curves in the units of its axes; over time as a plot, else in a plane.
fn write(
    chart: &Chart,
    stream: &RecordingStream,
    desk: &mut Desk,
    entity: &str,
) -> Result<ContainerLike, RecorderError> {
    let (curves, (exponents, labels)) = (chart.lines(), chart.prefixes());
    let scales = exponents.map(|exponent| 10_f64.powi(-exponent));
    if chart.x.is_time() {
        // The timeline is in seconds, whatever the axis would take for its unit.
        for (at, curve) in curves.iter().enumerate() {
            over_time(curve, stream, &format!("{entity}/line{at}"), scales[1])?;
        }
        let title = format!("{}: {}", chart.title, labels[1]);
        return Ok(desk.plot(&title, &[&format!("/{entity}/**")], Span::Run));
    }
    let mut extents = [Extent::default(); 2];
    for (at, curve) in curves.iter().enumerate() {
        let points: Vec<[f64; 2]> = finite(curve).map(|[x, y]| [x * scales[0], y * scales[1]]).collect();
        for point in &points {
            extents[0].add(point[0]);
            extents[1].add(point[1]);
        }
        in_plane(&points, curve.role, stream, &format!("{entity}/raw/line{at}"))?;
    }
    let named = || {
        curves
            .iter()
            .filter_map(|curve| Some((curve.name.as_deref()?, curve.role.on_dark())))
    };
    if let [Some(x), Some(y)] = extents.map(|extent| extent.range()) {
        let names = [labels[0].as_str(), labels[1].as_str()];
        Axes { x, y }.write(stream, entity, names, &named().collect::<Vec<_>>())?;
    }
    let legend = legend_below(named().map(|(name, _)| name));
    Ok(desk.plane(&chart.title, entity, legend))
}

fn finite(curve: &Curve) -> impl Iterator<Item = [f64; 2]> + '_ {
    let known = |point: &&[f64; 2]| point.iter().all(|value| value.is_finite());
    curve.points.iter().filter(known).copied()
}

fn over_time(curve: &Curve, stream: &RecordingStream, entity: &str, scale: f64) -> Result<(), RecorderError> {
    let style = SeriesLines::new()
        .with_names([curve.name.as_deref().unwrap_or_default()])
        .with_colors([Color::from_u32(curve.role.on_dark())]);
    stream.log_static(entity, &style).writing(entity)?;
    let times = finite(curve).map(|[time_s, _]| (time_s * 1e9).round() as i64);
    let times = TimeColumn::new_duration_nanos(TIMELINE, times);
    let values = Scalars::new(finite(curve).map(|[_, value]| value * scale));
    let columns = values.columns_of_unit_batches().writing(entity)?;
    stream.send_columns(entity, [times], columns).writing(entity)
}

fn in_plane(points: &[[f64; 2]], role: Role, stream: &RecordingStream, entity: &str) -> Result<(), RecorderError> {
    let strip: Vec<[f32; 2]> = points.iter().map(|point| point.map(|value| value as f32)).collect();
    let lines = LineStrips2D::new([strip])
        .with_colors([Color::from_u32(role.on_dark())])
        .with_radii([Radius::new_ui_points(1.0)])
        .with_draw_order(30.0);
    stream.log_static(entity, &lines).writing(entity)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn album() -> Album {
        let curve = Curve::of("line", [[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]]);
        let charts = ["time, s", "field, A/m"].map(|x| Chart::new("chart", x, "output, m").series([curve.clone()]));
        let page = AlbumPage {
            title: "page".into(),
            notes: "what it shows".into(),
            charts: charts.into(),
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
