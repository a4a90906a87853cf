//! MATLAB v5, uncompressed: after a header of 128 bytes one matrix element a column, n by 1, under the column's name.
//!
//! An element is its type and its length, four bytes each, and its bytes, filled up to eight. Source: MAT-File Format, MathWorks.

use anhyst_launch::measured_table::MeasuredTable;

/// Types of elements.
const INT8: u32 = 1;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
/// Class of a matrix of doubles.
const CLASS_DOUBLE: u32 = 6;
/// What a length can be.
const MOST_ROWS: usize = (1 << 28) - 64;

fn element(into: &mut Vec<u8>, kind: u32, bytes: &[u8]) {
    into.extend(kind.to_le_bytes());
    into.extend((bytes.len() as u32).to_le_bytes());
    into.extend(bytes);
    into.resize(into.len().next_multiple_of(8), 0);
}

pub(super) fn bytes(table: &MeasuredTable) -> Result<Vec<u8>, String> {
    let rows = table.rows();
    if rows > MOST_ROWS {
        return Err(format!(
            "{rows} rows: a MATLAB v5 variable holds at most {MOST_ROWS}; take parquet"
        ));
    }
    let mut file = format!("{:<116}", "MATLAB 5.0 MAT-file, written by anhyst").into_bytes();
    file.extend([0; 8]);
    // Version 1, and the mark by which a reader sees the order of bytes.
    file.extend(0x0100_u16.to_le_bytes());
    file.extend(*b"IM");
    for (name, values) in &table.columns {
        let mut matrix = Vec::with_capacity(8 * rows + 64);
        let flags = [CLASS_DOUBLE, 0].map(u32::to_le_bytes).concat();
        element(&mut matrix, UINT32, &flags);
        element(&mut matrix, INT32, &[rows as u32, 1].map(u32::to_le_bytes).concat());
        element(&mut matrix, INT8, name.as_bytes());
        let numbers: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        element(&mut matrix, DOUBLE, &numbers);
        element(&mut file, MATRIX, &matrix);
    }
    Ok(file)
}
