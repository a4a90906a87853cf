//! One coordinate system on a canvas: grid, bands, series, markers, axes, names.

use super::canvas::{Canvas, Hold, Rectangle, Text};
use crate::chart::role::{AXIS, Colour, GRID, INK};
use crate::chart::scale::Scale;
use crate::chart::thin;
use crate::chart::{Band, Chart, Curve, Direction, Marker, Style};
use crate::error::ReportError;

const TITLE_SIZE: f64 = 13.0;
const TEXT_SIZE: f64 = 11.5;
/// Empty room around a panel.
const EDGE: f64 = 12.0;
const LINE_HEIGHT: f64 = 17.0;
/// Ticks and their texts below the plot, and the name of the axis under them.
const BELOW: f64 = 40.0;
const TICK: f64 = 4.0;
/// Room beyond the data.
const ROOM: (f64, f64) = (0.015, 0.06);
const X_SPACING: f64 = 85.0;
const Y_SPACING: f64 = 42.0;
const LINE_WIDTH: f64 = 1.4;
const MAX_DASHED: f64 = 10_000.0;
const HAIR: f64 = 1.0;
const DOT: f64 = 1.8;
const BAND_OPACITY: f64 = 0.2;
/// Of a name in the legend: its sample, and the gap after it.
const SAMPLE: f64 = 20.0;
const ENTRY_GAP: f64 = 16.0;
/// Between legend and plot: half of a tick's text, which may stand at the plot's upper end.
const LEGEND_GAP: f64 = 5.0;

type Drawn = Result<(), ReportError>;

/// A panel with its axes and the rectangle between them.
struct Plot {
    x: Scale,
    y: Scale,
    inside: Rectangle,
}

/// Draws a panel within a rectangle.
pub(super) fn draw(canvas: &Canvas, panel: &Chart, place: Rectangle) -> Drawn {
    let names = entries(panel);
    let rows = rows_of(canvas, &names, place.width() - 2.0 * EDGE);
    let heading = if panel.title.is_empty() { 0.0 } else { LINE_HEIGHT + 3.0 };
    let legend = if rows.is_empty() {
        0.0
    } else {
        rows.len() as f64 * LINE_HEIGHT + LEGEND_GAP
    };
    let top = place.top + EDGE + heading + legend;
    let bottom = (place.bottom - EDGE - BELOW).max(top + 1.0);
    let y = Scale::new(&panel.y, panel.ordinates(), ROOM.1, bottom - top, Y_SPACING);
    let widest = y
        .ticks
        .iter()
        .map(|(_, text)| canvas.text_width(text, TEXT_SIZE))
        .fold(0.0, f64::max);
    let left = place.left + EDGE + LINE_HEIGHT + widest + 2.0 * TICK;
    let inside = Rectangle {
        left,
        right: (place.right - EDGE).max(left + 1.0),
        top,
        bottom,
    };
    let x = Scale::new(&panel.x, panel.abscissas(), ROOM.0, inside.width(), X_SPACING);
    let plot = Plot { x, y, inside };
    plot.grid(canvas)?;
    panel.bands.iter().try_for_each(|band| plot.band(canvas, band))?;
    panel.curves.iter().try_for_each(|line| plot.curve(canvas, line))?;
    panel
        .markers
        .iter()
        .try_for_each(|marker| plot.marker(canvas, marker))?;
    plot.axes(canvas, place)?;
    let title = Text::left(&panel.title, place.left + EDGE, place.top + EDGE + 6.0, TITLE_SIZE, INK);
    canvas.text(&title)?;
    for (row, names) in rows.iter().enumerate() {
        let y = place.top + EDGE + heading + (row as f64 + 0.4) * LINE_HEIGHT;
        let mut x = place.left + EDGE;
        for name in names {
            name.draw(canvas, x, y)?;
            x += name.width(canvas);
        }
    }
    Ok(())
}

