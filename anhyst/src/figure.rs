//! Panels of lines that a command draws twice: as a picture (SVG) and as a page of a Rerun recording.

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

/// The abscissa of what runs over time.
pub const TIME: &str = "time, s";
