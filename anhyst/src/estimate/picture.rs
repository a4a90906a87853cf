//! An estimation as panels: where the estimate went, what was measured and predicted, what is left.

use super::Estimated;
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::HysteresisParameter;
use anhyst_report::chart::{Axis, Chart, Curve, Role, TIME};

/// The charts of an estimation.
pub fn picture(found: &Estimated, measured: &MeasuredRun) -> Vec<Chart> {
    let (over, report) = (&found.abscissa, &found.report);
    let abscissa = if measured.time_s.is_some() { TIME } else { "sample" };
    let mut charts: Vec<Chart> = found
        .courses
        .iter()
        .filter_map(|(symbol, course)| Some((symbol, course, report.parameters.get(symbol)?)))
        .map(|(symbol, course, parameter)| {
            let rows = || over.iter().zip(course);
            let unit = HysteresisParameter::ALL.into_iter().find(|own| own.symbol() == symbol);
            let ordinate = Axis::new(symbol, unit.map_or("", HysteresisParameter::unit));
            let mut chart = Chart::new(&format!("estimate of {symbol}"), abscissa, ordinate)
                .curve(Curve::new(rows().map(|(x, row)| [*x, row[0]]), Role::Amended).named("estimate"))
                .horizontal(parameter.value, Role::Amended, "final");
            // A course without deviations has them all at zero.
            if course.iter().any(|row| row[1] > 0.0) {
                let band = rows().map(|(x, [value, deviation])| (*x, value - 2.0 * deviation, value + 2.0 * deviation));
                chart = chart.band(band.collect(), Role::Amended, Some("± 2 sd"));
            }
            chart
        })
        .collect();
    let (quantity, ordinate) = match report.output.as_str() {
        "strain" => (Quantity::Strain, "strain, m/m"),
        "magnetization" => (Quantity::Magnetization, "magnetization, A/m"),
        _ => (Quantity::Displacement, "displacement, m"),
    };
    let seen = measured.series(quantity).unwrap_or_default();
    let left: Vec<f64> = seen
        .iter()
        .zip(&found.predicted)
        .map(|(seen, predicted)| seen - predicted)
        .collect();
    charts.push(
        Chart::new("measured, and predicted with the estimate", abscissa, ordinate)
            .curve(Curve::over(over, seen, Role::Measured).named("measured"))
            .curve(Curve::over(over, &found.predicted, Role::Amended).named("predicted")),
    );
    charts.push(
        Chart::new("what is left", abscissa, ordinate)
            .curve(Curve::over(over, &left, Role::Remainder).named("measured − predicted")),
    );
    charts
}
