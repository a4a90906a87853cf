//! From a table to a run: columns, rows, values, and the checks in the order in which they explain one another.

use std::path::Path;

use super::record::{INPUTS, MeasuredRun, OUTPUTS};
use super::selection::{Selection, chosen};
use super::{time, units};
use crate::columns::{ColumnMapping, Columns, quoted};
use crate::error::MeasuredError;
use crate::magnetization::magnetization_a_per_m;
use crate::quantity::Quantity;
use crate::rows::RowRange;
use crate::sheet::Sheet;

/// How a run is read: columns named by the user, the rows that are kept, and rows left out of those.
#[derive(Clone, Debug, Default)]
pub struct RunReadOptions {
    pub mappings: Vec<ColumnMapping>,
    /// All rows if none.
    pub rows: Option<RowRange>,
    pub drop_rows: Vec<RowRange>,
}

impl MeasuredRun {
    /// Reads and checks a file, text or Parquet; every refusal says the value, its limit, its place and what to do.
    pub fn read(file: &Path, options: &RunReadOptions) -> Result<Self, MeasuredError> {
        let sheet = Sheet::open(file)?;
        let columns = Columns::resolve(file, &sheet.headers, &options.mappings, &Quantity::ALL)?;
        require_both_ends(&sheet, &columns)?;
        let selection = Selection {
            rows: chosen(&sheet, options.rows, &options.drop_rows)?,
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
}

/// A run without an input or without an output says nothing about an actuator.
fn require_both_ends(sheet: &Sheet, columns: &Columns) -> Result<(), MeasuredError> {
    let sides = [
        ("input", INPUTS, "command=HEADER*SCALE"),
        ("output", OUTPUTS, "displacement=HEADER*SCALE"),
    ];
    for (side, wanted, example) in sides {
        if wanted.iter().all(|quantity| columns.of(*quantity).is_none()) {
            let names: Vec<_> = wanted.iter().map(|quantity| quantity.header()).collect();
            return Err(MeasuredError::OneSided {
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
