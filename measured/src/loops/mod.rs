//! Measured loops: field, magnetization and strain over one or several sweeps, read from a table.
//!
//! M = B/μ0 − H where the file holds flux density: M magnetization, H field (A/m), B flux density (T),
//! μ0 = 1.25663706127e-6 T·m/A (CODATA 2022). Strain has no unit (1e-6 is 1 ppm); its zero is arbitrary.
//! Assumption: H is the field inside the material (demagnetising field already taken off by the instrument).

mod checks;
mod table;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::columns::{ColumnMapping, Columns};
use crate::error::MeasuredError;
use crate::quantity::Quantity;
use crate::rows::RowRange;
use crate::sheet::Sheet;
use table::{Sample, Table};

/// How a file is read: columns named by the user and rows left out.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    pub mappings: Vec<ColumnMapping>,
    pub drop_rows: Vec<RowRange>,
}

/// One sweep of the field, in the order in which it was measured. All present series have the same length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredLoop {
    pub id: String,
    /// Row of each sample in the file, from 0 after the header.
    pub rows: Vec<u64>,
    pub time_s: Option<Vec<f64>>,
    pub field_a_per_m: Vec<f64>,
    pub magnetization_a_per_m: Option<Vec<f64>>,
    pub strain: Option<Vec<f64>>,
}

/// Everything that one file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredLoops {
    /// Where the data come from: the path as given.
    pub source: String,
    /// XXH3 of the file's bytes, 16 hexadecimal digits.
    pub data_hash: String,
    pub dropped_rows: usize,
    pub loops: Vec<MeasuredLoop>,
}

/// What is looked for among the headers.
const WANTED: [Quantity; 6] = [
    Quantity::LoopId,
    Quantity::Time,
    Quantity::Field,
    Quantity::FluxDensity,
    Quantity::Magnetization,
    Quantity::Strain,
];

impl MeasuredLoops {
    /// Reads and checks a file, text or Parquet; every refusal says the value, its limit and its place.
    pub fn read(file: &Path, options: &ReadOptions) -> Result<Self, MeasuredError> {
        let sheet = Sheet::open(file)?;
        let columns = Columns::resolve(file, &sheet.headers, &options.mappings, &WANTED)?;
        let table = Table {
            sheet: &sheet,
            columns: &columns,
        };
        table.check_columns()?;
        let dropped = |row: usize| options.drop_rows.iter().any(|range| range.contains(row as u64));
        let kept: Vec<usize> = (0..sheet.rows()).filter(|row| !dropped(*row)).collect();
        let samples = kept.iter().map(|row| table.sample(*row)).collect::<Result<_, _>>()?;
        let loops = split(samples)
            .into_iter()
            .map(|samples| {
                checks::samples(&table, &samples)?;
                let measured = MeasuredLoop::from(samples);
                checks::sweep(
                    &table,
                    measured.id.clone(),
                    &measured.field_a_per_m,
                    measured.magnetization_a_per_m.as_deref(),
                )?;
                Ok(measured)
            })
            .collect::<Result<Vec<_>, MeasuredError>>()?;
        if loops.is_empty() {
            let (file, loop_id) = (file.to_owned(), "0".to_owned());
            return Err(MeasuredError::TooFewRows {
                file,
                loop_id,
                rows: 0,
                least: checks::LEAST_ROWS,
            });
        }
        Ok(MeasuredLoops {
            source: file.display().to_string(),
            dropped_rows: sheet.rows() - kept.len(),
            loops,
            data_hash: sheet.data_hash,
        })
    }
}

/// Samples by loop, loops in the order of their first row.
fn split(samples: Vec<Sample>) -> Vec<Vec<Sample>> {
    let mut loops: Vec<Vec<Sample>> = Vec::new();
    for sample in samples {
        match loops.iter_mut().find(|samples| samples[0].loop_id == sample.loop_id) {
            Some(samples) => samples.push(sample),
            None => loops.push(vec![sample]),
        }
    }
    loops
}

impl From<Vec<Sample>> for MeasuredLoop {
    fn from(samples: Vec<Sample>) -> Self {
        let series = |index: usize| {
            samples
                .iter()
                .map(|sample| sample.values[index])
                .collect::<Option<Vec<f64>>>()
        };
        MeasuredLoop {
            id: samples.first().map(|sample| sample.loop_id.clone()).unwrap_or_default(),
            rows: samples.iter().map(|sample| sample.row as u64).collect(),
            time_s: series(0),
            field_a_per_m: series(1).unwrap_or_default(),
            magnetization_a_per_m: series(3),
            strain: series(4),
        }
    }
}
