//! Comma-separated values, or with semicolons or tabs, whichever the header uses most. Lines that begin with #
//! are comments, and so is a title above the header; text that is not UTF-8 is taken as Latin-1, in which instruments write µ and °.
//! A row of units below the header joins it. A column of dates and times of day is one of seconds since its first row.

use std::path::Path;

use csv::StringRecord;
use jiff::Timestamp;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;

use super::cell::Cell;
use crate::columns::ColumnMapping;
use crate::error::MeasuredError;
use crate::quantity::{Quantity, is_unit};

/// The rows of a text table.
pub(super) struct Rows {
    records: Vec<StringRecord>,
    columns: usize,
    /// With another separator a comma may stand for the decimal point.
    decimal_comma: bool,
    /// Headers as they stand in the file.
    names: Vec<String>,
    /// Of each column: its first instant, if it is one of instants.
    origins: Vec<Option<Timestamp>>,
}

/// A date with a time of day, with or without a zone, or a time of day alone.
fn instant(text: &str) -> Option<Timestamp> {
    let text = text.replace('/', "-").replace(',', ".");
    let of_day = |time: Time| Date::default().to_datetime(time);
    text.parse().ok().or_else(|| {
        let is_clock = text.contains(':');
        let local: Option<DateTime> = text.parse().ok().or_else(|| text.parse().ok().map(of_day));
        Some(local.filter(|_| is_clock)?.to_zoned(TimeZone::UTC).ok()?.timestamp())
    })
}

/// A cell of a row of units has no number in it, and most cells of the row are units.
fn is_units(record: &StringRecord, below: Option<&StringRecord>, number: impl Fn(&str) -> Option<f64>) -> bool {
    let filled = || record.iter().filter(|cell| !cell.is_empty());
    let known = filled().filter(|cell| is_unit(cell)).count();
    filled().all(|cell| number(cell).is_none() && instant(cell).is_none())
        && 2 * known > filled().count()
        && below.is_none_or(|below| below.iter().any(|cell| number(cell).is_some()))
}

fn number_in(text: &str, decimal_comma: bool) -> Option<f64> {
    match text.parse() {
        Err(_) if decimal_comma => text.replacen(',', ".", 1).parse().ok(),
        parsed => parsed.ok(),
    }
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
    let names: Vec<String> = reader.headers().map_err(not_csv)?.iter().map(str::to_owned).collect();
    let mut records = reader.records().collect::<Result<Vec<_>, _>>().map_err(not_csv)?;
    let decimal_comma = delimiter != b',';
    let mut headers = names.clone();
    if let Some(first) = records.first()
        && is_units(first, records.get(1), |cell| number_in(cell, decimal_comma))
    {
        for (header, unit) in headers.iter_mut().zip(first).filter(|(_, unit)| !unit.is_empty()) {
            *header = format!("{header} [{}]", unit.trim_matches(['[', ']', '(', ')']));
        }
        records.remove(0);
    }
    let first = |column: usize| records.first().and_then(|record| record.get(column)).and_then(instant);
    let origins: Vec<Option<Timestamp>> = (0..names.len()).map(first).collect();
    for (header, _) in headers.iter_mut().zip(&origins).filter(|(_, origin)| origin.is_some()) {
        let known = [&**header, &format!("{header} [s]")].map(str::to_owned);
        let known = known
            .into_iter()
            .find(|own| Quantity::Time.known_header(own) == Some((1.0, 0.0)));
        *header = known.unwrap_or_else(|| "time [s]".into());
    }
    let rows = Rows {
        records,
        columns: headers.len(),
        decimal_comma,
        names,
        origins,
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
        let number = match self.origins.get(column).copied().flatten() {
            None => number_in(text, self.decimal_comma),
            Some(origin) => instant(text).map(|own| 1e-9 * own.duration_since(origin).as_nanos() as f64),
        };
        number.map_or(Cell::Text(text), Cell::Number)
    }

    /// Mappings with the headers that the file's own stand for.
    pub fn resolved(&self, headers: &[String], mappings: &[ColumnMapping]) -> Vec<ColumnMapping> {
        let header_of = |name: &String| {
            let known = self.names.iter().position(|own| own == name);
            known.filter(|_| !headers.contains(name)).map(|column| &headers[column])
        };
        let resolved = mappings.iter().map(|mapping| ColumnMapping {
            header: header_of(&mapping.header).unwrap_or(&mapping.header).clone(),
            ..mapping.clone()
        });
        resolved.collect()
    }
}
