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
use std::ops::Range;

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
    pair: Pair,
    exists: fn(Presence) -> bool,
}

/// A plane with its curves.
struct Plane {
    entity: &'static str,
    /// Which of [`Scales::axes`].
    axes: [usize; 2],
    curves: &'static [Curve],
}

type Point = [f64; 2];

/// What is drawn over what.
#[derive(Clone, Copy)]
enum Pair {
    TrueMagnetization,
    EstimatedMagnetization,
    Displacement,
}

const PAIRS: usize = 3;

impl Pair {
    /// Writes the points of rows.
    fn points(self, rows: &[Row], scales: &Scales, points: &mut Vec<Point>) {
        points.clear();
        let [input, response, output] = [&scales.input, &scales.response, &scales.output].map(|scale| scale.factor);
        match self {
            Self::TrueMagnetization => points.extend(rows.iter().map(|row| {
                let truth = &row.truth;
                [truth.coil_field_a_per_m * input, truth.magnetization_a_per_m * response]
            })),
            Self::EstimatedMagnetization => points.extend(rows.iter().map(|row| {
                let estimate = &row.estimate;
                [
                    estimate.field_a_per_m * input,
                    estimate.magnetization_a_per_m * response,
                ]
            })),
            Self::Displacement => points.extend(rows.iter().map(|row| {
                let measured = &row.measurement;
                [measured.coil_field_a_per_m * input, measured.displacement_m * output]
            })),
        }
    }
}

const fn history(pair: Pair) -> Curve {
    Curve {
        name: "before",
        color: 0x6B72_80FF,
        radius: 0.5,
        order: 20.0,
        least_distance: COARSE,
        pair,
        exists: |_| true,
    }
}

const PLANES: [Plane; 2] = [
    Plane {
        entity: "loops/magnetization",
        axes: [0, 1],
        curves: &[
            history(Pair::EstimatedMagnetization),
            Curve {
                name: "true",
                color: 0x22C5_5EFF,
                radius: 2.0,
                order: 30.0,
                least_distance: FINE,
                pair: Pair::TrueMagnetization,
                exists: |has| has.truth,
            },
            Curve {
                name: "estimated",
                color: 0xF59E_0BFF,
                radius: 0.8,
                order: 40.0,
                least_distance: FINE,
                pair: Pair::EstimatedMagnetization,
                exists: |_| true,
            },
        ],
    },
    Plane {
        entity: "loops/displacement",
        axes: [0, 2],
        curves: &[
            history(Pair::Displacement),
            Curve {
                name: "measured",
                color: 0xF59E_0BFF,
                radius: 1.0,
                order: 40.0,
                least_distance: FINE,
                pair: Pair::Displacement,
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
    strip: Vec<Point>,
    /// Strips that are over and wait to be sent together, with their times.
    done: Vec<(i64, Vec<[f32; 2]>)>,
}

impl Drawing {
    /// Adds points that are far enough from each other.
    fn add(&mut self, points: &[Point], axes: &Axes) {
        let least = self.curve.least_distance * self.curve.least_distance;
        let [x, y] = axes.scales();
        // Before the first point everything is far.
        let mut last = self.strip.last().copied().unwrap_or([f64::INFINITY; 2]);
        for point in points {
            let [right, up] = [(point[0] - last[0]) * x, (point[1] - last[1]) * y];
            if right * right + up * up >= least && point.iter().all(|value| value.is_finite()) {
                self.strip.push(*point);
                last = *point;
            }
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
    /// The axes have changed since they were written.
    grown: bool,
    drawings: Vec<Drawing>,
}

/// Both planes of one stream.
pub(crate) struct Loops {
    sheets: Vec<Sheet>,
    /// Of the rows that are being drawn, each pair's.
    points: [Vec<Point>; PAIRS],
    strip_ticks: u64,
    strip_end: u64,
    last_tick: u64,
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
                grown: false,
                drawings: drawings.collect(),
            }
        };
        Self {
            sheets: PLANES.iter().map(sheet).collect(),
            points: Default::default(),
            strip_ticks: ((0.25 * run.zoom_s() / run.tick_s) as u64).max(1),
            strip_end: 0,
            last_tick: 0,
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

    /// Draws rows; strips wait to be sent.
    pub fn rows(&mut self, run: &RunInfo, rows: &[Row]) {
        let mut points = std::mem::take(&mut self.points);
        for sheet in &mut self.sheets {
            sheet.fit(rows, &run.scales, &mut points);
        }
        let mut begun = 0;
        while begun < rows.len() {
            // Up to the row with which a strip ends.
            let last = rows[begun..].iter().position(|row| row.tick >= self.strip_end);
            let end = last.map_or(rows.len(), |last| begun + last + 1);
            self.sheets.iter_mut().for_each(|sheet| sheet.add(&points, begun..end));
            let tick = rows[end - 1].tick;
            if tick >= self.strip_end {
                self.strip_end = tick + self.strip_ticks;
                self.end_strips(run.time_ns(tick));
            }
            begun = end;
        }
        self.points = points;
        self.last_tick = rows.last().map_or(self.last_tick, |row| row.tick);
    }

    /// Ends the strips and sends what waits.
    pub fn send(&mut self, stream: &RecordingStream, run: &RunInfo) -> Result<(), RecorderError> {
        self.end_strips(run.time_ns(self.last_tick));
        for sheet in &mut self.sheets {
            if std::mem::take(&mut sheet.grown) {
                sheet.write_axes(stream, &run.scales)?;
            }
        }
        self.drawings().try_for_each(|drawing| drawing.send(stream))
    }

    fn end_strips(&mut self, time_ns: i64) {
        self.drawings().for_each(|drawing| drawing.end_strip(time_ns));
    }

    fn drawings(&mut self) -> impl Iterator<Item = &mut Drawing> {
        self.sheets.iter_mut().flat_map(|sheet| &mut sheet.drawings)
    }
}

impl Sheet {
    /// Makes the axes hold the rows, whose points are taken down.
    fn fit(&mut self, rows: &[Row], scales: &Scales, points: &mut [Vec<Point>; PAIRS]) {
        let [x, y] = &mut self.extents;
        let mut seen = [false; PAIRS];
        for pair in self.drawings.iter().map(|drawing| drawing.curve.pair) {
            if std::mem::replace(&mut seen[pair as usize], true) {
                continue;
            }
            let points = &mut points[pair as usize];
            pair.points(rows, scales, points);
            for point in points {
                x.add(point[0]);
                y.add(point[1]);
            }
        }
        if let [Some(x), Some(y)] = self.extents.map(|extent| extent.range()) {
            let axes = Axes { x, y };
            self.grown |= self.axes != Some(axes);
            self.axes = Some(axes);
        }
    }

    fn add(&mut self, points: &[Vec<Point>; PAIRS], rows: Range<usize>) {
        let Some(axes) = &self.axes else { return };
        for drawing in &mut self.drawings {
            drawing.add(&points[drawing.curve.pair as usize][rows.clone()], axes);
        }
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
