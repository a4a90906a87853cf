//! Parquet: flat columns of numbers. A cell that is null reads as empty, one that holds no number as its text.

use std::collections::BTreeMap;
use std::path::Path;

use bytes::Bytes;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use super::cell::Cell;
use crate::error::MeasuredError;

/// What every Parquet file begins with.
pub(super) const MAGIC: &[u8] = b"PAR1";

/// The cells of a file, row by row.
pub(super) struct Cells {
    columns: usize,
    numbers: Vec<f64>,
    /// Cells that hold no number, by their place in `numbers`.
    others: BTreeMap<usize, Box<str>>,
}

/// Headers and cells.
pub(super) fn read(file: &Path, bytes: Vec<u8>) -> Result<(Vec<String>, Cells), MeasuredError> {
    let refuse = |source| MeasuredError::NotParquet {
        file: file.to_owned(),
        source: Box::new(source),
    };
    let reader = SerializedFileReader::new(Bytes::from(bytes)).map_err(refuse)?;
    let fields = reader.metadata().file_metadata().schema().get_fields();
    let headers: Vec<String> = fields.iter().map(|field| field.name().to_owned()).collect();
    let (mut numbers, mut others) = (Vec::new(), BTreeMap::new());
    for row in reader.get_row_iter(None).map_err(refuse)? {
        let row = row.map_err(refuse)?;
        for (_, field) in row.get_column_iter() {
            numbers.push(number(field).unwrap_or_else(|text| {
                others.insert(numbers.len(), text);
                f64::NAN
            }));
        }
    }
    let cells = Cells {
        columns: headers.len(),
        numbers,
        others,
    };
    Ok((headers, cells))
}

fn number(field: &Field) -> Result<f64, Box<str>> {
    Ok(match field {
        Field::Double(value) => *value,
        Field::Float(value) => f64::from(*value),
        Field::Float16(value) => value.to_f64(),
        Field::Byte(value) => f64::from(*value),
        Field::Short(value) => f64::from(*value),
        Field::Int(value) => f64::from(*value),
        Field::Long(value) => *value as f64,
        Field::UByte(value) => f64::from(*value),
        Field::UShort(value) => f64::from(*value),
        Field::UInt(value) => f64::from(*value),
        Field::ULong(value) => *value as f64,
        Field::Null => return Err("".into()),
        Field::Str(text) => return text.trim().parse().map_err(|_| text.trim().into()),
        other => return Err(other.to_string().into()),
    })
}

impl Cells {
    pub fn rows(&self) -> usize {
        self.numbers.len().checked_div(self.columns).unwrap_or(0)
    }

    pub fn cell(&self, row: usize, column: usize) -> Cell<'_> {
        let index = row * self.columns + column;
        match self.others.get(&index) {
            Some(text) => Cell::Text(text),
            None => Cell::Number(self.numbers[index]),
        }
    }
}
