//! From a table to a run: columns, rows, values, and the checks in the order in which they explain one another.

use std::path::Path;

use super::{INPUTS, LEAST_RUN_ROWS, MeasuredRun, OUTPUTS, RunReadOptions, time, units};
use crate::columns::{Column, Columns, quoted};
use crate::data::magnetization_a_per_m;
use crate::error::{DiagnosisError, Remedy};
use crate::quantity::Quantity;
use crate::sheet::Sheet;

/// A table whose columns are known and whose rows are chosen.
pub(super) struct Selection<'a> {
    pub sheet: &'a Sheet,
    pub columns: &'a Columns,
    /// Rows of the table, in order.
    pub rows: Vec<usize>,
}

pub(super) fn read(file: &Path, options: &RunReadOptions) -> Result<MeasuredRun, DiagnosisError> {
    let sheet = Sheet::open(file)?;
    let columns = Columns::resolve(file, &sheet.headers, &options.mappings, &Quantity::ALL)?;
    require_both_ends(&sheet, &columns)?;
    let selection = Selection {
        rows: chosen(&sheet, options)?,
        sheet: &sheet,
        columns: &columns,
    };
    selection.refuse_several_loops()?;
    let mut series = selection.series()?;
    let time_s = series[Quantity::Time.index()].take();
    if let Some(time_s) = &time_s {
        time::refuse_disorder(&selection, time_s)?;
    }
    selection.refuse_constants(&series)?;
    units::check(&selection, &series, time_s.as_deref())?;
    let tick_s = match &time_s {
        Some(time_s) => Some(time::uniform_tick_s(&selection, time_s)?),
        None => None,
    };
    derive_magnetization(&mut series);
    let rows = &selection.rows;
    Ok(MeasuredRun {
        source: file.display().to_string(),
        data_hash: sheet.data_hash.clone(),
        lines: rows.iter().map(|row| sheet.line(*row)).collect(),
        dropped_rows: sheet.rows() - rows.len(),
        rows: rows.iter().map(|row| *row as u64).collect(),
        time_s,
        tick_s,
        series,
        columns: Some(columns),
    })
}

/// A run without an input or without an output says nothing about an actuator.
fn require_both_ends(sheet: &Sheet, columns: &Columns) -> Result<(), DiagnosisError> {
    let sides = [
        ("input", INPUTS, "command=HEADER*SCALE"),
        ("output", OUTPUTS, "displacement=HEADER*SCALE"),
    ];
    for (side, wanted, example) in sides {
        if wanted.iter().all(|quantity| columns.of(*quantity).is_none()) {
            let names: Vec<_> = wanted.iter().map(|quantity| quantity.header()).collect();
            return Err(DiagnosisError::OneSided {
                file: sheet.file.clone(),
                side,
                wanted: names.join(", "),
                present: quoted(&sheet.headers),
                example,
            });
        }
    }
    Ok(())
}

fn chosen(sheet: &Sheet, options: &RunReadOptions) -> Result<Vec<usize>, DiagnosisError> {
    let kept = |row: &usize| {
        let row = *row as u64;
        let inside = options.rows.is_none_or(|range| range.contains(row));
        inside && !options.drop_rows.iter().any(|range| range.contains(row))
    };
    let rows: Vec<usize> = (0..sheet.rows()).filter(kept).collect();
    if rows.len() < LEAST_RUN_ROWS {
        return Err(DiagnosisError::RunTooShort {
            file: sheet.file.clone(),
            rows: rows.len(),
            in_file: sheet.rows(),
            least: LEAST_RUN_ROWS,
        });
    }
    Ok(rows)
}

/// Where a file has no magnetization, flux density and measured field give it.
fn derive_magnetization(series: &mut [Option<Vec<f64>>]) {
    let of = |quantity: Quantity| series[quantity.index()].as_deref();
    let made = match (
        of(Quantity::Magnetization),
        of(Quantity::FluxDensity),
        of(Quantity::Field),
    ) {
        (None, Some(flux_density_t), Some(field)) => flux_density_t.iter().zip(field),
        _ => return,
    };
    let made = made.map(|(flux_density_t, field)| magnetization_a_per_m(*flux_density_t, *field));
    series[Quantity::Magnetization.index()] = Some(made.collect());
}

impl Selection<'_> {
    fn series(&self) -> Result<[Option<Vec<f64>>; Quantity::ALL.len()], DiagnosisError> {
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
    fn refuse_several_loops(&self) -> Result<(), DiagnosisError> {
        let Some(column) = self.columns.of(Quantity::LoopId) else {
            return Ok(());
        };
        let id = |row: usize| self.sheet.text(row, column.index);
        let first = id(self.rows[0]);
        let Some(&next) = self.rows.iter().find(|row| id(**row) != first) else {
            return Ok(());
        };
        Err(DiagnosisError::SeveralLoops {
            place: self.sheet.place(next, column),
            second: id(next),
            first_row: self.rows[0] as u64,
            end_row: next as u64,
            first,
        })
    }

    /// Temperature and force may well be steady; what goes in and what comes out must move.
    fn refuse_constants(&self, series: &[Option<Vec<f64>>]) -> Result<(), DiagnosisError> {
        for quantity in INPUTS.into_iter().chain(OUTPUTS) {
            let (Some(values), Some(column)) = (&series[quantity.index()], self.columns.of(quantity)) else {
                continue;
            };
            if values.iter().all(|value| *value == values[0]) {
                return Err(DiagnosisError::ConstantInRun {
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
