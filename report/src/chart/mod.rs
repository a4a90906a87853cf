//! What a chart is, whoever draws it: axes, and between them curves, bands and markers.
//!
//! Values are in SI units; an axis picks the prefix (40e-6 m is drawn as 40 µm). A colour follows from what a curve is
//! ([`Role`]) and means the same in every picture, page and recording. Drawn by [`crate::picture`] as SVG, by
//! [`crate::page`] as a chart to zoom into, and by the recorder as a Rerun album.

mod axis;
mod cycles;
pub(crate) mod role;
pub(crate) mod scale;
pub(crate) mod thin;

pub use axis::Axis;
pub use cycles::Cycles;
pub use role::Role;

/// Charts that are seen together, laid out row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    pub title: String,
    /// Charts side by side; 0: two, if there are two.
    pub columns: usize,
    pub charts: Vec<Chart>,
}

/// One coordinate system.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub curves: Vec<Curve>,
    pub bands: Vec<Band>,
    pub markers: Vec<Marker>,
}

/// A series. A value that is not finite breaks the line, as does one that is not positive on a logarithmic axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Abscissa and ordinate.
    pub points: Vec<[f64; 2]>,
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

/// A dashed line across the chart, with its name written at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    pub at: f64,
    pub direction: Direction,
    pub role: Role,
    pub name: String,
}

/// Which way a marker runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// At a value of y.
    Horizontal,
    /// At a value of x.
    Vertical,
}

/// The abscissa of what runs over time.
pub const TIME: &str = "time, s";

impl Figure {
    pub fn new(title: &str, charts: Vec<Chart>) -> Self {
        Figure {
            title: title.to_owned(),
            columns: 0,
            charts,
        }
    }

    /// Charts side by side.
    #[must_use]
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns;
        self
    }

    /// Columns and rows.
    pub(crate) fn grid(&self) -> (usize, usize) {
        let wanted = if self.columns == 0 { 2 } else { self.columns };
        let columns = wanted.min(self.charts.len()).max(1);
        (columns, self.charts.len().div_ceil(columns).max(1))
    }
}

impl Curve {
    pub fn new<Point: Into<[f64; 2]>>(points: impl IntoIterator<Item = Point>, role: Role) -> Self {
        Curve {
            points: points.into_iter().map(Into::into).collect(),
            role,
            name: None,
            style: Style::Line,
        }
    }

    /// Two series of one length; what is longer is left out.
    pub fn over(x: &[f64], y: &[f64], role: Role) -> Self {
        Curve::new(x.iter().copied().zip(y.iter().copied()), role)
    }

    /// One of several alike, for [`Chart::series`].
    pub fn of<Point: Into<[f64; 2]>>(name: &str, points: impl IntoIterator<Item = Point>) -> Self {
        Curve::new(points, Role::Series(0)).named(name)
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

impl Chart {
    pub fn new(title: &str, x: impl Into<Axis>, y: impl Into<Axis>) -> Self {
        Chart {
            title: title.to_owned(),
            x: x.into(),
            y: y.into(),
            curves: Vec::new(),
            bands: Vec::new(),
            markers: Vec::new(),
        }
    }

    #[must_use]
    pub fn curve(mut self, curve: Curve) -> Self {
        self.curves.push(curve);
        self
    }

    /// Curves that are alike, each in a colour of its own.
    #[must_use]
    pub fn series(mut self, curves: impl IntoIterator<Item = Curve>) -> Self {
        let numbered = curves.into_iter().enumerate().map(|(index, curve)| Curve {
            role: Role::Series(index),
            ..curve
        });
        self.curves.extend(numbered);
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
        let name = name.to_owned();
        self.markers.push(Marker {
            at,
            direction,
            role,
            name,
        });
        self
    }

    /// Everything as curves, for whoever draws nothing else: a band is its two edges, a marker a line across the data.
    pub fn lines(&self) -> Vec<Curve> {
        let along = |values: &mut dyn Iterator<Item = f64>| {
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        };
        let (x, y) = (along(&mut self.abscissas()), along(&mut self.ordinates()));
        let edges = self.bands.iter().flat_map(|band| {
            let edge = |of: fn(&(f64, f64, f64)) -> [f64; 2]| Curve {
                name: band.name.clone(),
                ..Curve::new(band.points.iter().map(of), band.role)
            };
            [edge(|point| [point.0, point.1]), edge(|point| [point.0, point.2])]
        });
        let markers = self.markers.iter().map(|marker| {
            let ends = match marker.direction {
                Direction::Horizontal => x.map(|x| [x, marker.at]),
                Direction::Vertical => y.map(|y| [marker.at, y]),
            };
            Curve::new(ends, marker.role).named(&marker.name)
        });
        self.curves.iter().cloned().chain(edges).chain(markers).collect()
    }

    /// All that is drawn along the abscissa; a point without a logarithm must not stretch the other axis.
    pub(crate) fn abscissas(&self) -> impl Iterator<Item = f64> {
        let bands = self
            .bands
            .iter()
            .flat_map(|band| band.points.iter().map(|point| point.0));
        let curves = self.standing().map(|point| point[0]);
        curves.chain(bands).chain(self.marked(Direction::Vertical))
    }

    /// All that is drawn along the ordinate.
    pub(crate) fn ordinates(&self) -> impl Iterator<Item = f64> {
        let bands = self.bands.iter().flat_map(|band| band.points.iter());
        let curves = self.standing().map(|point| point[1]);
        let bands = bands.flat_map(|point| [point.1, point.2]);
        curves.chain(bands).chain(self.marked(Direction::Horizontal))
    }

    fn standing(&self) -> impl Iterator<Item = [f64; 2]> {
        let stands = |axis: &Axis, value: f64| value.is_finite() && (value > 0.0 || !axis.logarithmic);
        let all = self.curves.iter().flat_map(|curve| curve.points.iter().copied());
        all.filter(move |point| stands(&self.x, point[0]) && stands(&self.y, point[1]))
    }

    fn marked(&self, direction: Direction) -> impl Iterator<Item = f64> {
        let along = self.markers.iter().filter(move |marker| marker.direction == direction);
        along.map(|marker| marker.at)
    }

    /// The powers of ten that are taken out of both axes, and the axes' labels: ([exponent of x, of y], [label of x, of y]).
    pub fn prefixes(&self) -> ([i32; 2], [String; 2]) {
        let of = |axis: &Axis, values: &mut dyn Iterator<Item = f64>| match axis.range {
            Some((low, high)) => scale::labelled(axis, [low, high].into_iter()),
            None => scale::labelled(axis, values),
        };
        let (x, y) = (of(&self.x, &mut self.abscissas()), of(&self.y, &mut self.ordinates()));
        ([x.0, y.0], [x.1, y.1])
    }
}
