//! What is plotted, in the units of people ([`crate::Scales`]): one table of entities, each a few signals in one wide row. Names are short,
//! because legends cover plots; the unit stands in the view's title.

use crate::extremes::{Column, thin};
use crate::row::{Presence, Row};
use crate::run::RunInfo;

/// Draws rows, thinned by a number, into a column. A function of many rows, so that the compiler sees what it does with each.
type Draw = fn(&[Row], &RunInfo, usize, &mut Column);

/// One line of a plot.
pub(crate) struct Series {
    pub name: &'static str,
    /// Red, green, blue, opacity.
    pub color: u32,
    pub width: f32,
    pub draw: Draw,
    /// Whether this run has the signal at all.
    pub exists: fn(Presence) -> bool,
}

/// Some lines that share an entity.
pub(crate) struct Plot {
    pub entity: &'static str,
    /// Constant lines: two rows a block are enough.
    pub constant: bool,
    pub series: &'static [Series],
}

const BLUE: u32 = 0x3B82_F6FF;
const ORANGE: u32 = 0xF59E_0BFF;
const GREEN: u32 = 0x22C5_5EFF;
const RED: u32 = 0xEF44_44FF;
const VIOLET: u32 = 0xA78B_FAFF;
const GREY: u32 = 0x9CA3_AFFF;
const DIM: u32 = 0x9CA3_AF90;
const BAND: u32 = 0x9CA3_AF30;
const FAINT_BLUE: u32 = 0x93C5_FD48;
const PALE_BLUE: u32 = 0x93C5_FD90;

/// What is drawn of a row and its run.
macro_rules! of {
    (|$row:tt, $run:tt| $value:expr) => {
        |rows, run, n, into| {
            let $run = run;
            thin(rows, n, |$row: &Row| $value, into);
        }
    };
}

const fn line(name: &'static str, color: u32, width: f32, draw: Draw) -> Series {
    Series {
        name,
        color,
        width,
        draw,
        exists: |_| true,
    }
}

const fn when(exists: fn(Presence) -> bool, series: Series) -> Series {
    Series { exists, ..series }
}

const fn lines(entity: &'static str, series: &'static [Series]) -> Plot {
    Plot {
        entity,
        constant: false,
        series,
    }
}

const fn limits(entity: &'static str, series: &'static [Series]) -> Plot {
    Plot {
        entity,
        constant: true,
        series,
    }
}

const CELSIUS: f64 = 273.15;
/// What is drawn where nothing is known, A/m: wide against any range of `a` that matters, and finite.
const NOTHING_KNOWN_A_PER_M: f64 = 100.0;

/// By how much of what was believed an estimate has moved, %.
fn percent(estimate: f64, believed: f64) -> f64 {
    100.0 * (estimate / believed - 1.0)
}

/// The inverse of a token that says how well something is known.
fn shown_deviation(per_a_per_m: f64) -> f64 {
    (1.0 / per_a_per_m).min(NOTHING_KNOWN_A_PER_M)
}

