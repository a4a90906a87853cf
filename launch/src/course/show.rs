//! The verdict on a trajectory as a table, and as charts over frequency.

use super::{CourseVerdict, LinesVerdict, MultisineVerdict, StepsVerdict, SweepVerdict};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::number::Si;
use anhyst_report::page::Section;
use anhyst_report::table::Table;

/// Gain, phase and largest error at a frequency, as far as they are known.
type Point = (f64, Option<f64>, Option<f64>, Option<f64>);

impl CourseVerdict {
    /// For people, lengths in `unit`; of long lists every second row, third, …, where `most_rows` asks for it.
    pub fn table(&self, most_rows: usize, unit: &str) -> Table {
        match self {
            Self::Steps(own) => steps(own, most_rows, unit),
            Self::Lines(own) => lines(own, unit),
            Self::Sweep(own) => {
                let header = ["frequency", "gain", "phase", "error max"];
                over_frequency(&header, &own.points(), usize::MAX, unit)
            }
            Self::Multisine(own) => over_frequency(&["frequency", "gain", "phase"], &own.points(), most_rows, unit),
        }
    }

    /// What the table does not say.
    fn sentence(&self) -> String {
        match self {
            Self::Steps(_) => {
                "Settling: from the step's beginning until the displacement stays within the tolerance of the new level, the worst of all times. \
                 Overshoot: the largest way beyond it."
                    .to_owned()
            }
            Self::Lines(_) => "Of lines that were seen from end to end; turns, and ways back that are of no use, are not judged.".to_owned(),
            Self::Sweep(own) => match own.bandwidth_hz {
                Some(own) => format!("Tracking bandwidth (-3 dB): {own:.1} Hz. Response of the displacement to the reference in thirds of an octave."),
                None => format!(
                    "The displacement follows within -3 dB up to the end, {:.1} Hz. Response of the displacement to the reference in thirds of an octave.",
                    own.highest_hz
                ),
            },
            Self::Multisine(own) => format!("Response of the displacement to the reference over {} whole periods.", own.periods),
        }
    }

    /// As a section of the run's page.
    pub(crate) fn section(&self, unit: &str) -> Section {
        let section = Section::new("Trajectory").paragraph(&self.sentence());
        let points = match self {
            Self::Steps(_) | Self::Lines(_) => Vec::new(),
            Self::Sweep(own) => own.points(),
            Self::Multisine(own) => own.points(),
        };
        let section = if points.is_empty() {
            section
        } else {
            section.figure(charts(&points, unit), "Displacement over reference.")
        };
        section.table(self.table(usize::MAX, unit))
    }

    /// As text below the figures.
    pub(crate) fn terminal(&self, unit: &str) -> String {
        format!("{}\n{}", self.sentence(), self.table(MOST_ROWS, unit).terminal())
    }
}

/// In a terminal.
const MOST_ROWS: usize = 24;

fn steps(own: &StepsVerdict, most_rows: usize, unit: &str) -> Table {
    let mut table = Table::new(["step", "reference takes", "settling", "overshoot", "times"]);
    for step in own.steps.iter().step_by(stride(own.steps.len(), most_rows)) {
        let settling = match (step.settling_s, step.unsettled) {
            (_, unsettled @ 1..) => format!("not in {unsettled} of {}", step.times),
            (Some(settling_s), 0) => Si(settling_s, "s").to_string(),
            (None, 0) => "no tolerance".to_owned(),
        };
        table.push([
            format!("{} to {}", Si(step.from_m, unit), Si(step.to_m, unit)),
            Si(step.over_s, "s").to_string(),
            settling,
            format!("{}, {:.2} %", Si(step.overshoot_m, unit), 100.0 * step.overshoot()),
            step.times.to_string(),
        ]);
    }
    table
}

fn lines(own: &LinesVerdict, unit: &str) -> Table {
    Table::default()
        .row([
            "lines".to_owned(),
            format!("{} of {}", own.lines, Si(own.length_m, unit)),
        ])
        .row([
            "nonlinearity".to_owned(),
            format!(
                "{}, {:.2e} of the line",
                Si(own.nonlinearity_m, unit),
                own.nonlinearity()
            ),
        ])
        .row(["offset".to_owned(), Si(own.offset_m, unit).to_string()])
        .row(["speed error".to_owned(), format!("{:.2e}", own.speed_error)])
        .row([
            "error max outside lines".to_owned(),
            Si(own.turn_error_max_m, unit).to_string(),
        ])
}

impl SweepVerdict {
    fn points(&self) -> Vec<Point> {
        let bands = self.bands.iter();
        bands
            .map(|own| (own.frequency_hz, own.gain, own.phase_deg, Some(own.error_max_m)))
            .collect()
    }
}

impl MultisineVerdict {
    fn points(&self) -> Vec<Point> {
        let lines = self.lines.iter();
        lines
            .map(|own| (own.frequency_hz, own.gain, own.phase_deg, None))
            .collect()
    }
}

fn stride(rows: usize, most_rows: usize) -> usize {
    rows.div_ceil(most_rows).max(1)
}

fn over_frequency(header: &[&str], points: &[Point], most_rows: usize, unit: &str) -> Table {
    let mut table = Table::new(header.iter().copied());
    for (frequency_hz, gain, phase_deg, error_m) in points.iter().step_by(stride(points.len(), most_rows)) {
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "none".to_owned());
        let known = [
            format!("{frequency_hz:.1} Hz"),
            or_none(gain.map(|gain| format!("{gain:.4}"))),
            // Rounded first: there is no -0.00°.
            or_none(phase_deg.map(|phase_deg| format!("{:.2}°", (100.0 * phase_deg).round() / 100.0 + 0.0))),
        ];
        table.push(
            known
                .into_iter()
                .chain(error_m.map(|error| Si(error, unit).to_string())),
        );
    }
    table
}

fn charts(points: &[Point], unit: &str) -> Figure {
    let curve = |of: fn(&Point) -> Option<f64>, role: Role| {
        Curve::new(points.iter().filter_map(|own| Some([own.0, of(own)?])), role)
    };
    let frequency = || Axis::new("frequency", "Hz").logarithmic();
    let mut charts = vec![
        Chart::new("gain", frequency(), Axis::new("gain", "")).curve(curve(|own| own.1, Role::Measured)),
        Chart::new("phase", frequency(), Axis::new("phase", "°")).curve(curve(|own| own.2, Role::Measured)),
    ];
    let error = curve(|own| own.3, Role::Remainder);
    if !error.points.is_empty() {
        charts.push(Chart::new("largest error", frequency(), Axis::new("error", unit).logarithmic()).curve(error));
    }
    Figure::new("Response", charts)
}
