//! Is a loop what it says it is? A field that is no sweep and a magnetization that falls while the field rises are refused.

use super::record::MeasuredRun;
use super::selection::Selection;
use crate::error::MeasuredError;
use crate::quantity::Quantity;
use crate::sweep;

pub(super) fn check(selection: &Selection, of: &MeasuredRun) -> Result<(), MeasuredError> {
    let header = |quantity| {
        let column = selection.column(quantity);
        column.map(|column| column.header.clone()).unwrap_or_default()
    };
    let (file, loop_id, rows) = (selection.sheet.file.clone(), of.loop_id.clone(), of.len());
    let field = of.series(Quantity::Field).unwrap_or_default();
    let reversals = sweep::turning_points(field, sweep::DEFAULT_THRESHOLD).len();
    // Even a coarse loop has ten samples between reversals; unsorted rows turn round at every second one.
    let limit = rows / 4;
    if reversals > limit {
        return Err(MeasuredError::NotASweep {
            file,
            loop_id,
            column: header(Quantity::Field),
            reversals,
            rows,
            limit,
        });
    }
    let correlation = correlation(field, of.series(Quantity::Magnetization).unwrap_or_default());
    if correlation < 0.0 {
        return Err(MeasuredError::MagnetizationFalls {
            file,
            loop_id,
            field_column: header(Quantity::Field),
            response_column: header(Quantity::Magnetization),
            correlation,
        });
    }
    Ok(())
}

/// Of two series of one length; not a number where one of them stands still.
pub(crate) fn correlation(first: &[f64], second: &[f64]) -> f64 {
    let count = first.len() as f64;
    let mean = |series: &[f64]| series.iter().sum::<f64>() / count;
    let (first_mean, second_mean) = (mean(first), mean(second));
    let product = |a: &[f64], a_mean: f64, b: &[f64], b_mean: f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum()
    };
    product(first, first_mean, second, second_mean)
        / (product(first, first_mean, first, first_mean) * product(second, second_mean, second, second_mean)).sqrt()
}