/// All plots. Entities of one view are drawn in the order of their names.
pub(crate) const PLOTS: &[Plot] = &[
    lines(
        "track/band",
        // Alternates between the two limits: plots have no filled areas, but show the envelope of what is too dense to draw.
        &[line(
            "± tolerance",
            BAND,
            1.5,
            of!(|row, run| {
                let side = if row.tick.is_multiple_of(2) { -1.0 } else { 1.0 };
                (row.demand.reference_m + side * run.tolerance_m) * run.scales.output.factor
            }),
        )],
    ),
    lines(
        "track/lines",
        &[
            line(
                "± tolerance",
                DIM,
                1.0,
                of!(|row, run| { (row.demand.reference_m - run.tolerance_m) * run.scales.output.factor }),
            ),
            line(
                "± tolerance",
                DIM,
                1.0,
                of!(|row, run| { (row.demand.reference_m + run.tolerance_m) * run.scales.output.factor }),
            ),
            line(
                "reference",
                BLUE,
                3.0,
                of!(|row, run| { row.demand.reference_m * run.scales.output.factor }),
            ),
            line(
                "position",
                ORANGE,
                1.5,
                of!(|row, run| { row.measurement.displacement_m * run.scales.output.factor }),
            ),
        ],
    ),
    lines(
        "error/lines",
        &[
            line(
                "measured",
                FAINT_BLUE,
                1.0,
                of!(|row, run| { row.demand.error_m * run.scales.error.factor }),
            ),
            when(
                |has| has.truth,
                line(
                    "true",
                    RED,
                    1.0,
                    of!(|row, run| { row.true_error_m() * run.scales.error.factor }),
                ),
            ),
        ],
    ),
    limits(
        "error/tolerance",
        &[
            line(
                "± tolerance",
                GREY,
                1.0,
                of!(|_, run| { run.tolerance_m * run.scales.error.factor }),
            ),
            line(
                "± tolerance",
                GREY,
                1.0,
                of!(|_, run| { -run.tolerance_m * run.scales.error.factor }),
            ),
        ],
    ),
    limits(
        "shape/range",
        &[
            line("range", DIM, 1.0, of!(|_, run| run.parameter_range[1])),
            line("range", DIM, 1.0, of!(|_, run| run.parameter_range[0])),
        ],
    ),
    lines(
        "shape/lines",
        &[
            when(
                |has| has.deviation,
                line(
                    "± 2σ",
                    PALE_BLUE,
                    1.0,
                    of!(|row, _| { row.estimate.shape_a_per_m + 2.0 * row.estimate.standard_deviation_a_per_m }),
                ),
            ),
            when(
                |has| has.deviation,
                line(
                    "± 2σ",
                    PALE_BLUE,
                    1.0,
                    of!(|row, _| { row.estimate.shape_a_per_m - 2.0 * row.estimate.standard_deviation_a_per_m }),
                ),
            ),
            when(
                |has| has.truth && has.shape,
                line("true", GREEN, 3.0, of!(|row, _| row.truth.shape_a_per_m)),
            ),
            when(
                |has| has.shape,
                line("estimated", BLUE, 1.5, of!(|row, _| row.estimate.shape_a_per_m)),
            ),
        ],
    ),
    lines(
        "parameters",
        &[
            when(
                |has| has.parameters,
                line(
                    "Ms",
                    VIOLET,
                    1.5,
                    of!(|row, run| { percent(row.estimate.saturation_magnetization_a_per_m, run.material[0]) }),
                ),
            ),
            when(
                |has| has.parameters,
                line(
                    "k",
                    ORANGE,
                    1.5,
                    of!(|row, run| { percent(row.estimate.pinning_a_per_m, run.material[1]) }),
                ),
            ),
            when(
                |has| has.parameters,
                line(
                    "c",
                    GREEN,
                    1.5,
                    of!(|row, run| { percent(row.estimate.reversibility, run.material[2]) }),
                ),
            ),
        ],
    ),
    lines(
        "covers",
        &[
            line(
                "lower cover",
                VIOLET,
                1.0,
                of!(|row, run| { row.estimate.lower_cover_m * run.scales.output.factor }),
            ),
            line(
                "predicted output f(a)",
                ORANGE,
                1.5,
                of!(|row, run| { row.estimate.predicted_output_m * run.scales.output.factor }),
            ),
            line(
                "upper cover",
                GREEN,
                1.0,
                of!(|row, run| { row.estimate.upper_cover_m * run.scales.output.factor }),
            ),
        ],
    ),
    lines(
        "output_error",
        &[line(
            "predicted − measured",
            VIOLET,
            1.0,
            of!(|row, run| { row.estimate.output_error_m * run.scales.error.factor }),
        )],
    ),
    lines(
        "excitation",
        &[
            when(
                |has| has.information,
                line(
                    "bound from the recent motion",
                    BLUE,
                    2.0,
                    of!(|row, _| { shown_deviation(row.estimate.information_per_a2_per_m2.sqrt()) }),
                ),
            ),
            when(
                |has| has.deviation,
                line(
                    "standard deviation of the law",
                    ORANGE,
                    1.5,
                    of!(|row, _| { row.estimate.standard_deviation_a_per_m }),
                ),
            ),
            when(
                |has| has.information,
                line(
                    "(19) needs, truth above",
                    GREEN,
                    1.0,
                    of!(|row, _| { shown_deviation(row.estimate.excitation_above_per_a_per_m) }),
                ),
            ),
            when(
                |has| has.information,
                line(
                    "(19) needs, truth below",
                    VIOLET,
                    1.0,
                    of!(|row, _| { shown_deviation(row.estimate.excitation_below_per_a_per_m) }),
                ),
            ),
        ],
    ),
    limits(
        "field/limit",
        &[
            line(
                "upper limit",
                RED,
                1.0,
                of!(|_, run| { run.field_limit_a_per_m * run.scales.input.factor }),
            ),
            line(
                "lower limit",
                RED,
                1.0,
                of!(|_, run| { run.lowest_field_a_per_m * run.scales.input.factor }),
            ),
        ],
    ),
    lines(
        "field/lines",
        &[
            line(
                "from the guard",
                BLUE,
                3.0,
                of!(|row, run| { row.safe_field.field_a_per_m * run.scales.input.factor }),
            ),
            line(
                "in the coil",
                ORANGE,
                1.5,
                of!(|row, run| { row.coil_field.field_a_per_m * run.scales.input.factor }),
            ),
        ],
    ),
    lines(
        "magnetization",
        &[
            line(
                "demanded, two ticks ahead",
                BLUE,
                3.0,
                of!(|row, run| { row.demand.magnetization_a_per_m * run.scales.response.factor }),
            ),
            when(
                |has| has.truth,
                line(
                    "true",
                    GREEN,
                    2.0,
                    of!(|row, run| { row.truth.magnetization_a_per_m * run.scales.response.factor }),
                ),
            ),
            line(
                "estimated",
                ORANGE,
                1.0,
                of!(|row, run| { row.estimate.magnetization_a_per_m * run.scales.response.factor }),
            ),
        ],
    ),
    lines(
        "feedback",
        &[line(
            "feedback part",
            BLUE,
            1.0,
            of!(|row, run| { row.demand.feedback_a_per_m * run.scales.response.factor }),
        )],
    ),
    lines(
        "temperature",
        &[
            when(
                |has| has.truth,
                line("true", RED, 1.5, of!(|row, _| row.truth.temperature_k - CELSIUS)),
            ),
            when(
                |has| has.thermometer,
                line(
                    "measured",
                    ORANGE,
                    1.0,
                    of!(|row, _| { row.measurement.temperature_k - CELSIUS }),
                ),
            ),
        ],
    ),
    lines(
        "force",
        &[when(
            |has| has.force,
            line("cutting force", VIOLET, 1.0, of!(|row, _| row.truth.cutting_force_n)),
        )],
    ),
];

/// A plot's lines that this run has.
pub(crate) fn present(plot: &Plot, has: Presence) -> impl Iterator<Item = &'static Series> + Clone {
    plot.series.iter().filter(move |series| (series.exists)(has))
}
