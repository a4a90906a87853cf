//! The rows of a table that make a run, and what is wrong with them whatever their unit.

use super::record::{INPUTS, OUTPUTS};
use crate::columns::{Column, Columns};
use crate::error::{MeasuredError, Remedy};
use crate::quantity::Quantity;
use crate::rows::RowRange;
use crate::sheet::Sheet;

/// Fewer samples than this hold no model.
pub const LEAST_RUN_ROWS: usize = 20;

/// A table whose columns are known and whose rows are chosen.
pub(super) struct Selection<'a> {
    pub sheet: &'a Sheet,
    pub columns: &'a Columns,
    /// Rows of the table, in order.
    pub rows: Vec<usize>,
}

/// The rows that are kept: all if no range is given, without the dropped ones.
pub(super) fn chosen(sheet: &Sheet, rows: Option<RowRange>, dropped: &[RowRange]) -> Result<Vec<usize>, MeasuredError> {
    let kept = |row: &usize| {
        let row = *row as u64;
        let inside = rows.is_none_or(|range| range.contains(row));
        inside && !dropped.iter().any(|range| range.contains(row))
    };
    let rows: Vec<usize> = (0..sheet.rows()).filter(kept).collect();
    if rows.len() < LEAST_RUN_ROWS {
        return Err(MeasuredError::RunTooShort {
            file: sheet.file.clone(),
            rows: rows.len(),
            in_file: sheet.rows(),
            least: LEAST_RUN_ROWS,
        });
    }
    Ok(rows)
}

impl Selection<'_> {
    pub fn series(&self) -> Result<[Option<Vec<f64>>; Quantity::ALL.len()], MeasuredError> {
        let numbers = |(quantity, _): &(Quantity, &Column)| *quantity != Quantity::LoopId;
        let columns: Vec<(Quantity, &Column)> = self.columns.iter().filter(numbers).collect();
        let mut values = vec![Vec::with_capacity(self.rows.len()); columns.len()];
        for &row in &self.rows {
            self.sheet.check_row(row, Remedy::CutRun)?;
            for ((_, column), values) in columns.iter().zip(&mut values) {
                values.push(self.sheet.value(row, column, Remedy::CutRun)?);
            }
        }
        let mut series: [Option<Vec<f64>>; Quantity::ALL.len()] = Default::default();
        for ((quantity, _), values) in columns.into_iter().zip(values) {
            series[quantity.index()] = Some(values);
        }
        Ok(series)
    }

    /// Loops measured one after another are no run: between two of them nobody was looking.
    pub fn refuse_several_loops(&self) -> Result<(), MeasuredError> {
        let Some(column) = self.columns.of(Quantity::LoopId) else {
            return Ok(());
        };
        let id = |row: usize| self.sheet.text(row, column.index);
        let first = id(self.rows[0]);
        let Some(&next) = self.rows.iter().find(|row| id(**row) != first) else {
            return Ok(());
        };
        Err(MeasuredError::SeveralLoops {
            place: self.sheet.place(next, column),
            second: id(next),
            first_row: self.rows[0] as u64,
            end_row: next as u64,
            first,
        })
    }

    /// Temperature and force may well be steady; what goes in and what comes out must move.
    pub fn refuse_constants(&self, series: &[Option<Vec<f64>>]) -> Result<(), MeasuredError> {
        for quantity in INPUTS.into_iter().chain(OUTPUTS) {
            let (Some(values), Some(column)) = (&series[quantity.index()], self.columns.of(quantity)) else {
                continue;
            };
            if values.iter().all(|value| *value == values[0]) {
                return Err(MeasuredError::ConstantInRun {
                    place: self.sheet.place(self.rows[0], column),
                    quantity_key: quantity.key(),
                    value: values[0],
                    unit: quantity.unit(),
                    rows: values.len(),
                });
            }
        }
        Ok(())
    }
}
