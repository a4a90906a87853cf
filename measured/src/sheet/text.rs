//! Comma-separated values, or with semicolons or tabs, whichever the header uses most. Lines that begin with #
//! are comments, and so is a title above the header; text that is not UTF-8 is taken as Latin-1, in which instruments write µ and °.

use std::path::Path;

use csv::StringRecord;

use super::cell::Cell;
use crate::error::MeasuredError;

/// The rows of a text table.
pub(super) struct Rows {
    records: Vec<StringRecord>,
    columns: usize,
    /// With another separator a comma may stand for the decimal point.
    decimal_comma: bool,
}

/// Headers and rows.
pub(super) fn read(file: &Path, bytes: Vec<u8>) -> Result<(Vec<String>, Rows), MeasuredError> {
    let text = String::from_utf8(bytes).unwrap_or_else(|not_utf8| {
        let latin_1 = not_utf8.as_bytes().iter();
        latin_1.map(|&byte| char::from(byte)).collect()
    });
    let (title, delimiter) = header(&text);
    // As a comment, so that lines keep their numbers.
    let text = if title == 0 {
        text
    } else {
        let lines = text.split_inclusive('\n').enumerate();
        lines
            .map(|(line, own)| format!("{}{own}", if line < title { "#" } else { "" }))
            .collect()
    };
    let not_csv = |source| MeasuredError::NotCsv {
        file: file.to_owned(),
        source,
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .delimiter(delimiter)
        .flexible(true)
        .from_reader(text.as_bytes());
    let headers: Vec<String> = reader.headers().map_err(not_csv)?.iter().map(str::to_owned).collect();
    let records = reader.records().collect::<Result<Vec<_>, _>>().map_err(not_csv)?;
    let rows = Rows {
        records,
        columns: headers.len(),
        decimal_comma: delimiter != b',',
    };
    Ok((headers, rows))
}

/// Lines of a text in which the header and how many cells rows have is looked for.
const LOOKED_AT: usize = 100;

/// How many lines stand above the header, and the separator that it holds most of. What instruments write above it has fewer cells than the rows,
/// or numbers; where no line is plainly the header, it is the first that is no comment.
fn header(text: &str) -> (usize, u8) {
    let count = |line: &str, separator: u8| line.bytes().filter(|byte| *byte == separator).count();
    // The last of equals wins, so a file of one column has commas.
    let most = |line: &str| {
        let all = [b'\t', b';', b','].into_iter();
        all.max_by_key(|&separator| count(line, separator)).unwrap_or(b',')
    };
    let lines: Vec<(usize, &str)> = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
        .take(LOOKED_AT)
        .collect();
    let (Some(&(_, first)), Some(&(_, row))) = (lines.first(), lines.last()) else {
        return (0, b',');
    };
    let is_header = |line: &str| {
        let separator = most(line);
        let mut cells = line
            .split(char::from(separator))
            .map(|cell| cell.trim().trim_matches('"'));
        count(line, separator) >= count(row, separator).max(1)
            && cells.all(|cell| !cell.is_empty() && cell.replace(',', ".").parse::<f64>().is_err())
    };
    let found = lines.iter().find(|(_, line)| is_header(line));
    found.map_or((0, most(first)), |&(number, line)| (number, most(line)))
}

impl Rows {
    pub fn len(&self) -> usize {
        self.records.len()
    }

    pub fn line(&self, row: usize) -> u64 {
        self.records[row].position().map_or(row as u64 + 2, csv::Position::line)
    }

    /// How many cells a row has, without empty ones past the last header.
    pub fn cells(&self, row: usize) -> usize {
        let record = &self.records[row];
        let beyond = record.iter().skip(self.columns);
        let filled = beyond.enumerate().filter(|(_, cell)| !cell.is_empty()).last();
        match filled {
            Some((index, _)) => self.columns + index + 1,
            None => record.len().min(self.columns),
        }
    }

    pub fn text(&self, row: usize, column: usize) -> &str {
        self.records[row].get(column).unwrap_or_default()
    }

    pub fn cell(&self, row: usize, column: usize) -> Cell<'_> {
        let text = self.text(row, column);
        let number = match text.parse() {
            Err(_) if self.decimal_comma => text.replacen(',', ".", 1).parse(),
            parsed => parsed,
        };
        number.map_or(Cell::Text(text), Cell::Number)
    }
}
