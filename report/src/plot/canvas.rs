//! What a panel draws on: lines, shapes and text in pixels, on plotters' SVG or bitmap backend.
//!
//! Both backends count in whole dots, so pictures are drawn four times as large: SVG is scaled back by its view box,
//! a bitmap by averaging dots in pairs, which also smooths its edges.

use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::palette::{Colour, PAPER};
use crate::error::ReportError;

/// Dots per pixel.
const DOTS: u32 = 4;
/// Dots of a bitmap that become one.
const AVERAGED: u32 = 2;
/// Letters for bitmaps and for measuring text; SVG leaves the choice of letters to its reader.
const FONT: &[u8] = include_bytes!("../../assets/DejaVuSans-subset.ttf");
const FAMILY: &str = "sans-serif";
/// plotters takes the height of a line, which is this many times the size of the letters.
const LINE_HEIGHT: f64 = 1.24;

/// Sides in pixels, y downwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Rectangle {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }
}

/// Where a text begins, ends, or has its middle.
#[derive(Clone, Copy, Debug)]
pub(super) enum Hold {
    Left,
    Middle,
    Right,
}

/// A line of text, held at half its height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Text<'a> {
    pub words: &'a str,
    pub x: f64,
    pub y: f64,
    pub size: f64,
    pub hold: Hold,
    /// Reads from below.
    pub upright: bool,
    pub colour: Colour,
}

impl<'a> Text<'a> {
    pub fn left(words: &'a str, x: f64, y: f64, size: f64, colour: Colour) -> Self {
        let hold = Hold::Left;
        Text {
            words,
            x,
            y,
            size,
            hold,
            upright: false,
            colour,
        }
    }

    pub fn held(self, hold: Hold) -> Self {
        Text { hold, ..self }
    }

    pub fn upright(self) -> Self {
        Text { upright: true, ..self }
    }
}

/// Drawing in pixels.
pub(super) trait Canvas {
    fn path(&mut self, points: &[(f64, f64)], colour: Colour, width: f64) -> Result<(), ReportError>;
    fn shape(&mut self, points: &[(f64, f64)], colour: Colour, opacity: f64) -> Result<(), ReportError>;
    fn dot(&mut self, at: (f64, f64), radius: f64, colour: Colour) -> Result<(), ReportError>;
    fn text(&mut self, text: &Text) -> Result<(), ReportError>;
    /// Pixels that a line of text takes.
    fn text_width(&self, words: &str, size: f64) -> f64;
}

struct OnPlotters<'a, Backend: DrawingBackend> {
    area: &'a DrawingArea<Backend, Shift>,
    kind: Kind,
}

/// What the backends do not do alike.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Svg,
    /// Joins thick lines in spikes, so every stretch is drawn alone with a dot at its joints; sets text this many
    /// letter sizes too high.
    Bitmap,
}

/// See [`Kind::Bitmap`].
const BITMAP_RISE: f64 = 0.25;

fn dots(pixels: f64) -> i32 {
    (pixels * f64::from(DOTS)).round() as i32
}

fn rgb(colour: Colour) -> RGBColor {
    RGBColor(colour.0, colour.1, colour.2)
}

fn points_in_dots(points: &[(f64, f64)]) -> Vec<(i32, i32)> {
    points.iter().map(|(x, y)| (dots(*x), dots(*y))).collect()
}

fn letters(size: f64) -> TextStyle<'static> {
    TextStyle::from((FAMILY, size * LINE_HEIGHT * f64::from(DOTS)).into_font())
}

