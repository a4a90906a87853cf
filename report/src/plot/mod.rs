//! Pictures of series: panels of lines, points, bands and markers, as SVG text or as PNG.
//!
//! Callers give values in SI units; the axis picks the prefix (40e-6 m is drawn as 40 µm). Colours are the palette of
//! Okabe and Ito (2008), which the colour-blind can tell apart, on white. Long series are thinned to what pixels can
//! show, without losing an extreme. A picture has no clock and no random part: equal data give equal bytes.

mod canvas;
mod chart;
mod palette;
mod panel;
mod scale;
mod thin;

pub use chart::{Axis, Band, Direction, Legend, Line, Marker, Panel, Style};
pub use palette::Role;

use crate::error::ReportError;
use canvas::{Canvas, Rectangle, Text};

/// One picture: a title and panels, laid out row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    pub title: String,
    /// Panels side by side.
    pub columns: usize,
    pub panels: Vec<Panel>,
}

/// Height of the figure's title, pixels.
const TITLE_HEIGHT: f64 = 34.0;

impl Figure {
    pub fn new(title: &str) -> Self {
        Figure {
            title: title.to_owned(),
            columns: 1,
            panels: Vec::new(),
        }
    }

    /// Panels side by side.
    #[must_use]
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns;
        self
    }

    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// SVG text of this size in pixels. Lines are placed to a quarter of a pixel.
    pub fn svg(&self, width: u32, height: u32) -> Result<String, ReportError> {
        canvas::svg(width, height, |canvas| self.draw(canvas, width, height))
    }

    /// PNG bytes with two dots per pixel in each direction, so `width` 800 gives 1600 dots.
    pub fn png(&self, width: u32, height: u32) -> Result<Vec<u8>, ReportError> {
        canvas::png(width, height, |canvas| self.draw(canvas, width, height))
    }

    fn draw(&self, canvas: &mut dyn Canvas, width: u32, height: u32) -> Result<(), ReportError> {
        let (width, height) = (f64::from(width), f64::from(height));
        let top = if self.title.is_empty() { 0.0 } else { TITLE_HEIGHT };
        if !self.title.is_empty() {
            canvas.text(&Text::left(&self.title, 14.0, 22.0, 16.0, palette::INK))?;
        }
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        let rows = self.panels.len().div_ceil(columns).max(1);
        let size = (width / columns as f64, (height - top) / rows as f64);
        for (index, panel) in self.panels.iter().enumerate() {
            let (left, upper) = (
                (index % columns) as f64 * size.0,
                top + (index / columns) as f64 * size.1,
            );
            let place = Rectangle {
                left,
                right: left + size.0,
                top: upper,
                bottom: upper + size.1,
            };
            panel::draw(canvas, panel, place)?;
        }
        Ok(())
    }
}
