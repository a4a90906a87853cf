//! What a chart draws on: lines, shapes and text in pixels, on plotters' SVG backend.
//!
//! The backend counts in whole dots, so pictures are drawn four times as large and scaled back by their view box.

use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::chart::role::{Colour, PAPER};
use crate::error::ReportError;

/// Dots per pixel.
const DOTS: u32 = 4;
/// Letters for measuring text; SVG leaves the choice of letters to its reader.
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
pub(super) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

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

impl Canvas<'_> {
    pub fn path(&self, points: &[(f64, f64)], colour: Colour, width: f64) -> Result<(), ReportError> {
        let style = rgb(colour).stroke_width(dots(width).max(1) as u32);
        let path = PathElement::new(points_in_dots(points), style);
        self.area.draw(&path).map_err(refuse)
    }

    pub fn shape(&self, points: &[(f64, f64)], colour: Colour, opacity: f64) -> Result<(), ReportError> {
        let style = rgb(colour).mix(opacity).filled();
        self.area
            .draw(&Polygon::new(points_in_dots(points), style))
            .map_err(refuse)
    }

    pub fn dot(&self, at: (f64, f64), radius: f64, colour: Colour) -> Result<(), ReportError> {
        let circle = Circle::new((dots(at.0), dots(at.1)), dots(radius), rgb(colour).filled());
        self.area.draw(&circle).map_err(refuse)
    }

    pub fn text(&self, text: &Text) -> Result<(), ReportError> {
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
        let at = (dots(text.x), dots(text.y));
        self.area
            .draw(&plotters::element::Text::new(text.words.to_owned(), at, style))
            .map_err(refuse)
    }

    /// Pixels that a line of text takes.
    pub fn text_width(&self, words: &str, size: f64) -> f64 {
        let measured = self.area.estimate_text_size(words, &letters(size));
        measured.map_or(0.6 * size * words.chars().count() as f64, |(width, _)| {
            f64::from(width) / f64::from(DOTS)
        })
    }
}

/// Draws and gives the SVG text.
pub(super) fn svg(
    width: u32,
    height: u32,
    draw: impl Fn(&Canvas) -> Result<(), ReportError>,
) -> Result<String, ReportError> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        // A font that cannot be read shows in the first text that is drawn.
        let _ = register_font(FAMILY, FontStyle::Normal, FONT);
    });
    let size = (width * DOTS, height * DOTS);
    let mut text = String::new();
    let canvas = Canvas {
        area: SVGBackend::with_string(&mut text, size).into_drawing_area(),
    };
    canvas.area.fill(&rgb(PAPER)).map_err(refuse)?;
    draw(&canvas)?;
    canvas.area.present().map_err(refuse)?;
    drop(canvas);
    let drawn = format!("width=\"{}\" height=\"{}\" viewBox", size.0, size.1);
    let round = "stroke-linejoin=\"round\" stroke-linecap=\"round\"";
    let shown = format!("width=\"{width}\" height=\"{height}\" {round} viewBox");
    // Most of what is drawn is opaque, which goes without saying.
    Ok(text.replacen(&drawn, &shown, 1).replace(" opacity=\"1\"", ""))
}

fn refuse(error: impl std::fmt::Display) -> ReportError {
    ReportError::Picture(error.to_string())
}