impl Plot {
    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let Rectangle { left, bottom, .. } = self.inside;
        let (right, up) = (
            self.x.share(x) * self.inside.width(),
            self.y.share(y) * self.inside.height(),
        );
        (left + right, bottom - up)
    }

    fn sides(&self) -> [f64; 4] {
        let Rectangle {
            left,
            right,
            top,
            bottom,
        } = self.inside;
        [left, right, top, bottom]
    }

    fn holds(&self, (x, y): (f64, f64)) -> bool {
        let [left, right, top, bottom] = self.sides();
        (left..=right).contains(&x) && (top..=bottom).contains(&y)
    }

    fn grid(&self, canvas: &Canvas) -> Drawn {
        let [left, right, top, bottom] = self.sides();
        for (share, _) in &self.x.ticks {
            let x = left + share * self.inside.width();
            canvas.path(&[(x, top), (x, bottom)], GRID, HAIR)?;
        }
        for (share, _) in &self.y.ticks {
            let y = bottom - share * self.inside.height();
            canvas.path(&[(left, y), (right, y)], GRID, HAIR)?;
        }
        Ok(())
    }

    fn axes(&self, canvas: &Canvas, place: Rectangle) -> Drawn {
        let [left, right, top, bottom] = self.sides();
        canvas.path(&[(left, top), (left, bottom), (right, bottom)], AXIS, HAIR)?;
        for (share, text) in &self.x.ticks {
            let x = left + share * self.inside.width();
            canvas.path(&[(x, bottom), (x, bottom + TICK)], AXIS, HAIR)?;
            canvas.text(&Text::left(text, x, bottom + 13.0, TEXT_SIZE, INK).held(Hold::Middle))?;
        }
        for (share, text) in &self.y.ticks {
            let y = bottom - share * self.inside.height();
            canvas.path(&[(left - TICK, y), (left, y)], AXIS, HAIR)?;
            canvas.text(&Text::left(text, left - 2.0 * TICK, y, TEXT_SIZE, INK).held(Hold::Right))?;
        }
        let (middle, centre) = (0.5 * (left + right), 0.5 * (top + bottom));
        let below = Text::left(&self.x.label, middle, bottom + 31.0, TEXT_SIZE, INK).held(Hold::Middle);
        canvas.text(&below)?;
        let beside = Text::left(&self.y.label, place.left + EDGE + 4.0, centre, TEXT_SIZE, INK);
        canvas.text(&beside.held(Hold::Middle).upright())
    }

    fn curve(&self, canvas: &Canvas, line: &Curve) -> Drawn {
        let colour = line.role.colour();
        let on_canvas = line.points.iter().map(|point| self.at((*point).into()));
        if line.style == Style::Points {
            let seen: Vec<_> = on_canvas.filter(|point| self.holds(*point)).collect();
            return thin::points(&seen)
                .into_iter()
                .try_for_each(|at| canvas.dot(at, DOT, colour));
        }
        for piece in thin::pieces(on_canvas) {
            if let [alone] = piece[..]
                && self.holds(alone)
            {
                canvas.dot(alone, DOT, colour)?;
            }
            for part in thin::clipped(&thin::path(&piece), self.sides()) {
                stroke(canvas, &part, colour, line.style)?;
            }
        }
        Ok(())
    }

    fn band(&self, canvas: &Canvas, band: &Band) -> Drawn {
        let [left, right, top, bottom] = self.sides();
        let inside = |(x, y): (f64, f64)| (x.clamp(left, right), y.clamp(top, bottom));
        let edge = |of: fn(&(f64, f64, f64)) -> (f64, f64)| band.points.iter().map(of).map(|point| self.at(point));
        let (low, high) = (thin::pieces(edge(|p| (p.0, p.1))), thin::pieces(edge(|p| (p.0, p.2))));
        for (low, high) in low.iter().zip(&high) {
            let there = thin::path(high);
            let back = thin::path(low).into_iter().rev();
            let outline: Vec<_> = there.into_iter().chain(back).map(inside).collect();
            canvas.shape(&outline, band.role.colour(), BAND_OPACITY)?;
        }
        Ok(())
    }

    fn marker(&self, canvas: &Canvas, marker: &Marker) -> Drawn {
        let ([left, right, top, bottom], colour) = (self.sides(), marker.role.colour());
        let name = marker.name.as_str();
        let (ends, text) = match marker.direction {
            Direction::Horizontal => {
                let y = bottom - self.y.share(marker.at) * self.inside.height();
                let text = Text::left(name, right - 3.0, y - 8.0, TEXT_SIZE, colour).held(Hold::Right);
                ([(left, y), (right, y)], text)
            }
            Direction::Vertical => {
                let x = left + self.x.share(marker.at) * self.inside.width();
                (
                    [(x, top), (x, bottom)],
                    Text::left(name, x + 4.0, top + 8.0, TEXT_SIZE, colour),
                )
            }
        };
        if !self.holds(ends[0]) {
            return Ok(());
        }
        stroke(canvas, &ends, colour, Style::Dashed)?;
        if name.is_empty() { Ok(()) } else { canvas.text(&text) }
    }
}

