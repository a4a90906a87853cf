//! An estimation as panels: where the estimate went, what was measured and predicted, what is left.

use super::Estimated;
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::HysteresisParameter;
use anhyst_report::figure::{Panel, TIME, curve, dashed, panel};

/// The panels of an estimation.
pub fn picture(found: &Estimated, measured: &MeasuredRun) -> Vec<Panel> {
    let (over, report) = (&found.abscissa, &found.report);
    let abscissa = if measured.time_s.is_some() { TIME } else { "sample" };
    let mut panels: Vec<Panel> = found
        .courses
        .iter()
        .filter_map(|(symbol, course)| Some((symbol, course, report.parameters.get(symbol)?)))
        .map(|(symbol, course, parameter)| {
            let at =
                |pick: &dyn Fn(&[f64; 2]) -> f64| over.iter().zip(course).map(|(x, row)| [*x, pick(row)]).collect();
            let ends = [over.first(), over.last()]
                .into_iter()
                .flatten()
                .map(|x| [*x, parameter.value])
                .collect();
            let mut curves = vec![curve("estimate", at(&|row| row[0])), dashed("final", ends)];
            // A course without deviations has them all at zero.
            if course.iter().any(|row| row[1] > 0.0) {
                curves.push(dashed("+ 2 sd", at(&|row| row[0] + 2.0 * row[1])));
                curves.push(dashed("- 2 sd", at(&|row| row[0] - 2.0 * row[1])));
            }
            let unit = HysteresisParameter::ALL.into_iter().find(|own| own.symbol() == symbol);
            let unit = unit.map_or("", HysteresisParameter::unit);
            let comma = if unit.is_empty() { "" } else { ", " };
            panel(
                &format!("estimate of {symbol}"),
                abscissa,
                &format!("{symbol}{comma}{unit}"),
                curves,
            )
        })
        .collect();
    let (quantity, ordinate) = match report.output.as_str() {
        "strain" => (Quantity::Strain, "strain"),
        "magnetization" => (Quantity::Magnetization, "magnetization, A/m"),
        _ => (Quantity::Displacement, "displacement, m"),
    };
    let seen = measured.series(quantity).unwrap_or_default();
    let points = |series: &[f64]| over.iter().zip(series).map(|(x, y)| [*x, *y]).collect();
    let left: Vec<f64> = seen
        .iter()
        .zip(&found.predicted)
        .map(|(seen, predicted)| seen - predicted)
        .collect();
    panels.push(panel(
        "measured, and predicted with the estimate",
        abscissa,
        ordinate,
        vec![
            curve("measured", points(seen)),
            curve("predicted", points(&found.predicted)),
        ],
    ));
    panels.push(panel(
        "what is left",
        abscissa,
        ordinate,
        vec![curve("measured - predicted", points(&left))],
    ));
    panels
}
