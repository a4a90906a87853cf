//! Figures within a page: points in single precision and base64, thinned to what a screen shows even when zoomed in.
//!
//! A curve takes at most 128 kB however long it is, one without noise far less.

use crate::chart::{Axis, Band, Chart, Curve, Direction, Figure, Marker, Role, Style, thin};
use base64::Engine as _;
use serde_json::{Value, json};

/// The library, and what makes charts of the page's data with it; put into a page that has any.
pub(super) const SCRIPTS: [&str; 3] = [
    include_str!("language.js"),
    include_str!("uplot/uPlot.iife.min.js"),
    include_str!("charts.js"),
];
pub(super) const LIBRARY_LICENSE: &str = include_str!("uplot/LICENSE");
pub(super) const LIBRARY_STYLE: &str = include_str!("uplot/uPlot.min.css");

/// Curves up to this length are given whole.
const MAX_POINTS: usize = 8000;
/// Columns whose extremes are kept of a longer one, and height in the same measure.
const GRID: (f64, f64) = (3000.0, 6000.0);

/// The figure's charts as HTML.
pub(super) fn charts(figure: &Figure) -> String {
    let (columns, _) = figure.grid();
    let charts: String = figure.charts.iter().map(chart).collect();
    format!("<div class=\"charts\" style=\"--columns:{columns}\">\n{charts}</div>\n")
}

fn chart(chart: &Chart) -> String {
    let (exponents, labels) = chart.prefixes();
    let scales = exponents.map(|exponent| 10_f64.powi(-exponent));
    let axis = |axis: &Axis, at: usize| {
        json!({
            "label": labels[at],
            "log": axis.logarithmic,
            "range": axis.range.map(|(low, high)| [low * scales[at], high * scales[at]]),
            "unit": scales[at],
        })
    };
    let chart = json!({
        "title": chart.title,
        "x": axis(&chart.x, 0),
        "y": axis(&chart.y, 1),
        "time": chart.x.is_time(),
        "curves": chart.curves.iter().map(|own| curve(own, chart, scales)).collect::<Vec<_>>(),
        "bands": chart.bands.iter().map(|own| band(own, scales)).collect::<Vec<_>>(),
        "markers": chart.markers.iter().map(|own| marker(own, scales)).collect::<Vec<_>>(),
    });
    // Only strings hold these, so that what a caller says cannot end the script.
    let data = chart
        .to_string()
        .replace('&', "\\u0026")
        .replace('<', "\\u003c")
        .replace('>', "\\u003e");
    format!("<div class=\"chart\"><script type=\"application/json\">{data}</script></div>\n")
}

fn curve(curve: &Curve, chart: &Chart, scales: [f64; 2]) -> Value {
    let points = thinned(&curve.points, chart.x.logarithmic, chart.y.logarithmic);
    let known = || {
        points
            .iter()
            .filter(|point| point.iter().all(|value| value.is_finite()))
    };
    let over = |at: usize| points.iter().map(move |point| point[at] * scales[at]);
    json!({
        "name": curve.name,
        "colour": colour(curve.role),
        "style": match curve.style {
            Style::Line => "line",
            Style::Dashed => "dashed",
            Style::Points => "points",
        },
        "rising": known().zip(known().skip(1)).all(|(one, other)| one[0] <= other[0]),
        "data": encoded(over(0).chain(over(1))),
    })
}

fn band(band: &Band, scales: [f64; 2]) -> Value {
    let x = band.points.iter().map(|point| point.0 * scales[0]);
    let (low, high) = (
        band.points.iter().map(|point| point.1),
        band.points.iter().map(|point| point.2),
    );
    json!({
        "name": band.name,
        "colour": colour(band.role),
        "data": encoded(x.chain(low.chain(high).map(|value| value * scales[1]))),
    })
}

fn marker(marker: &Marker, scales: [f64; 2]) -> Value {
    let vertical = marker.direction == Direction::Vertical;
    json!({
        "at": marker.at * scales[usize::from(!vertical)],
        "vertical": vertical,
        "name": marker.name,
        "colour": colour(marker.role),
    })
}

fn colour(role: Role) -> [String; 2] {
    role.css()
}

/// Little-endian single precision.
fn encoded(values: impl Iterator<Item = f64>) -> String {
    let bytes: Vec<u8> = values.flat_map(|value| (value as f32).to_le_bytes()).collect();
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// Fewer points without losing an extreme; a gap stays one.
fn thinned(points: &[[f64; 2]], x_logarithmic: bool, y_logarithmic: bool) -> Vec<[f64; 2]> {
    if points.len() <= MAX_POINTS {
        return points.to_vec();
    }
    let place = |value: f64, logarithmic: bool| if logarithmic { value.log10() } else { value };
    let back = |place: f64, logarithmic: bool| if logarithmic { 10_f64.powf(place) } else { place };
    let placed = points
        .iter()
        .map(|[x, y]| (place(*x, x_logarithmic), place(*y, y_logarithmic)));
    let pieces = thin::pieces(placed);
    let extent = |of: fn(&(f64, f64)) -> f64| {
        let all = pieces.iter().flatten().map(of);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        (low, if high > low { high - low } else { 1.0 })
    };
    let ((left, width), (bottom, height)) = (extent(|point| point.0), extent(|point| point.1));
    let mut all = Vec::new();
    for piece in &pieces {
        let on_grid: Vec<(f64, f64)> = piece
            .iter()
            .map(|(x, y)| ((x - left) / width * GRID.0, (y - bottom) / height * GRID.1))
            .collect();
        let kept = thin::path(&on_grid).into_iter().map(|(x, y)| {
            let (x, y) = (left + x / GRID.0 * width, bottom + y / GRID.1 * height);
            [back(x, x_logarithmic), back(y, y_logarithmic)]
        });
        all.extend(kept.chain([[f64::NAN; 2]]));
    }
    all
}