fn stroke(canvas: &Canvas, path: &[(f64, f64)], colour: Colour, style: Style) -> Drawn {
    // A curve that fills its panel would need thousands of dashes, and shows none.
    if style != Style::Dashed || thin::length(path) > MAX_DASHED {
        return canvas.path(path, colour, LINE_WIDTH);
    }
    thin::dashes(path)
        .iter()
        .try_for_each(|dash| canvas.path(dash, colour, LINE_WIDTH))
}

/// A name in the legend.
struct Entry<'a> {
    name: &'a str,
    colour: Colour,
    /// None for a band.
    style: Option<Style>,
}

fn entries(panel: &Chart) -> Vec<Entry<'_>> {
    let lines = panel
        .curves
        .iter()
        .map(|line| (&line.name, line.role, Some(line.style)));
    let bands = panel.bands.iter().map(|band| (&band.name, band.role, None));
    let all = lines.chain(bands).filter_map(|(name, role, style)| {
        Some(Entry {
            name: name.as_deref()?,
            colour: role.colour(),
            style,
        })
    });
    all.collect()
}

/// Names in rows that fit the width.
fn rows_of<'a>(canvas: &Canvas, names: &'a [Entry<'a>], width: f64) -> Vec<Vec<&'a Entry<'a>>> {
    let mut rows: Vec<Vec<&Entry>> = Vec::new();
    let mut used = f64::INFINITY;
    for name in names {
        let needed = name.width(canvas);
        match rows.last_mut() {
            Some(row) if used + needed <= width => row.push(name),
            _ => {
                rows.push(vec![name]);
                used = 0.0;
            }
        }
        used += needed;
    }
    rows
}

impl Entry<'_> {
    fn width(&self, canvas: &Canvas) -> f64 {
        SAMPLE + 5.0 + canvas.text_width(self.name, TEXT_SIZE) + ENTRY_GAP
    }

    fn draw(&self, canvas: &Canvas, x: f64, y: f64) -> Drawn {
        match self.style {
            Some(Style::Points) => canvas.dot((x + 0.5 * SAMPLE, y), 1.5 * DOT, self.colour)?,
            Some(style) => stroke(canvas, &[(x, y), (x + SAMPLE, y)], self.colour, style)?,
            None => {
                let corners = [(x, y - 5.0), (x + SAMPLE, y - 5.0), (x + SAMPLE, y + 5.0), (x, y + 5.0)];
                canvas.shape(&corners, self.colour, BAND_OPACITY)?;
            }
        }
        canvas.text(&Text::left(self.name, x + SAMPLE + 5.0, y, TEXT_SIZE, INK))
    }
}
