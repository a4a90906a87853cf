//! A table as it stands in a file, text, Parquet or a [`container`] of channels, before anybody knows what its columns mean.
//!
//! Rows count from 0 after the header; lines, which only text has, from 1. What is no table is refused by what it
//! looks like.

mod cell;
pub(crate) mod container;
mod parquet;
mod text;

use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::xxh3_64;

use crate::columns::{Column, ColumnMapping, quoted};
use crate::error::{MeasuredError, Place, Remedy};
use cell::Cell;
use container::table::{Table, meant, tables};

/// One file's headers and cells.
pub(crate) struct Sheet {
    pub file: PathBuf,
    /// XXH3 of the file's bytes, 16 hexadecimal digits.
    pub data_hash: String,
    pub headers: Vec<String>,
    /// Mappings with the headers that their names stand for.
    pub mappings: Vec<ColumnMapping>,
    body: Body,
}

enum Body {
    Text(text::Rows),
    Columns(parquet::Cells),
    Channels(Table),
}

/// First bytes of files that are no tables, and what they are.
const STRANGERS: &[(&[u8], &str)] = &[
    (
        b"PK\x03\x04",
        "a zip archive or an Excel workbook: export it as CSV, or, if it is NumPy's, call it .npz",
    ),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook: export it as CSV"),
    (
        b"\x89HDF",
        "an HDF5 file whose first bytes are broken: it was transferred as text, or torn",
    ),
    (b"\x1f\x8b", "compressed by gzip: decompress it first"),
    (b"\xff\xfe", "UTF-16 text: save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text: save it as UTF-8"),
];

impl Sheet {
    /// The table of a file; of several, the one that holds what is named, or most that is known.
    pub fn open(file: &Path, mappings: &[ColumnMapping]) -> Result<Self, MeasuredError> {
        let (mut sheets, meant) = Self::open_all(file, mappings)?;
        Ok(sheets.swap_remove(meant))
    }

    /// All tables of a file, and which of them is meant.
    pub fn open_all(file: &Path, mappings: &[ColumnMapping]) -> Result<(Vec<Self>, usize), MeasuredError> {
        let Raw { data_hash, content } = Raw::read(file)?;
        let sheet = |headers, mappings, body| Sheet {
            file: file.to_owned(),
            data_hash: data_hash.clone(),
            headers,
            mappings,
            body,
        };
        let one = |headers, mappings, body| (vec![sheet(headers, mappings, body)], 0);
        let (sheets, meant): (Vec<Self>, usize) = match content {
            Content::Channels(tables) => {
                let meant = meant(&tables, mappings);
                let sheets = tables.into_iter().map(|table| {
                    let mappings = table.resolved(mappings);
                    sheet(table.headers.clone(), mappings, Body::Channels(table))
                });
                (sheets.collect(), meant)
            }
            Content::Columns(headers, cells) => one(headers, mappings.to_vec(), Body::Columns(cells)),
            Content::Text(headers, rows) => {
                let mappings = rows.resolved(&headers, mappings);
                one(headers, mappings, Body::Text(rows))
            }
        };
        sheets[meant].refuse_numbers_as_headers()?;
        Ok((sheets, meant))
    }

    pub fn rows(&self) -> usize {
        match &self.body {
            Body::Text(rows) => rows.len(),
            Body::Columns(cells) => cells.rows(),
            Body::Channels(table) => table.rows(),
        }
    }

    /// Line of a row; only text has lines.
    pub fn line(&self, row: usize) -> Option<u64> {
        match &self.body {
            Body::Text(rows) => Some(rows.line(row)),
            Body::Columns(_) | Body::Channels(_) => None,
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
            Body::Channels(table) => Cell::Number(table.value(row, column)),
        }
    }

    /// The number in a cell, if it holds one.
    pub fn number(&self, row: usize, column: usize) -> Option<f64> {
        match self.cell(row, column) {
            Cell::Number(number) => Some(number),
            Cell::Text(_) => None,
        }
    }

    /// A cell as it is written.
    pub fn text(&self, row: usize, column: usize) -> String {
        if let Body::Text(rows) = &self.body {
            return rows.text(row, column).to_owned();
        }
        match self.cell(row, column) {
            Cell::Number(number) => number.to_string(),
            Cell::Text(text) => text.to_owned(),
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

/// All that a file holds.
pub(crate) struct Raw {
    data_hash: String,
    content: Content,
}

enum Content {
    Text(Vec<String>, text::Rows),
    Columns(Vec<String>, parquet::Cells),
    /// At least one.
    Channels(Vec<Table>),
}

impl Raw {
    pub fn read(file: &Path) -> Result<Self, MeasuredError> {
        let bytes = std::fs::read(file).map_err(|source| MeasuredError::Unreadable {
            file: file.to_owned(),
            source,
        })?;
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(MeasuredError::Empty { file: file.to_owned() });
        }
        let data_hash = format!("{:016x}", xxh3_64(&bytes));
        let content = if bytes.starts_with(parquet::MAGIC) {
            let (headers, cells) = parquet::read(file, bytes)?;
            Content::Columns(headers, cells)
        } else if let Some(format) = container::format_of(file, &bytes) {
            Content::Channels(tables(format.channels(file, &bytes)?))
        } else {
            refuse_strangers(file, &bytes)?;
            let (headers, rows) = text::read(file, bytes)?;
            Content::Text(headers, rows)
        };
        Ok(Raw { data_hash, content })
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
        None if bytes.contains(&0) => {
            "binary, and of no kind that is read: CSV, Parquet, MATLAB, HDF5, NumPy, TDMS, MDF4 and MCAP are"
        }
        None => return Ok(()),
    };
    Err(MeasuredError::NotATable {
        file: file.to_owned(),
        looks_like: looks_like.to_owned(),
    })
}
