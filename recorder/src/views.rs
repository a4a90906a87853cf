//! Which views there are, where, and how they look. Left: is the reference tracked, how large is the error, is `a` found.
//! Right: the loops and the field. Below: what happened, in which state each node is, how warm the rod is.

use crate::Scales;
use crate::axes::BOX;
use crate::loops::HISTORIES;
use crate::timing::{ANSWERS, PERIODS, QUANTILES};
use crate::tokens::TIMELINE;
use rerun::blueprint::components::{Corner2D, LinkAxis};
use rerun::blueprint::datatypes::{TextLogColumn, TextLogColumnKind, TimelineColumn};
use rerun::blueprint::{
    BarChartView, ContainerLike, Horizontal, Spatial2DView, StateTimelineView, Tabs, TextDocumentView, TextLogView,
    TimeSeriesView, Vertical,
};
use rerun::{AsComponents, SerializedComponentBatch};
use rerun_types::blueprint::archetypes::{
    PlotLegend, ScalarAxis, TextLogColumns, TimeAxis, VisibleTimeRanges, VisualBounds2D,
};
use rerun_types::datatypes::{Range2D, TimeInt, TimeRange, TimeRangeBoundary, VisibleTimeRange};

/// What the layout depends on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    /// Length of the zoomed plots.
    pub zoom_s: f64,
    pub scales: Scales,
    /// Half the height of the error plot, in its unit; None: as the data want it.
    pub error_axis: Option<f64>,
    /// There are histograms of periods and answers.
    pub timed: bool,
    /// The tolerance is drawn in the error plot if it fits.
    pub tolerance: f64,
    /// Whether the lines of limit and range are drawn: not where they would squash what is between them.
    pub shows_field_limit: bool,
    pub shows_shape_range: bool,
    /// Other parameters than `a` are estimated.
    pub shows_parameters: bool,
}

/// A property of a view.
pub(crate) struct Property {
    /// Where it stands in the blueprint.
    pub path: String,
    pub batches: Vec<SerializedComponentBatch>,
}

/// Views being laid out, and the properties gathered on the way.
#[derive(Default)]
pub(crate) struct Desk {
    pub properties: Vec<Property>,
}

/// How much of the time a view shows.
#[derive(Clone, Copy)]
pub(crate) enum Span {
    /// The whole run; all such views scroll and zoom together.
    Run,
    /// The time before the cursor, in seconds.
    Last(f64),
}

impl Desk {
    pub fn property(&mut self, view: &ContainerLike, name: &str, archetype: &dyn AsComponents) {
        if let ContainerLike::View(view) = view {
            let path = format!("{}/{name}", view.blueprint_path());
            self.properties.push(Property {
                path,
                batches: archetype.as_serialized_batches(),
            });
        }
    }

    pub fn plot(&mut self, name: &str, contents: &[&str], span: Span) -> ContainerLike {
        let view: ContainerLike = TimeSeriesView::new(name)
            .with_origin("/")
            .with_contents(contents.iter().copied())
            .into();
        self.property(&view, "PlotLegend", &PlotLegend::new().with_corner(Corner2D::LeftTop));
        match span {
            Span::Run => self.property(&view, "TimeAxis", &TimeAxis::new().with_link(LinkAxis::LinkToGlobal)),
            Span::Last(seconds) => self.property(&view, "VisibleTimeRanges", &before_cursor(Some(seconds))),
        }
        view
    }

    /// A box of [`crate::axes`] with so much room for a legend below it.
    pub fn plane(&mut self, name: &str, entity: &str, legend: f64) -> ContainerLike {
        let view: ContainerLike = Spatial2DView::new(name).with_origin(entity).into();
        let bounds = Range2D {
            x_range: [-0.2, BOX[0] + 0.05].into(),
            y_range: [-0.2, BOX[1] + 0.24 + legend].into(),
        };
        self.property(&view, "VisualBounds2D", &VisualBounds2D::new(bounds));
        view
    }

    fn loop_view(&mut self, name: &str, entity: &str, seconds: f64) -> ContainerLike {
        let view = self.plane(name, entity, 0.0);
        self.property(&view, "VisibleTimeRanges", &before_cursor(Some(seconds)));
        for history in HISTORIES.iter().filter(|history| history.starts_with(entity)) {
            self.property(
                &view,
                &format!("ViewContents/overrides/{history}/visualizers"),
                &before_cursor(None),
            );
        }
        view
    }
}

/// From some seconds before the cursor, or from the start, up to the cursor.
fn before_cursor(seconds: Option<f64>) -> VisibleTimeRanges {
    let relative = |seconds: f64| TimeRangeBoundary::CursorRelative(TimeInt((seconds * 1e9) as i64));
    let start = seconds.map_or(TimeRangeBoundary::Infinite, |seconds| relative(-seconds));
    VisibleTimeRanges::new([VisibleTimeRange {
        timeline: TIMELINE.into(),
        range: TimeRange {
            start,
            end: relative(0.0),
        },
    }])
}

/// The whole window.
pub(crate) fn arrange(layout: &Layout) -> (ContainerLike, Vec<Property>) {
    let mut desk = Desk::default();
    let left = left(&mut desk, layout);
    let right = right(&mut desk, layout);
    let bottom = bottom(&mut desk, layout);
    let top = Horizontal::new([left, right]).with_column_shares([1.0, 1.0]);
    let root = Vertical::new([top.into(), bottom]).with_row_shares([2.8, 1.0]);
    (root.into(), desk.properties)
}

