//! Is a table what it says it is? Refusals before any fit: magnitudes no material has, constant or too short
//! columns, time that runs back, a field that is no sweep, a magnetization that falls while the field rises.

use super::table::{SERIES, Sample, Table};
use crate::error::MeasuredError;
use crate::limits;
use crate::quantity::Quantity;
use crate::sweep;

/// Fewer samples than this cannot carry five parameters and an offset.
pub(super) const LEAST_ROWS: usize = 20;

/// Checks of one loop while rows and lines are still at hand.
pub(super) fn samples(table: &Table, samples: &[Sample]) -> Result<(), MeasuredError> {
    let loop_id = samples.first().map(|sample| sample.loop_id.clone()).unwrap_or_default();
    if samples.len() < LEAST_ROWS {
        let (file, rows) = (table.file_name(), samples.len());
        return Err(MeasuredError::TooFewRows {
            file,
            loop_id,
            rows,
            least: LEAST_ROWS,
        });
    }
    for (index, series) in SERIES.into_iter().enumerate() {
        let Some(value) = samples[0].values[index] else {
            continue;
        };
        if samples.iter().all(|sample| sample.values[index] == Some(value)) {
            let (file, column) = (table.file_name(), table.header(series));
            return Err(MeasuredError::Constant {
                file,
                loop_id,
                column,
                value,
                rows: samples.len(),
            });
        }
        // Columns were checked as they were read; the magnetization made from flux density was not.
        for sample in samples {
            let place = || table.place(sample.row, series);
            limits::refuse_beyond(series, sample.values[index].unwrap_or_default(), place)?;
        }
    }
    for pair in samples.windows(2) {
        if let (Some(previous), Some(value)) = (pair[0].values[0], pair[1].values[0])
            && value <= previous
        {
            let place = table.place(pair[1].row, Quantity::Time);
            return Err(MeasuredError::TimeRunsBack { place, value, previous });
        }
    }
    Ok(())
}

/// Checks of one loop as a whole.
pub(super) fn sweep(
    table: &Table,
    loop_id: String,
    field_a_per_m: &[f64],
    magnetization_a_per_m: Option<&[f64]>,
) -> Result<(), MeasuredError> {
    let file = table.file_name();
    let rows = field_a_per_m.len();
    let field_column = table.header(Quantity::Field);
    let reversals = sweep::turning_points(field_a_per_m, sweep::DEFAULT_THRESHOLD).len();
    // Even a coarse loop has ten samples between reversals; unsorted rows turn round at every second one.
    let limit = rows / 4;
    if reversals > limit {
        return Err(MeasuredError::NotASweep {
            file,
            loop_id,
            column: field_column,
            reversals,
            rows,
            limit,
        });
    }
    let Some(magnetization) = magnetization_a_per_m else {
        return Ok(());
    };
    let correlation = correlation(field_a_per_m, magnetization);
    if correlation < 0.0 {
        let response_column = table.header(Quantity::Magnetization);
        return Err(MeasuredError::MagnetizationFalls {
            file,
            loop_id,
            field_column,
            response_column,
            correlation,
        });
    }
    Ok(())
}

fn correlation(first: &[f64], second: &[f64]) -> f64 {
    let count = first.len() as f64;
    let mean = |series: &[f64]| series.iter().sum::<f64>() / count;
    let (first_mean, second_mean) = (mean(first), mean(second));
    let product = |a: &[f64], a_mean: f64, b: &[f64], b_mean: f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum()
    };
    product(first, first_mean, second, second_mean)
        / (product(first, first_mean, first, first_mean) * product(second, second_mean, second, second_mean)).sqrt()
}
