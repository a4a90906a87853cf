//! A figure as a picture that stands still: SVG text.
//!
//! Long series are thinned to what pixels can show, without losing an extreme. A picture has no clock and no random part:
//! equal data give equal bytes.

mod canvas;
mod panel;

use crate::chart::{Figure, role};
use crate::error::ReportError;
use canvas::{Canvas, Rectangle, Text};

/// Height of the figure's title, and size of a chart, pixels.
const TITLE_HEIGHT: f64 = 34.0;
const CHART: (u32, u32) = (640, 420);

impl Figure {
    /// SVG text. Lines are placed to a quarter of a pixel.
    ///
    /// # Errors
    /// If the picture cannot be drawn.
    pub fn svg(&self) -> Result<String, ReportError> {
        let (columns, rows) = self.grid();
        let title = if self.title.is_empty() { 0 } else { TITLE_HEIGHT as u32 };
        let (width, height) = (CHART.0 * columns as u32, CHART.1 * rows as u32 + title);
        canvas::svg(width, height, |canvas| self.draw(canvas, width, height))
    }

    fn draw(&self, canvas: &Canvas, width: u32, height: u32) -> Result<(), ReportError> {
        let (width, height) = (f64::from(width), f64::from(height));
        let top = if self.title.is_empty() { 0.0 } else { TITLE_HEIGHT };
        if !self.title.is_empty() {
            canvas.text(&Text::left(&self.title, 14.0, 22.0, 16.0, role::INK))?;
        }
        let (columns, rows) = self.grid();
        let size = (width / columns as f64, (height - top) / rows as f64);
        for (index, chart) in self.charts.iter().enumerate() {
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
            panel::draw(canvas, chart, place)?;
        }
        Ok(())
    }
}
