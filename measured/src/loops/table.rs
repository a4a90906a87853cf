//! A table whose columns are known, read row by row into SI units.

use std::path::PathBuf;

use crate::columns::{Columns, missing};
use crate::error::{MeasuredError, Place, Remedy};
use crate::limits;
use crate::magnetization::magnetization_a_per_m;
use crate::quantity::Quantity;
use crate::sheet::Sheet;

/// One row of the table, already in SI units.
pub(super) struct Sample {
    pub row: usize,
    pub loop_id: String,
    pub values: [Option<f64>; 5],
}

/// The series of a sample, in the order of [`Sample::values`].
pub(super) const SERIES: [Quantity; 5] = [
    Quantity::Time,
    Quantity::Field,
    Quantity::FluxDensity,
    Quantity::Magnetization,
    Quantity::Strain,
];

/// A file with its columns: knows how to read a row and how to say where a value stands.
pub(super) struct Table<'a> {
    pub sheet: &'a Sheet,
    pub columns: &'a Columns,
}

impl Table<'_> {
    /// The column that a series of [`SERIES`] is made from.
    pub fn header(&self, series: Quantity) -> String {
        match series {
            Quantity::Magnetization if self.columns.of(Quantity::Magnetization).is_none() => {
                self.columns.header(Quantity::FluxDensity)
            }
            other => self.columns.header(other),
        }
    }

    pub fn place(&self, row: usize, quantity: Quantity) -> Box<Place> {
        let (file, column) = (self.file_name(), self.header(quantity));
        Box::new(Place {
            file,
            row: row as u64,
            line: self.sheet.line(row),
            column,
        })
    }

    pub fn file_name(&self) -> PathBuf {
        self.sheet.file.clone()
    }

    pub fn check_columns(&self) -> Result<(), MeasuredError> {
        let (file, columns) = (&self.sheet.file, self.columns);
        if columns.of(Quantity::Field).is_none() {
            return Err(missing(file, &self.sheet.headers, Quantity::Field));
        }
        if columns.of(Quantity::FluxDensity).is_none() && columns.of(Quantity::Magnetization).is_none() {
            return Err(MeasuredError::NothingToFit { file: file.clone() });
        }
        let contradiction = columns.iter().find_map(|(_, column)| column.contradiction(file));
        contradiction.map_or(Ok(()), Err)
    }

    pub fn sample(&self, row: usize) -> Result<Sample, MeasuredError> {
        self.sheet.check_row(row, Remedy::DropRow)?;
        let value = |quantity| self.value(row, quantity);
        let (time, field, flux_density) = (
            value(Quantity::Time)?,
            value(Quantity::Field)?,
            value(Quantity::FluxDensity)?,
        );
        let magnetization = match value(Quantity::Magnetization)? {
            Some(magnetization) => Some(magnetization),
            None => flux_density
                .zip(field)
                .map(|(flux_density_t, field)| magnetization_a_per_m(flux_density_t, field)),
        };
        let loop_id = match self.columns.of(Quantity::LoopId) {
            Some(column) => self.sheet.text(row, column.index),
            None => "0".to_owned(),
        };
        Ok(Sample {
            row,
            loop_id,
            values: [time, field, flux_density, magnetization, value(Quantity::Strain)?],
        })
    }

    fn value(&self, row: usize, quantity: Quantity) -> Result<Option<f64>, MeasuredError> {
        let Some(column) = self.columns.of(quantity) else {
            return Ok(None);
        };
        let value = self.sheet.value(row, column, Remedy::DropRow)?;
        limits::refuse_beyond(quantity, value, || self.sheet.place(row, column))?;
        Ok(Some(value))
    }
}
