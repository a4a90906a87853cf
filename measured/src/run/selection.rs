//! The rows of a table that make a run or a loop, and what is wrong with them whatever their unit.

use super::options::RunReadOptions;
use super::record::{INPUTS, OUTPUTS, Series};
use crate::columns::{Column, Columns};
use crate::error::{MeasuredError, Remedy};
use crate::quantity::Quantity;
use crate::sheet::Sheet;

/// Fewer samples than this hold no model.
pub const MIN_RUN_ROWS: usize = 20;

/// A table whose columns are known and whose rows are chosen.
#[derive(Clone)]
pub(crate) struct Selection<'a> {
    pub sheet: &'a Sheet,
    pub columns: &'a Columns,
    /// Rows of the table, in order.
    pub rows: Vec<usize>,
    /// What is done about a bad row.
    pub remedy: Remedy,
}

/// The rows that are kept: all if no range is given, without the dropped ones.
pub(crate) fn chosen(sheet: &Sheet, options: &RunReadOptions) -> Vec<usize> {
    let kept = |row: &usize| {
        let row = *row as u64;
        let inside = options.rows.is_none_or(|range| range.contains(row));
        inside && !options.drop_rows.iter().any(|range| range.contains(row))
    };
    (0..sheet.rows()).filter(kept).collect()
}

impl<'a> Selection<'a> {
    /// The column that a quantity is made from.
    pub fn column(&self, quantity: Quantity) -> Option<&'a Column> {
        match quantity {
            Quantity::Magnetization => self.columns.of(quantity).or(self.columns.of(Quantity::FluxDensity)),
            _ => self.columns.of(quantity),
        }
    }

    pub fn series(&self) -> Result<Series, MeasuredError> {
        let numbers = |(quantity, _): &(Quantity, &Column)| *quantity != Quantity::LoopId;
        let columns: Vec<(Quantity, &Column)> = self.columns.iter().filter(numbers).collect();
        let mut values = vec![Vec::with_capacity(self.rows.len()); columns.len()];
        for &row in &self.rows {
            self.sheet.check_row(row, self.remedy)?;
            for ((_, column), values) in columns.iter().zip(&mut values) {
                values.push(self.sheet.value(row, column, self.remedy)?);
            }
        }
        let mut series = Series::default();
        for ((quantity, _), values) in columns.into_iter().zip(values) {
            series[quantity.index()] = Some(values);
        }
        Ok(series)
    }

    pub fn refuse_short_run(&self) -> Result<(), MeasuredError> {
        if self.rows.len() >= MIN_RUN_ROWS {
            return Ok(());
        }
        Err(MeasuredError::RunTooShort {
            file: self.sheet.file.clone(),
            rows: self.rows.len(),
            in_file: self.sheet.rows(),
            least: MIN_RUN_ROWS,
        })
    }

    pub fn refuse_short_loop(&self) -> Result<(), MeasuredError> {
        if self.rows.len() >= MIN_RUN_ROWS {
            return Ok(());
        }
        Err(MeasuredError::TooFewRows {
            file: self.sheet.file.clone(),
            loop_id: self.loop_id(),
            rows: self.rows.len(),
            least: MIN_RUN_ROWS,
        })
    }

    /// What the first row says; 0 where nothing tells loops apart.
    pub fn loop_id(&self) -> String {
        self.rows.first().map_or_else(|| "0".to_owned(), |row| self.id_of(*row))
    }

    fn id_of(&self, row: usize) -> String {
        let column = self.columns.of(Quantity::LoopId);
        column.map_or_else(|| "0".to_owned(), |column| self.sheet.text(row, column.index))
    }

    /// One selection a loop, in the order of their first rows; at least one.
    pub fn by_loop(&self) -> Result<Vec<Self>, MeasuredError> {
        let part = |rows| Selection { rows, ..self.clone() };
        let mut loops: Vec<(String, Vec<usize>)> = Vec::new();
        for &row in &self.rows {
            // A row of too few cells has no number of its loop either.
            self.sheet.check_row(row, self.remedy)?;
            let id = self.id_of(row);
            match loops.iter_mut().find(|(own, _)| *own == id) {
                Some((_, rows)) => rows.push(row),
                None => loops.push((id, vec![row])),
            }
        }
        if loops.is_empty() {
            return Ok(vec![part(Vec::new())]);
        }
        Ok(loops.into_iter().map(|(_, rows)| part(rows)).collect())
    }

    /// Loops measured one after another are no run: between two of them nobody was looking.
    pub fn refuse_several_loops(&self) -> Result<(), MeasuredError> {
        let Some(column) = self.columns.of(Quantity::LoopId) else {
            return Ok(());
        };
        let first = self.loop_id();
        let Some(&next) = self.rows.iter().find(|row| self.id_of(**row) != first) else {
            return Ok(());
        };
        Err(MeasuredError::SeveralLoops {
            place: self.sheet.place(next, column),
            second: self.id_of(next),
            first_row: self.rows[0] as u64,
            end_row: next as u64,
            first,
        })
    }

    /// Temperature and force may well be steady; what goes in and what comes out must move.
    pub fn refuse_constants(&self, series: &Series) -> Result<(), MeasuredError> {
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