fn left(desk: &mut Desk, layout: &Layout) -> ContainerLike {
    let last = Span::Last(layout.zoom_s);
    let (output, unit) = (&layout.scales.output.unit, &layout.scales.error.unit);
    let zoom_name = format!("Tracking, last {} s [{output}]", layout.zoom_s);
    let tracking = Tabs::new([
        desk.plot(&zoom_name, &["/track/**"], last),
        desk.plot(&format!("Tracking, whole run [{output}]"), &["/track/**"], Span::Run),
    ]);
    let fits = layout.error_axis.is_some_and(|height| layout.tolerance <= height);
    let contents: &[&str] = if fits { &["/error/**"] } else { &["/error/lines"] };
    // The plot's own ticks are sparse where it is low, so the title tells its height.
    let title = layout.error_axis.map_or_else(
        || format!("Tracking error [{unit}]"),
        |height| format!("Tracking error, ±{height} {unit}"),
    );
    let error = desk.plot(&title, contents, Span::Run);
    if let Some(height) = layout.error_axis {
        desk.property(&error, "ScalarAxis", &ScalarAxis::new().with_range([-height, height]));
    }
    let shape = if layout.shows_shape_range {
        "/shape/**"
    } else {
        "/shape/lines"
    };
    let mut shapes = Vec::new();
    if layout.scales.shape {
        shapes.push(desk.plot("Shape parameter a [A/m]", &[shape], Span::Run));
        shapes.push(desk.plot("How well a is known [A/m]", &["/excitation"], Span::Run));
    }
    let covers = if layout.scales.shape {
        "Covers"
    } else {
        "Predicted output"
    };
    shapes.push(desk.plot(&format!("{covers} [{output}]"), &["/covers"], last));
    let title = format!("Output error of the estimator [{unit}]");
    shapes.push(desk.plot(&title, &["/output_error"], Span::Run));
    if layout.shows_parameters {
        let title = "Other parameters, against what was believed [%]";
        shapes.insert(1, desk.plot(title, &["/parameters"], Span::Run));
    }
    let shape = Tabs::new(shapes);
    Vertical::new([tracking.into(), error, shape.into()])
        .with_row_shares([1.2, 1.0, 1.0])
        .into()
}

fn right(desk: &mut Desk, layout: &Layout) -> ContainerLike {
    let last = Span::Last(layout.zoom_s);
    let (input, response) = (&layout.scales.input.unit, &layout.scales.response.unit);
    let (names, driven, given) = if layout.scales.shape {
        (
            ["Magnetization over field", "Displacement over field"],
            "Field",
            "Magnetization",
        )
    } else {
        (
            ["Output of the law over input", "Measured output over input"],
            "Input",
            "Output of the law",
        )
    };
    let loops = Horizontal::new([
        desk.loop_view(names[0], "loops/magnetization", layout.zoom_s),
        desk.loop_view(names[1], "loops/displacement", layout.zoom_s),
    ]);
    let field = if layout.shows_field_limit {
        "/field/**"
    } else {
        "/field/lines"
    };
    let field = Tabs::new([
        desk.plot(&format!("{driven}, whole run [{input}]"), &[field], Span::Run),
        desk.plot(
            &format!("{driven}, last {} s [{input}]", layout.zoom_s),
            &["/field/lines"],
            last,
        ),
        desk.plot(&format!("{given} [{response}]"), &["/magnetization"], last),
        desk.plot(&format!("Feedback [{response}]"), &["/feedback"], Span::Run),
    ]);
    Vertical::new([loops.into(), field.into()])
        .with_row_shares([2.0, 1.2])
        .into()
}

fn bottom(desk: &mut Desk, layout: &Layout) -> ContainerLike {
    let events: ContainerLike = TextLogView::new("Events").with_origin("events").into();
    let column = |kind| TextLogColumn {
        visible: true.into(),
        kind,
    };
    let columns = TextLogColumns::new()
        .with_timeline_columns([TimelineColumn {
            visible: true.into(),
            timeline: TIMELINE.into(),
        }])
        .with_text_log_columns([TextLogColumnKind::LogLevel, TextLogColumnKind::Body].map(column));
    desk.property(&events, "TextLogColumns", &columns);
    let states = StateTimelineView::new("States").with_origin("status").into();
    let around = Tabs::new([
        desk.plot("Temperature [°C]", &["/temperature"], Span::Run),
        desk.plot("Cutting force [N]", &["/force"], Span::Run),
        TextDocumentView::new("Notes").with_origin("notes").into(),
    ]);
    if layout.timed {
        let times = Tabs::new([
            ContainerLike::from(BarChartView::new("Answers [µs]").with_origin(ANSWERS)),
            BarChartView::new("Periods [µs]").with_origin(PERIODS).into(),
            TextDocumentView::new("Times").with_origin(QUANTILES).into(),
        ]);
        return Horizontal::new([events, states, times.into(), around.into()])
            .with_column_shares([1.1, 0.8, 1.0, 0.6])
            .into();
    }
    Horizontal::new([events, states, around.into()])
        .with_column_shares([1.3, 1.0, 0.8])
        .into()
}
