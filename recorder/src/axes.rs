//! Axes for the loops. Rerun's 2D views have equal scales, y down and no ticks: a static transform maps the data into a box,
//! and frame, grid and labels are static lines and points in the box's coordinates. When the data outgrows the box, the
//! transform and the axes are simply written again: the newest static data rules.

use crate::RecorderError;
use crate::error::Writing as _;
use rerun::RecordingStream;
use rerun_types::archetypes::{LineStrips2D, Points2D, Transform3D};
use rerun_types::components::{Color, Radius};

/// Width and height of the box that every loop is drawn in.
pub(crate) const BOX: [f64; 2] = [1.15, 1.0];

/// About the largest number of steps of an axis.
const STEPS: f64 = 6.0;
const FRAME: u32 = 0x9CA3_AFFF;
const GRID: u32 = 0x9CA3_AF38;
const ZERO: u32 = 0x9CA3_AFA0;
const TEXT: u32 = 0xD1D5_DBFF;

/// The range of one axis, ending on ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub low: f64,
    pub high: f64,
    pub step: f64,
}

impl Range {
    /// The smallest range of whole steps around the values; a step is 1, 2 or 5 times a power of ten.
    pub fn around(low: f64, high: f64) -> Self {
        // Values that do not differ still need an axis of some length.
        let width = (high - low).max(1e-3 * low.abs().max(high.abs())).max(1e-6);
        let step = nice(width / STEPS);
        let first = (low / step).floor();
        let last = (high / step).ceil().max(first + 1.0);
        Self {
            low: first * step,
            high: last * step,
            step,
        }
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        let count = ((self.high - self.low) / self.step).round() as usize;
        let Self { low, step, .. } = *self;
        // Adding 0.0 turns −0 into 0.
        (0..=count).map(move |tick| ((low / step).round() + tick as f64) * step + 0.0)
    }

    /// Where a value lies, 0 to 1.
    fn place(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// The smallest 1, 2 or 5 times a power of ten that is not below `value`.
pub(crate) fn nice(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|factor| factor * power >= value * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// What values have been seen so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    low: f64,
    high: f64,
}

impl Default for Extent {
    fn default() -> Self {
        Self {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        }
    }
}

impl Extent {
    /// Takes in a value; not-a-number and infinities are none.
    pub fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        }
    }

    /// From the least to the greatest; 0 before the first value.
    pub fn length(&self) -> f64 {
        (self.high - self.low).max(0.0)
    }

    /// The axis range that holds everything seen; None before the first value.
    pub fn range(&self) -> Option<Range> {
        (self.low <= self.high).then(|| Range::around(self.low, self.high))
    }
}

/// The two axes of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axes {
    pub x: Range,
    pub y: Range,
}

impl Axes {
    /// Scale and shift of the data per axis.
    fn maps(&self) -> [(f64, f64); 2] {
        let x = BOX[0] / (self.x.high - self.x.low);
        let y = BOX[1] / (self.y.high - self.y.low);
        [(x, -self.x.low * x), (-y, self.y.high * y)]
    }

    /// What a step in each coordinate is in the box.
    pub fn scales(&self) -> [f64; 2] {
        self.maps().map(|(scale, _)| scale)
    }

    /// Writes transform, frame, grid and labels below `entity`; data belongs below `{entity}/raw`.
    pub fn write(
        &self,
        stream: &RecordingStream,
        entity: &str,
        names: [&str; 2],
        curves: &[(&str, u32)],
    ) -> Result<(), RecorderError> {
        let [(x, x0), (y, y0)] = self.maps().map(|(scale, shift)| (scale as f32, shift as f32));
        let transform = Transform3D::from_translation_scale([x0, y0, 0.0], [x, y, 1.0]);
        stream
            .log_static(format!("{entity}/raw"), &transform)
            .writing("the scale of a loop")?;
        self.write_lines(stream, entity)?;
        self.write_labels(stream, entity, names)?;
        write_legend(stream, entity, curves)
    }

    fn write_lines(&self, stream: &RecordingStream, entity: &str) -> Result<(), RecorderError> {
        let (width, height) = (BOX[0] as f32, BOX[1] as f32);
        let mut strips: Vec<Vec<[f32; 2]>> = Vec::new();
        let mut colors = Vec::new();
        for tick in self.x.ticks() {
            let x = (self.x.place(tick) * BOX[0]) as f32;
            strips.push(vec![[x, 0.0], [x, height]]);
            colors.push(if tick == 0.0 { ZERO } else { GRID });
        }
        for tick in self.y.ticks() {
            let y = ((1.0 - self.y.place(tick)) * BOX[1]) as f32;
            strips.push(vec![[0.0, y], [width, y]]);
            colors.push(if tick == 0.0 { ZERO } else { GRID });
        }
        strips.push(vec![
            [0.0, 0.0],
            [width, 0.0],
            [width, height],
            [0.0, height],
            [0.0, 0.0],
        ]);
        colors.push(FRAME);
        let lines = LineStrips2D::new(strips)
            .with_colors(colors.into_iter().map(Color::from_u32))
            .with_radii([Radius::new_ui_points(0.5)])
            .with_draw_order(10.0);
        stream
            .log_static(format!("{entity}/axes/lines"), &lines)
            .writing("the axes of a loop")
    }

