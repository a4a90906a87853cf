//! Panels of lines that a command draws twice: as a picture (SVG) and as a page of a Rerun recording.

use anhyst_diagnosis::plot;

/// Points of a line: abscissa, ordinate.
pub type Points = Vec<[f64; 2]>;

/// A line of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// For the legend.
    pub name: String,
    /// Where it goes.
    pub points: Points,
    /// A reference, or wrong on purpose.
    pub dashed: bool,
}

/// A coordinate system.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// Name and unit of the abscissa.
    pub abscissa: String,
    /// Name and unit of the ordinate.
    pub ordinate: String,
    /// The lines.
    pub curves: Vec<Curve>,
}

/// A solid line.
pub fn curve(name: impl Into<String>, points: Points) -> Curve {
    Curve {
        name: name.into(),
        points,
        dashed: false,
    }
}

/// A dashed line.
pub fn dashed(name: impl Into<String>, points: Points) -> Curve {
    Curve {
        dashed: true,
        ..curve(name, points)
    }
}

/// A panel.
pub fn panel(title: &str, abscissa: &str, ordinate: &str, curves: Vec<Curve>) -> Panel {
    Panel {
        title: title.into(),
        abscissa: abscissa.into(),
        ordinate: ordinate.into(),
        curves,
    }
}

/// Panels that are seen together, as a page of a recording.
#[cfg(feature = "recorder")]
pub fn album_page(title: &str, notes: &str, panels: &[Panel]) -> anhyst_recorder::AlbumPage {
    use anhyst_recorder::{AlbumPage, Chart, ChartLine};
    let chart = |panel: &Panel| {
        let line = |curve: &Curve| ChartLine {
            name: curve.name.clone(),
            points: curve.points.clone(),
        };
        let lines = panel.curves.iter().map(line).collect();
        if panel.abscissa == TIME {
            Chart::OverTime {
                title: format!("{}: {}", panel.title, panel.ordinate),
                lines,
            }
        } else {
            Chart::Plane {
                title: panel.title.clone(),
                axes: [panel.abscissa.clone(), panel.ordinate.clone()],
                lines,
            }
        }
    };
    AlbumPage {
        title: title.into(),
        notes: notes.into(),
        charts: panels.iter().map(chart).collect(),
    }
}

/// Panels as a picture: SVG text.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn svg(title: &str, panels: &[Panel]) -> Result<String, anhyst_diagnosis::DiagnosisError> {
    let (figure, (width, height)) = drawing(title, panels);
    figure.svg(width, height)
}

/// Panels as a drawing, two side by side, and its size in pixels.
pub fn drawing(title: &str, panels: &[Panel]) -> (plot::Figure, (u32, u32)) {
    let columns = panels.len().clamp(1, 2);
    let rows = panels.len().div_ceil(columns).max(1);
    let figure = plot::Figure {
        title: title.to_owned(),
        columns,
        panels: panels.iter().map(drawn).collect(),
    };
    (figure, (PANEL.0 * columns as u32, PANEL.1 * rows as u32 + TITLE))
}

fn drawn(panel: &Panel) -> plot::Panel {
    let axis = |name: &str| match name.rsplit_once(", ") {
        Some((name, unit)) => plot::Axis::new(name, unit),
        None => plot::Axis::new(name, ""),
    };
    let lines = panel.curves.iter().enumerate().map(|(index, curve)| {
        let points = curve.points.iter().map(|[x, y]| (*x, *y)).collect();
        let line = plot::Line::new(points, plot::Role::Series(index)).named(&curve.name);
        if curve.dashed { line.dashed() } else { line }
    });
    let empty = plot::Panel::new(&panel.title, axis(&panel.abscissa), axis(&panel.ordinate));
    lines.fold(empty, plot::Panel::line)
}

/// Size of a panel, and height of the title, pixels.
const PANEL: (u32, u32) = (640, 420);
const TITLE: u32 = 40;

/// The abscissa of what runs over time.
pub const TIME: &str = "time, s";
