//! A table as it stands in a file, text or Parquet, before anybody knows what its columns mean.
//!
//! Rows count from 0 after the header; lines, which only text has, from 1. What is no table is refused by what it
//! looks like.

mod cell;
mod parquet;
mod text;

use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::xxh3_64;

use crate::columns::{Column, quoted};
use crate::error::{MeasuredError, Place, Remedy};
use cell::Cell;

/// One file's headers and cells.
pub(crate) struct Sheet {
    pub file: PathBuf,
    /// XXH3 of the file's bytes, 16 hexadecimal digits.
    pub data_hash: String,
    pub headers: Vec<String>,
    body: Body,
}

enum Body {
    Text(text::Rows),
    Columns(parquet::Cells),
}

/// First bytes of files that are no tables, and what they are.
const STRANGERS: &[(&[u8], &str)] = &[
    (b"PK\x03\x04", "a zip archive or an Excel workbook: export it as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook: export it as CSV"),
    (b"\x89HDF", "an HDF5 or MATLAB 7.3 file: export it as CSV or Parquet"),
    (b"MATLAB 5.0", "a MATLAB file: export it as CSV or Parquet"),
    (b"TDSm", "a TDMS file: export it as CSV or Parquet"),
    (b"\x1f\x8b", "compressed by gzip: decompress it first"),
    (b"\xff\xfe", "UTF-16 text: save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text: save it as UTF-8"),
];

impl Sheet {
    pub fn open(file: &Path) -> Result<Self, MeasuredError> {
        let bytes = std::fs::read(file).map_err(|source| MeasuredError::Unreadable {
            file: file.to_owned(),
            source,
        })?;
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(MeasuredError::Empty { file: file.to_owned() });
        }
        let data_hash = format!("{:016x}", xxh3_64(&bytes));
        let (headers, body) = if bytes.starts_with(parquet::MAGIC) {
            let (headers, cells) = parquet::read(file, bytes)?;
            (headers, Body::Columns(cells))
        } else {
            refuse_strangers(file, &bytes)?;
            let (headers, rows) = text::read(file, bytes)?;
            (headers, Body::Text(rows))
        };
        let sheet = Sheet {
            file: file.to_owned(),
            data_hash,
            headers,
            body,
        };
        sheet.refuse_numbers_as_headers()?;
        Ok(sheet)
    }

    pub fn rows(&self) -> usize {
        match &self.body {
            Body::Text(rows) => rows.len(),
            Body::Columns(cells) => cells.rows(),
        }
    }

    /// Line of a row; Parquet has none.
    pub fn line(&self, row: usize) -> Option<u64> {
        match &self.body {
            Body::Text(rows) => Some(rows.line(row)),
            Body::Columns(_) => None,
        }
    }

    /// Refuses a row that has more or fewer cells than there are headers.
    pub fn check_row(&self, row: usize, remedy: Remedy) -> Result<(), MeasuredError> {
        let Body::Text(rows) = &self.body else {
            return Ok(());
        };
        let (cells, expected) = (rows.cells(row), self.headers.len());
        if cells == expected {
            return Ok(());
        }
        Err(MeasuredError::Ragged {
            file: self.file.clone(),
            row: row as u64,
            line: rows.line(row),
            cells,
            expected,
            remedy: remedy.of(row as u64),
        })
    }

    fn cell(&self, row: usize, column: usize) -> Cell<'_> {
        match &self.body {
            Body::Text(rows) => rows.cell(row, column),
            Body::Columns(cells) => cells.cell(row, column),
        }
    }

    /// A cell as it is written.
    pub fn text(&self, row: usize, column: usize) -> String {
        match &self.body {
            Body::Text(rows) => rows.text(row, column).to_owned(),
            Body::Columns(cells) => match cells.cell(row, column) {
                Cell::Number(number) => number.to_string(),
                Cell::Text(text) => text.to_owned(),
            },
        }
    }

    /// A number in SI units; refused with its place if it is none or not finite.
    pub fn value(&self, row: usize, column: &Column, remedy: Remedy) -> Result<f64, MeasuredError> {
        let place = || self.place(row, column);
        let raw = match self.cell(row, column.index) {
            Cell::Number(number) => number,
            Cell::Text(text) => {
                return Err(MeasuredError::NotANumber {
                    place: place(),
                    text: text.to_owned(),
                    remedy: remedy.of(row as u64),
                });
            }
        };
        let value = raw * column.scale + column.offset;
        if value.is_finite() {
            Ok(value)
        } else {
            let (place, remedy) = (place(), remedy.of(row as u64));
            Err(MeasuredError::NotFinite { place, value, remedy })
        }
    }

    pub fn place(&self, row: usize, column: &Column) -> Box<Place> {
        Box::new(Place {
            file: self.file.clone(),
            row: row as u64,
            line: self.line(row),
            column: column.header.clone(),
        })
    }

    fn refuse_numbers_as_headers(&self) -> Result<(), MeasuredError> {
        let number = |header: &String| header.parse::<f64>().is_ok();
        if self.headers.iter().all(number) {
            return Err(MeasuredError::NoHeader {
                file: self.file.clone(),
                found: quoted(&self.headers),
            });
        }
        Ok(())
    }
}

fn refuse_strangers(file: &Path, bytes: &[u8]) -> Result<(), MeasuredError> {
    let known = STRANGERS.iter().find(|(magic, _)| bytes.starts_with(magic));
    let named_parquet = file
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    let looks_like = match known {
        Some((_, looks_like)) => looks_like,
        None if named_parquet => "a broken Parquet file: it does not begin with PAR1",
        None if bytes.contains(&0) => "binary: CSV and Parquet are read",
        None => return Ok(()),
    };
    Err(MeasuredError::NotATable {
        file: file.to_owned(),
        looks_like: looks_like.to_owned(),
    })
}