impl<Backend: DrawingBackend> Canvas for OnPlotters<'_, Backend> {
    fn path(&mut self, points: &[(f64, f64)], colour: Colour, width: f64) -> Result<(), ReportError> {
        let style = rgb(colour).stroke_width(dots(width).max(1) as u32);
        let points = points_in_dots(points);
        if self.kind == Kind::Svg || points.len() < 3 {
            return self.area.draw(&PathElement::new(points, style)).map_err(refuse);
        }
        for pair in points.windows(2) {
            self.area.draw(&PathElement::new(pair, style)).map_err(refuse)?;
            let joint = Circle::new(pair[1], dots(0.5 * width) - 1, rgb(colour).filled());
            self.area.draw(&joint).map_err(refuse)?;
        }
        Ok(())
    }

    fn shape(&mut self, points: &[(f64, f64)], colour: Colour, opacity: f64) -> Result<(), ReportError> {
        let style = rgb(colour).mix(opacity).filled();
        self.area
            .draw(&Polygon::new(points_in_dots(points), style))
            .map_err(refuse)
    }

    fn dot(&mut self, at: (f64, f64), radius: f64, colour: Colour) -> Result<(), ReportError> {
        let circle = Circle::new((dots(at.0), dots(at.1)), dots(radius), rgb(colour).filled());
        self.area.draw(&circle).map_err(refuse)
    }

    fn text(&mut self, text: &Text) -> Result<(), ReportError> {
        let hold = match text.hold {
            Hold::Left => HPos::Left,
            Hold::Middle => HPos::Center,
            Hold::Right => HPos::Right,
        };
        let colour = rgb(text.colour);
        let mut style = letters(text.size).color(&colour).pos(Pos::new(hold, VPos::Center));
        if text.upright {
            style = style.transform(FontTransform::Rotate270);
        }
        let rise = if self.kind == Kind::Bitmap {
            BITMAP_RISE * text.size
        } else {
            0.0
        };
        let (right, down) = if text.upright { (rise, 0.0) } else { (0.0, rise) };
        let at = (dots(text.x + right), dots(text.y + down));
        self.area
            .draw(&plotters::element::Text::new(text.words.to_owned(), at, style))
            .map_err(refuse)
    }

    fn text_width(&self, words: &str, size: f64) -> f64 {
        let measured = self.area.estimate_text_size(words, &letters(size));
        measured.map_or(0.6 * size * words.chars().count() as f64, |(width, _)| {
            f64::from(width) / f64::from(DOTS)
        })
    }
}

type Drawing<'a> = &'a dyn Fn(&mut dyn Canvas) -> Result<(), ReportError>;

/// Draws and gives the SVG text.
pub(super) fn svg(
    width: u32,
    height: u32,
    draw: impl Fn(&mut dyn Canvas) -> Result<(), ReportError>,
) -> Result<String, ReportError> {
    let size = (width * DOTS, height * DOTS);
    let mut text = String::new();
    on_backend(SVGBackend::with_string(&mut text, size), Kind::Svg, &draw)?;
    let drawn = format!("width=\"{}\" height=\"{}\" viewBox", size.0, size.1);
    let round = "stroke-linejoin=\"round\" stroke-linecap=\"round\"";
    let shown = format!("width=\"{width}\" height=\"{height}\" {round} viewBox");
    // Most of what is drawn is opaque, which goes without saying.
    Ok(text.replacen(&drawn, &shown, 1).replace(" opacity=\"1\"", ""))
}

/// Draws and gives the bytes of a PNG.
pub(super) fn png(
    width: u32,
    height: u32,
    draw: impl Fn(&mut dyn Canvas) -> Result<(), ReportError>,
) -> Result<Vec<u8>, ReportError> {
    let size = (width * DOTS, height * DOTS);
    let mut colours = vec![0; 3 * size.0 as usize * size.1 as usize];
    on_backend(BitMapBackend::with_buffer(&mut colours, size), Kind::Bitmap, &draw)?;
    let small = (size.0 / AVERAGED, size.1 / AVERAGED);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, small.0, small.1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(refuse)?;
    writer.write_image_data(&averaged(&colours, small)).map_err(refuse)?;
    writer.finish().map_err(refuse)?;
    Ok(bytes)
}

fn on_backend<Backend: DrawingBackend>(backend: Backend, kind: Kind, draw: Drawing) -> Result<(), ReportError> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        // A font that cannot be read shows in the first text that is drawn.
        let _ = register_font(FAMILY, FontStyle::Normal, FONT);
    });
    let area = backend.into_drawing_area();
    area.fill(&rgb(PAPER)).map_err(refuse)?;
    draw(&mut OnPlotters { area: &area, kind })?;
    area.present().map_err(refuse)
}

/// The mean of each square of dots.
fn averaged(colours: &[u8], size: (u32, u32)) -> Vec<u8> {
    let (width, height, step) = (size.0 as usize, size.1 as usize, AVERAGED as usize);
    let mut small = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            for channel in 0..3 {
                let dot = |down: usize, right: usize| {
                    let index = (row * step + down) * width * step + column * step + right;
                    u32::from(colours[3 * index + channel])
                };
                let sum: u32 = (0..step * step).map(|index| dot(index / step, index % step)).sum();
                small.push((sum / (AVERAGED * AVERAGED)) as u8);
            }
        }
    }
    small
}

fn refuse(error: impl std::fmt::Display) -> ReportError {
    ReportError::Picture(error.to_string())
}
