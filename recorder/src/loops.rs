//! The two loops that show hysteresis: magnetization over field and displacement over field. They grow by short strips,
//! each starting where the last one ended; a loop is never written twice.

use crate::axes::{Axes, Extent};
use crate::error::Writing as _;
use crate::row::{Presence, Row};
use crate::run::RunInfo;
use crate::tokens::TIMELINE;
use crate::{RecorderError, Scales};
use rerun::RecordingStream;
use rerun::log::TimeColumn;
use rerun_types::archetypes::LineStrips2D;
use rerun_types::components::{Color, Radius};

/// Least distance of two points of a strip, as a fraction of the box's height.
const FINE: f64 = 0.004;
/// The same for the faint strips that stay.
const COARSE: f64 = 0.02;

/// A curve in a loop's plane.
struct Curve {
    name: &'static str,
    color: u32,
    radius: f32,
    /// Higher is drawn later.
    order: f32,
    least_distance: f64,
    point: fn(&Row, &Scales) -> [f64; 2],
    exists: fn(Presence) -> bool,
}

/// A plane with its curves.
struct Plane {
    entity: &'static str,
    /// Which of [`Scales::axes`].
    axes: [usize; 2],
    curves: &'static [Curve],
}

fn true_magnetization(row: &Row, scales: &Scales) -> [f64; 2] {
    [
        row.truth.coil_field_a_per_m * scales.input.factor,
        row.truth.magnetization_a_per_m * scales.response.factor,
    ]
}

fn estimated_magnetization(row: &Row, scales: &Scales) -> [f64; 2] {
    [
        row.estimate.field_a_per_m * scales.input.factor,
        row.estimate.magnetization_a_per_m * scales.response.factor,
    ]
}

fn displacement(row: &Row, scales: &Scales) -> [f64; 2] {
    [
        row.measurement.coil_field_a_per_m * scales.input.factor,
        row.measurement.displacement_m * scales.output.factor,
    ]
}

const fn history(point: fn(&Row, &Scales) -> [f64; 2]) -> Curve {
    Curve {
        name: "before",
        color: 0x6B72_80FF,
        radius: 0.5,
        order: 20.0,
        least_distance: COARSE,
        point,
        exists: |_| true,
    }
}

const PLANES: [Plane; 2] = [
    Plane {
        entity: "loops/magnetization",
        axes: [0, 1],
        curves: &[
            history(estimated_magnetization),
            Curve {
                name: "true",
                color: 0x22C5_5EFF,
                radius: 2.0,
                order: 30.0,
                least_distance: FINE,
                point: true_magnetization,
                exists: |has| has.truth,
            },
            Curve {
                name: "estimated",
                color: 0xF59E_0BFF,
                radius: 0.8,
                order: 40.0,
                least_distance: FINE,
                point: estimated_magnetization,
                exists: |_| true,
            },
        ],
    },
    Plane {
        entity: "loops/displacement",
        axes: [0, 2],
        curves: &[
            history(displacement),
            Curve {
                name: "measured",
                color: 0xF59E_0BFF,
                radius: 1.0,
                order: 40.0,
                least_distance: FINE,
                point: displacement,
                exists: |_| true,
            },
        ],
    },
];

/// Entities of the curves that show the whole run; all others show the zoomed time only.
pub(crate) const HISTORIES: [&str; 2] = ["loops/magnetization/raw/before", "loops/displacement/raw/before"];

/// A curve being drawn.
struct Drawing {
    entity: String,
    curve: &'static Curve,
    strip: Vec<[f64; 2]>,
    /// Strips that are over and wait to be sent together, with their times.
    done: Vec<(i64, Vec<[f32; 2]>)>,
}

impl Drawing {
    fn add(&mut self, row: &Row, axes: &Axes, scales: &Scales) {
        let point = (self.curve.point)(row, scales);
        let far = self
            .strip
            .last()
            .is_none_or(|last| axes.distance(*last, point) >= self.curve.least_distance);
        if far && point.iter().all(|value| value.is_finite()) {
            self.strip.push(point);
        }
    }

    fn end_strip(&mut self, time_ns: i64) {
        if self.strip.len() > 1 {
            let last = self.strip[self.strip.len() - 1];
            let strip = self.strip.iter().map(|point| point.map(|value| value as f32)).collect();
            self.done.push((time_ns, strip));
            self.strip.clear();
            self.strip.push(last);
        }
    }

    fn declare(&self, stream: &RecordingStream) -> Result<(), RecorderError> {
        let style = LineStrips2D::update_fields()
            .with_colors([Color::from_u32(self.curve.color)])
            .with_radii([Radius::new_ui_points(self.curve.radius)])
            .with_draw_order(self.curve.order);
        stream.log_static(self.entity.as_str(), &style).writing(&self.entity)
    }

