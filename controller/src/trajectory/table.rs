//! r(t) through the rows (time, position) of a CSV file, by the spline of `spline.rs`.
//!
//! A column is named by its quantity and its unit, as measured tables are: `time_s`, `t_ms`, `position_um`, `Position [nm]`.
//! Without `repeat`: before the first and after the last row the tip stands still; r, r', r'' are continuous everywhere, r''' and
//! r'''' everywhere but in those two rows. With `repeat`: all five are continuous everywhere, the joint included.
//! A spline passes through every row: noise of a measured profile comes back as accelerations, so smooth it before.

use super::jet::Jet;
use super::spline::Spline;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A row's influence on the spline dies by a factor of about 0.43 per row: 80 rows are 5e-30, less than any rounding.
const ROWS_OF_INFLUENCE: usize = 80;
/// How far the last row of a repeating table may be from the first.
const CLOSURE_M: f64 = 1e-9;

/// A table's spline and what happens at its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Table {
    spline: Spline,
    /// Start and period of a repeating table.
    repeat: Option<(f64, f64)>,
}

impl Table {
    /// Of a table that repeats.
    pub fn turns_per_s(&self) -> Option<f64> {
        self.repeat.map(|(_, period_s)| period_s.recip())
    }

    /// Reads the file.
    pub fn load(path: &Path, repeat: bool) -> Result<Self, Invalid> {
        let rows = read(path).map_err(|sentence| refused(path, &sentence))?;
        let table = Self::through(&rows, repeat).map_err(|sentence| refused(path, &sentence))?;
        if table.spline.is_finite() {
            return Ok(table);
        }
        Err(refused(
            path,
            "the steps between its times are too unequal for a spline through its rows",
        ))
    }

    fn through(rows: &[(f64, f64)], repeat: bool) -> Result<Self, String> {
        let (Some(&(first_s, first_m)), Some(&(last_s, last_m))) = (rows.first(), rows.last()) else {
            return Err("it has no rows".into());
        };
        if rows.len() < 2 {
            return Err("it has 1 row, but a way needs at least 2".into());
        }
        if !repeat {
            return Ok(Self {
                spline: Spline::new(rows),
                repeat: None,
            });
        }
        if (last_m - first_m).abs() > CLOSURE_M {
            return Err(format!(
                "a repeating table ends where it began, but its last position_m {last_m} m is not its first, {first_m} m \
                 (within {CLOSURE_M} m)"
            ));
        }
        let period_s = last_s - first_s;
        Ok(Self {
            spline: Spline::new(&unrolled(rows, period_s)),
            repeat: Some((first_s, period_s)),
        })
    }

    pub fn at(&self, time_s: f64) -> Jet {
        let Some((first_s, period_s)) = self.repeat else {
            return self.spline.at(time_s);
        };
        let elapsed_s = time_s - first_s;
        self.spline
            .at(first_s + (elapsed_s - (elapsed_s / period_s).floor() * period_s))
    }
}

/// The period with as many rows of the periods around it as have influence on it.
fn unrolled(rows: &[(f64, f64)], period_s: f64) -> Vec<(f64, f64)> {
    let period = &rows[..rows.len() - 1];
    let around = ROWS_OF_INFLUENCE.div_ceil(period.len()) as i64;
    (-around..=around)
        .flat_map(|turn| {
            period
                .iter()
                .map(move |&(time_s, x)| (time_s + turn as f64 * period_s, x))
        })
        .collect()
}

fn refused(path: &Path, sentence: &str) -> Invalid {
    Invalid::new("file", format!("{}: {sentence}", path.display()))
}

/// The rows, or a sentence that names row (the header is row 1) and column.
fn read(path: &Path) -> Result<Vec<(f64, f64)>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| format!("cannot be read: {error}"))?;
    let header = reader
        .headers()
        .map_err(|error| format!("cannot be read: {error}"))?
        .clone();
    let (time, position) = (TIME.column_of(&header)?, POSITION.column_of(&header)?);
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| format!("cannot be read: {error}"))?;
        let row = record.position().map_or(0, csv::Position::line);
        let number = |column: &Column| {
            let text = record.get(column.place).unwrap_or("");
            text.parse()
                .ok()
                .map(|value: f64| value * column.factor)
                .filter(|value| value.is_finite())
                .ok_or_else(|| format!("row {row}, column {}: \"{text}\" is not a finite number", column.name))
        };
        let (time_s, position_m) = (number(&time)?, number(&position)?);
        if let Some(&(before_s, _)) = rows.last()
            && time_s <= before_s
        {
            return Err(format!(
                "row {row}, column {}: {time_s} s does not come after the row before, {before_s} s",
                time.name
            ));
        }
        rows.push((time_s, position_m));
    }
    Ok(rows)
}

/// What a column holds: the words for it, its units with their factors to SI, and what the column is called otherwise.
struct Quantity {
    words: &'static [&'static str],
    units: &'static [(&'static str, f64)],
    usual: &'static str,
}

const TIME: Quantity = Quantity {
    words: &["time", "t"],
    units: &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6)],
    usual: "time_s",
};

const POSITION: Quantity = Quantity {
    words: &["position", "displacement"],
    units: &[("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9)],
    usual: "position_m",
};

/// A column that was found.
struct Column {
    place: usize,
    name: String,
    factor: f64,
}

impl Quantity {
    fn column_of(&self, header: &csv::StringRecord) -> Result<Column, String> {
        let mut found = header.iter().enumerate().filter_map(|(place, name)| {
            Some(Column {
                place,
                name: name.to_owned(),
                factor: self.factor_of(name)?,
            })
        });
        let names = || header.iter().collect::<Vec<_>>().join(", ");
        let Some(column) = found.next() else {
            let units: Vec<_> = self.units.iter().map(|(unit, _)| *unit).collect();
            return Err(format!(
                "row 1 has no column \"{}\" (or with another unit: {}), only: {}",
                self.usual,
                units.join(", "),
                names()
            ));
        };
        match found.next() {
            None => Ok(column),
            Some(other) => Err(format!(
                "row 1 has both \"{}\" and \"{}\": which of them is the {} is not clear",
                column.name, other.name, self.words[0]
            )),
        }
    }

    /// Of `time_ms`, `Time [ms]` or `time (ms)`.
    fn factor_of(&self, name: &str) -> Option<f64> {
        let name = name.to_lowercase().replace(['µ', 'μ'], "u");
        let (word, unit) = name.trim_end_matches([']', ')']).rsplit_once(['_', '[', '('])?;
        let known = self.words.contains(&word.trim());
        let unit = self.units.iter().find(|(own, _)| known && *own == unit.trim());
        unit.map(|(_, factor)| *factor)
    }
}
