//! What is drawn: panels, and in them axes, lines, bands and markers.

use super::palette::Role;

/// One coordinate system.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub lines: Vec<Line>,
    pub bands: Vec<Band>,
    pub markers: Vec<Marker>,
    pub legend: Legend,
}

/// What is drawn along one side.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub name: String,
    /// SI unit, which takes a prefix (`m`, `A/m`, `s`), or any other, which takes none (`%`, `ppm`, `dB`), or nothing.
    pub unit: String,
    pub logarithmic: bool,
    /// Ends in the unit; those of the data if none.
    pub range: Option<(f64, f64)>,
}

/// A series. A value that is not finite breaks the line, as does one that is not positive on a logarithmic axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    pub points: Vec<(f64, f64)>,
    pub role: Role,
    /// In the legend; no entry without a name.
    pub name: Option<String>,
    pub style: Style,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    #[default]
    Line,
    Dashed,
    Points,
}

/// A filled strip between two values at each abscissa: (x, low, high).
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    pub points: Vec<(f64, f64, f64)>,
    pub role: Role,
    pub name: Option<String>,
}

/// A dashed line across the panel, with its name written at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    pub at: f64,
    pub direction: Direction,
    pub role: Role,
    pub name: Option<String>,
}

/// Which way a marker runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// At a value of y.
    Horizontal,
    /// At a value of x.
    Vertical,
}

/// Where the names of the series stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Legend {
    /// In a row above the plot, where it hides nothing.
    #[default]
    Above,
    UpperLeft,
    UpperRight,
    LowerLeft,
    LowerRight,
    Hidden,
}

impl Axis {
    pub fn new(name: &str, unit: &str) -> Self {
        Axis {
            name: name.to_owned(),
            unit: unit.to_owned(),
            logarithmic: false,
            range: None,
        }
    }

    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }
}

impl Line {
    pub fn new(points: Vec<(f64, f64)>, role: Role) -> Self {
        Line {
            points,
            role,
            name: None,
            style: Style::Line,
        }
    }

    /// Two series of one length; what is longer is left out.
    pub fn over(x: &[f64], y: &[f64], role: Role) -> Self {
        Line::new(x.iter().copied().zip(y.iter().copied()).collect(), role)
    }

    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        self.name = Some(name.to_owned());
        self
    }

    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.style = Style::Dashed;
        self
    }

    #[must_use]
    pub fn as_points(mut self) -> Self {
        self.style = Style::Points;
        self
    }
}

impl Panel {
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Panel {
            title: title.to_owned(),
            x,
            y,
            lines: Vec::new(),
            bands: Vec::new(),
            markers: Vec::new(),
            legend: Legend::Above,
        }
    }

    #[must_use]
    pub fn line(mut self, line: Line) -> Self {
        self.lines.push(line);
        self
    }

    #[must_use]
    pub fn band(mut self, points: Vec<(f64, f64, f64)>, role: Role, name: Option<&str>) -> Self {
        let name = name.map(str::to_owned);
        self.bands.push(Band { points, role, name });
        self
    }

    /// A line at a value of y, for a limit or a truth.
    #[must_use]
    pub fn horizontal(self, at: f64, role: Role, name: &str) -> Self {
        self.marker(at, Direction::Horizontal, role, name)
    }

    /// A line at a value of x, for an event.
    #[must_use]
    pub fn vertical(self, at: f64, role: Role, name: &str) -> Self {
        self.marker(at, Direction::Vertical, role, name)
    }

    fn marker(mut self, at: f64, direction: Direction, role: Role, name: &str) -> Self {
        self.markers.push(Marker {
            at,
            direction,
            role,
            name: (!name.is_empty()).then(|| name.to_owned()),
        });
        self
    }

    #[must_use]
    pub fn legend(mut self, legend: Legend) -> Self {
        self.legend = legend;
        self
    }
}