    fn send(&mut self, stream: &RecordingStream) -> Result<(), RecorderError> {
        if self.done.is_empty() {
            return Ok(());
        }
        let (times, strips): (Vec<_>, Vec<_>) = self.done.drain(..).unzip();
        let columns = LineStrips2D::update_fields()
            .with_strips(strips)
            .columns_of_unit_batches()
            .writing(&self.entity)?;
        stream
            .send_columns(
                self.entity.as_str(),
                [TimeColumn::new_duration_nanos(TIMELINE, times)],
                columns,
            )
            .writing(&self.entity)
    }
}

/// One plane being drawn.
struct Sheet {
    plane: &'static Plane,
    extents: [Extent; 2],
    axes: Option<Axes>,
    drawings: Vec<Drawing>,
}

/// Both planes of one stream.
pub(crate) struct Loops {
    sheets: Vec<Sheet>,
    strip_ticks: u64,
    strip_end: u64,
}

impl Loops {
    /// The curves that the run has.
    pub fn new(run: &RunInfo, has: Presence) -> Self {
        let sheet = |plane: &'static Plane| {
            let curves = plane.curves.iter().filter(|curve| (curve.exists)(has));
            let drawings = curves.map(|curve| Drawing {
                entity: format!("{}/raw/{}", plane.entity, curve.name),
                curve,
                strip: Vec::new(),
                done: Vec::new(),
            });
            Sheet {
                plane,
                extents: [Extent::default(); 2],
                axes: None,
                drawings: drawings.collect(),
            }
        };
        Self {
            sheets: PLANES.iter().map(sheet).collect(),
            strip_ticks: ((0.25 * run.zoom_s() / run.tick_s) as u64).max(1),
            strip_end: 0,
        }
    }

    /// Writes the looks of the curves, and the axes as far as they are known.
    pub fn declare(&self, stream: &RecordingStream, scales: &Scales) -> Result<(), RecorderError> {
        for sheet in &self.sheets {
            sheet.drawings.iter().try_for_each(|drawing| drawing.declare(stream))?;
            sheet.write_axes(stream, scales)?;
        }
        Ok(())
    }

    /// Draws the rows of a block.
    pub fn rows(&mut self, stream: &RecordingStream, run: &RunInfo, rows: &[Row]) -> Result<(), RecorderError> {
        for sheet in &mut self.sheets {
            sheet.fit(stream, rows, &run.scales)?;
        }
        for row in rows {
            for sheet in &mut self.sheets {
                let Some(axes) = sheet.axes else { continue };
                sheet
                    .drawings
                    .iter_mut()
                    .for_each(|drawing| drawing.add(row, &axes, &run.scales));
            }
            if row.tick >= self.strip_end {
                self.strip_end = row.tick + self.strip_ticks;
                let time_ns = run.time_ns(row.tick);
                self.drawings().for_each(|drawing| drawing.end_strip(time_ns));
            }
        }
        if let Some(last) = rows.last() {
            let time_ns = run.time_ns(last.tick);
            self.drawings().for_each(|drawing| drawing.end_strip(time_ns));
        }
        self.drawings().try_for_each(|drawing| drawing.send(stream))
    }

    fn drawings(&mut self) -> impl Iterator<Item = &mut Drawing> {
        self.sheets.iter_mut().flat_map(|sheet| &mut sheet.drawings)
    }
}

impl Sheet {
    /// Makes the axes hold the rows.
    fn fit(&mut self, stream: &RecordingStream, rows: &[Row], scales: &Scales) -> Result<(), RecorderError> {
        for drawing in &self.drawings {
            for row in rows {
                let point = (drawing.curve.point)(row, scales);
                self.extents[0].add(point[0]);
                self.extents[1].add(point[1]);
            }
        }
        let [Some(x), Some(y)] = self.extents.map(|extent| extent.range()) else {
            return Ok(());
        };
        let axes = Axes { x, y };
        if self.axes == Some(axes) {
            return Ok(());
        }
        self.axes = Some(axes);
        self.write_axes(stream, scales)
    }

    fn write_axes(&self, stream: &RecordingStream, scales: &Scales) -> Result<(), RecorderError> {
        let Some(axes) = self.axes else { return Ok(()) };
        let curves = self
            .drawings
            .iter()
            .map(|drawing| (drawing.curve.name, drawing.curve.color));
        let all = scales.axes();
        let names = self.plane.axes.map(|axis| all[axis].as_str());
        axes.write(stream, self.plane.entity, names, &curves.collect::<Vec<_>>())
    }
}