    fn write_labels(&self, stream: &RecordingStream, entity: &str, names: [&str; 2]) -> Result<(), RecorderError> {
        let (width, height) = (BOX[0] as f32, BOX[1] as f32);
        let x_ticks = self
            .x
            .ticks()
            .map(|tick| ([(self.x.place(tick) * BOX[0]) as f32, height], number(tick)));
        let y_ticks = self.y.ticks().map(|tick| {
            (
                [-0.09, ((1.0 - self.y.place(tick)) * BOX[1]) as f32 - 0.05],
                number(tick),
            )
        });
        let names = [
            ([width / 2.0, height + 0.1], names[0].to_owned()),
            ([0.12, -0.13], names[1].to_owned()),
        ];
        let (places, texts): (Vec<[f32; 2]>, Vec<String>) = x_ticks.chain(y_ticks).chain(names).unzip();
        let labels = Points2D::new(places)
            .with_labels(texts)
            .with_show_labels(true)
            .with_colors([Color::from_u32(TEXT)])
            .with_radii([Radius::new_ui_points(0.0)]);
        stream
            .log_static(format!("{entity}/axes/labels"), &labels)
            .writing("the labels of a loop")
    }
}

/// Letters that fit beside the ordinate's name above the box.
const SHORT: usize = 24;
const ROW: f64 = 0.085;

/// Height that the legend takes below the box: short names stand above it.
pub(crate) fn legend_below<'a>(names: impl Iterator<Item = &'a str>) -> f64 {
    let (count, letters) = names.fold((0, 0), |(count, letters), name| {
        (count + 1, letters + name.chars().count())
    });
    if letters > SHORT { ROW * f64::from(count) } else { 0.0 }
}

/// Names of the curves in their colours: above the box, or below it one a row.
fn write_legend(stream: &RecordingStream, entity: &str, curves: &[(&str, u32)]) -> Result<(), RecorderError> {
    let below = legend_below(curves.iter().map(|(name, _)| *name)) > 0.0;
    let places = (0..curves.len()).map(|at| {
        if below {
            [0.5 * BOX[0] as f32, (BOX[1] + 0.2 + ROW * at as f64) as f32]
        } else {
            [BOX[0] as f32 * (0.45 + 0.22 * at as f32), -0.13]
        }
    });
    let legend = Points2D::new(places)
        .with_labels(curves.iter().map(|(name, _)| *name))
        .with_show_labels(true)
        .with_colors(curves.iter().map(|(_, color)| Color::from_u32(*color)))
        .with_radii([Radius::new_ui_points(3.0)]);
    stream
        .log_static(format!("{entity}/axes/legend"), &legend)
        .writing("the legend of a loop")
}

/// A tick's number without digits that say nothing.
fn number(tick: f64) -> String {
    let text = format!("{tick:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards: ranges end on ticks, hold the values, and have a readable number of ticks.
    #[test]
    fn ranges_end_on_nice_ticks() {
        for (low, high) in [(-33.2, 41.0), (0.0, 1e-7), (-7.3e5, 7.3e5), (12.0, 13.0), (-1.0, -1.0)] {
            let range = Range::around(low, high);
            assert!(range.low <= low && range.high >= high, "{range:?}");
            let ticks = range.ticks().count();
            assert!((2..=9).contains(&ticks), "{ticks} ticks in {range:?}");
        }
        let labels: Vec<_> = Range::around(-33.2, 41.0).ticks().map(number).collect();
        assert_eq!(labels, ["-40", "-20", "0", "20", "40", "60"]);
    }

    /// Guards: the transform puts the corners of the range on the corners of the box, y up.
    #[test]
    fn data_fills_the_box() {
        let axes = Axes {
            x: Range::around(-4.0, 4.0),
            y: Range::around(0.0, 8.0),
        };
        let [(x, x0), (y, y0)] = axes.maps();
        assert_eq!(
            [-4.0 * x + x0, 4.0 * x + x0, 0.0 * y + y0, 8.0 * y + y0],
            [0.0, BOX[0], BOX[1], 0.0]
        );
    }
}
