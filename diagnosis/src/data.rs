//! Measured loops: field, magnetization and strain over one or several sweeps, read from a table.
//!
//! M = B/μ0 − H where the file holds flux density: M magnetization, H field (A/m), B flux density (T),
//! μ0 = 1.25663706127e-6 T·m/A (CODATA 2022). Strain has no unit (1e-6 is 1 ppm); its zero is arbitrary.
//! Assumption: H is the field inside the material (demagnetising field already taken off by the instrument).

use std::path::{Path, PathBuf};

use csv::StringRecord;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use crate::checks;
use crate::columns::{ColumnMapping, Columns, Quantity};
use crate::error::{DiagnosisError, Place};
use crate::rows::RowRange;

/// μ0, T·m/A.
pub const VACUUM_PERMEABILITY_T_M_PER_A: f64 = 1.256_637_061_27e-6;

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

/// One row of the table, already in SI units.
pub(crate) struct Sample {
    pub row: u64,
    pub line: u64,
    pub loop_id: String,
    pub values: [Option<f64>; 5],
}

/// The series of a sample, in the order of [`Sample::values`].
pub(crate) const SERIES: [Quantity; 5] = [
    Quantity::Time,
    Quantity::Field,
    Quantity::FluxDensity,
    Quantity::Magnetization,
    Quantity::Strain,
];

impl MeasuredLoops {
    /// Reads and checks a file; every refusal says the value, its limit and its place.
    pub fn read(file: &Path, options: &ReadOptions) -> Result<Self, DiagnosisError> {
        let bytes = std::fs::read(file).map_err(|source| DiagnosisError::Unreadable {
            file: file.to_owned(),
            source,
        })?;
        let not_csv = |source| DiagnosisError::NotCsv {
            file: file.to_owned(),
            source,
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(bytes.as_slice());
        let headers: Vec<String> = reader.headers().map_err(not_csv)?.iter().map(str::to_owned).collect();
        let columns = Columns::resolve(file, &headers, &options.mappings)?;
        let table = Table {
            file,
            columns: &columns,
        };
        if columns.of(Quantity::FluxDensity).is_none() && columns.of(Quantity::Magnetization).is_none() {
            return Err(DiagnosisError::NothingToFit { file: file.to_owned() });
        }
        let (mut samples, mut dropped_rows) = (Vec::new(), 0);
        for (row, record) in reader.records().enumerate() {
            let (row, record) = (row as u64, record.map_err(not_csv)?);
            if options.drop_rows.iter().any(|range| range.contains(row)) {
                dropped_rows += 1;
            } else {
                samples.push(table.sample(row, &record)?);
            }
        }
        let loops = split(samples)
            .into_iter()
            .map(|samples| {
                checks::samples(&table, &samples)?;
                let measured = MeasuredLoop::from(samples);
                checks::sweep(&table, &measured)?;
                Ok(measured)
            })
            .collect::<Result<Vec<_>, DiagnosisError>>()?;
        if loops.is_empty() {
            let (file, loop_id) = (file.to_owned(), "0".to_owned());
            return Err(DiagnosisError::TooFewRows {
                file,
                loop_id,
                rows: 0,
                least: checks::LEAST_ROWS,
            });
        }
        let data_hash = format!("{:016x}", xxh3_64(&bytes));
        Ok(MeasuredLoops {
            source: file.display().to_string(),
            data_hash,
            dropped_rows,
            loops,
        })
    }
}

/// A file with its columns: knows how to read a row and how to say where a value stands.
pub(crate) struct Table<'a> {
    pub file: &'a Path,
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

    pub fn place(&self, row: u64, line: u64, quantity: Quantity) -> Box<Place> {
        let (file, column) = (self.file_name(), self.header(quantity));
        Box::new(Place {
            file,
            row,
            line,
            column,
        })
    }

    pub fn file_name(&self) -> PathBuf {
        self.file.to_owned()
    }

    fn sample(&self, row: u64, record: &StringRecord) -> Result<Sample, DiagnosisError> {
        let line = record.position().map_or(row + 2, csv::Position::line);
        let value = |quantity| self.value(row, line, record, quantity);
        let (time, field, flux_density) = (
            value(Quantity::Time)?,
            value(Quantity::Field)?,
            value(Quantity::FluxDensity)?,
        );
        let magnetization = match value(Quantity::Magnetization)? {
            Some(magnetization) => Some(magnetization),
            None => flux_density
                .zip(field)
                .map(|(flux_density_t, field)| flux_density_t / VACUUM_PERMEABILITY_T_M_PER_A - field),
        };
        let loop_id = match self.columns.of(Quantity::LoopId) {
            Some(column) => record.get(column.index).unwrap_or_default().to_owned(),
            None => "0".to_owned(),
        };
        Ok(Sample {
            row,
            line,
            loop_id,
            values: [time, field, flux_density, magnetization, value(Quantity::Strain)?],
        })
    }

    fn value(
        &self,
        row: u64,
        line: u64,
        record: &StringRecord,
        quantity: Quantity,
    ) -> Result<Option<f64>, DiagnosisError> {
        let Some(column) = self.columns.of(quantity) else {
            return Ok(None);
        };
        let text = record.get(column.index).unwrap_or_default();
        let place = || {
            let (file, column) = (self.file_name(), column.header.clone());
            Box::new(Place {
                file,
                row,
                line,
                column,
            })
        };
        let raw: f64 = text.parse().map_err(|_| DiagnosisError::NotANumber {
            place: place(),
            text: text.to_owned(),
        })?;
        let value = raw * column.scale;
        if !value.is_finite() {
            return Err(DiagnosisError::NotFinite { place: place(), value });
        }
        checks::magnitude(quantity, value, place)?;
        Ok(Some(value))
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
            rows: samples.iter().map(|sample| sample.row).collect(),
            time_s: series(0),
            field_a_per_m: series(1).unwrap_or_default(),
            magnetization_a_per_m: series(3),
            strain: series(4),
        }
    }
}
