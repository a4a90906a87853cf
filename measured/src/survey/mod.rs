//! What a file holds, told without refusing more than bytes that are no table: its channels, their clock, what each may be, and what the
//! commands that read measurements say of it.

mod clock;
mod proposal;
mod uses;
mod words;

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;

use crate::columns::{LEFT_OUT, named};
use crate::error::MeasuredError;
use crate::noise::{MIN_NOISE_SAMPLES, NoiseFloor, noise_floor};
use crate::quantity::Quantity;
use crate::rows::RowRange;
use crate::run::RunReadOptions;
use crate::sheet::Sheet;

pub use clock::{Clock, ClockGap};
pub use uses::Use;

/// The most samples of which noise is told.
const MOST_FOR_NOISE: usize = 200_000;
/// Rows with a cell that is no number are left out where they are at most one of so many, in at most so many places.
const TORN_OF: usize = 20;
const MOST_TORN: usize = 40;

/// A file's tables.
#[derive(Debug, Serialize)]
pub struct Survey {
    pub file: String,
    /// XXH3 of the file's bytes, 16 hexadecimal digits.
    pub data_hash: String,
    pub tables: Vec<SurveyedTable>,
}

/// Channels of one length.
#[derive(Debug, Serialize)]
pub struct SurveyedTable {
    pub rows: usize,
    /// It is the one that is read, of several.
    pub read: bool,
    /// Of the column that is, or seems to be, the time.
    pub clock: Option<Clock>,
    pub channels: Vec<Channel>,
    /// What follows `--column`, for what is not known by its name.
    pub columns: Vec<String>,
    /// What follows `--drop-rows`: rows that the user leaves out, and those in which a cell is no number, where they are few.
    pub drop_rows: Vec<String>,
    /// What seems odd.
    pub remarks: Vec<String>,
    /// What each command makes of it, read so.
    pub uses: Vec<Use>,
}

/// One column.
#[derive(Debug, Serialize)]
pub struct Channel {
    pub header: String,
    /// What it is, or seems to be: the word that `--column` has for it.
    pub quantity: Option<&'static str>,
    /// SI unit of the quantity; empty where there is none.
    pub unit: &'static str,
    /// What takes its values to that unit.
    pub scale: f64,
    pub offset: f64,
    /// Why it is taken for that; empty for a name that is known.
    pub because: Option<String>,
    /// Cells that are no finite number, those that are left out with their rows, and the first row of either.
    pub not_numbers: usize,
    pub left_out: usize,
    pub first_not_number: Option<usize>,
    /// Smallest, mean and largest number, in the unit of the file.
    pub least: f64,
    pub mean: f64,
    pub most: f64,
    /// The floor under it, in the unit of the file.
    pub noise: Option<NoiseFloor>,
    /// As they stand in the file; not a number where the cell holds none.
    #[serde(skip)]
    pub values: Vec<f64>,
}

impl Survey {
    /// Surveys a file of any format that is read. `options` is what the user has named; the rest is proposed.
    ///
    /// # Errors
    /// A file that cannot be read, or holds no table.
    pub fn of(file: &Path, options: &RunReadOptions) -> Result<Self, MeasuredError> {
        let (sheets, meant) = Sheet::open_all(file, &options.mappings)?;
        for mapping in sheets[meant].mappings.iter().filter(|own| own.header != LEFT_OUT) {
            named(file, &sheets[meant].headers, mapping)?;
        }
        let data_hash = sheets[meant].data_hash.clone();
        let tables = sheets.into_iter().enumerate();
        Ok(Survey {
            file: file.display().to_string(),
            data_hash,
            tables: tables
                .map(|(index, sheet)| table(sheet, index == meant, options))
                .collect(),
        })
    }

    /// The table that is read, if this command reads it.
    pub fn read_by(&self, command: &str) -> Option<&SurveyedTable> {
        let table = self.tables.iter().find(|table| table.read)?;
        let mut uses = table.uses.iter().filter(|own| own.reads);
        let reads = uses.any(|own| own.commands.split(", ").any(|name| name == command));
        reads.then_some(table)
    }
}

fn table(mut sheet: Sheet, read: bool, options: &RunReadOptions) -> SurveyedTable {
    let mut options = options.clone();
    let mut rows: Vec<usize> = crate::run::chosen(&sheet, &options);
    let all = |rows: &[usize]| -> Vec<Channel> {
        let columns = 0..sheet.headers.len();
        columns.map(|column| channel(&sheet, rows, column)).collect()
    };
    let mut channels = all(&rows);
    let torn = torn(&channels, &rows);
    if !torn.is_empty() {
        // Read without them, their cells are counted all the same.
        let counts: Vec<_> = channels
            .iter()
            .map(|own| (own.not_numbers, own.first_not_number))
            .collect();
        options.drop_rows.extend(torn);
        rows = crate::run::chosen(&sheet, &options);
        channels = all(&rows);
        for (own, (count, first)) in channels.iter_mut().zip(counts) {
            own.left_out = count - own.not_numbers;
            own.first_not_number = first;
        }
    }
    let (taken, mut remarks) = proposal::proposed(&channels, &sheet.mappings);
    for own in &taken {
        let channel = &mut channels[own.channel];
        channel.quantity = Some(own.quantity.key());
        channel.unit = own.quantity.unit();
        (channel.scale, channel.offset) = (own.scale, own.offset);
        channel.because = Some(own.because.clone());
    }
    let time = taken.iter().find(|own| own.quantity == Quantity::Time);
    let clock = time.filter(|_| rows.len() > 1).map(|own| {
        let time_s: Vec<f64> = channels[own.channel].in_si().collect();
        let mut clock = Clock::of(&time_s);
        clock.listed.iter_mut().for_each(|gap| gap.row = rows[gap.row]);
        clock
    });
    let given: Vec<String> = sheet.mappings.iter().map(ToString::to_string).collect();
    let columns: Vec<String> = taken.into_iter().filter_map(|own| own.option).collect();
    // What the user leaves out is said, too.
    let left_out = given.iter().filter(|own| own.ends_with("=-"));
    let mut columns: Vec<String> = columns.iter().chain(left_out).cloned().collect();
    let uses = if read {
        // Words that we wrote are words that are read.
        sheet.mappings = columns.iter().filter_map(|own| own.parse().ok()).collect();
        let said = uses::uses(sheet, &options);
        remarks.extend(said.remarks);
        // What is advised is what is proposed.
        for turned in said.turned {
            let key = turned.split_inclusive('=').next().unwrap_or_default().to_owned();
            columns.retain(|own| !own.starts_with(&key));
            columns.push(turned);
        }
        said.uses
    } else {
        Vec::new()
    };
    SurveyedTable {
        rows: rows.len(),
        read,
        clock,
        channels,
        columns,
        drop_rows: options.drop_rows.iter().map(ToString::to_string).collect(),
        remarks,
        uses,
    }
}

/// Rows in which a column of numbers has a cell that is none, as ranges; none where they are not few, or are not in a few places.
fn torn(channels: &[Channel], rows: &[usize]) -> Vec<RowRange> {
    let most = rows.len() / TORN_OF;
    let of_numbers = |own: &&Channel| (1..=most).contains(&own.not_numbers);
    let torn: BTreeSet<usize> = channels
        .iter()
        .filter(of_numbers)
        .flat_map(|own| own.values.iter().zip(rows).filter(|(value, _)| value.is_nan()))
        .map(|(_, row)| *row)
        .collect();
    let mut ranges: Vec<RowRange> = Vec::new();
    for row in torn.iter().map(|row| *row as u64) {
        match ranges.last_mut().filter(|last| last.end == row) {
            Some(last) => last.end += 1,
            None => ranges.push(RowRange {
                first: row,
                end: row + 1,
            }),
        }
    }
    if torn.len() > most || ranges.len() > MOST_TORN {
        ranges.clear();
    }
    ranges
}

fn channel(sheet: &Sheet, rows: &[usize], column: usize) -> Channel {
    let number = |row: &usize| {
        sheet
            .number(*row, column)
            .filter(|value| value.is_finite())
            .unwrap_or(f64::NAN)
    };
    let values: Vec<f64> = rows.iter().map(number).collect();
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let count = finite().count();
    let looked_at = &values[..values.len().min(MOST_FOR_NOISE)];
    let steady = values.iter().all(|value| *value == values[0]);
    let noisy = count == values.len() && count >= MIN_NOISE_SAMPLES && !steady;
    Channel {
        header: sheet.headers[column].clone(),
        quantity: None,
        unit: "",
        scale: 1.0,
        offset: 0.0,
        because: None,
        not_numbers: values.len() - count,
        left_out: 0,
        first_not_number: values.iter().position(|value| value.is_nan()).map(|index| rows[index]),
        least: finite().fold(f64::NAN, f64::min),
        mean: finite().sum::<f64>() / count as f64,
        most: finite().fold(f64::NAN, f64::max),
        noise: noisy.then(|| noise_floor(looked_at, &[])).flatten(),
        values,
    }
}

impl Channel {
    /// Its values in the unit of its quantity.
    pub fn in_si(&self) -> impl Iterator<Item = f64> {
        self.values.iter().map(|value| value * self.scale + self.offset)
    }

    /// Every cell holds a number.
    pub(crate) fn is_whole(&self) -> bool {
        self.not_numbers == 0 && !self.values.is_empty()
    }

    /// It holds one value.
    pub(crate) fn is_steady(&self) -> bool {
        self.least == self.most
    }

    pub(crate) fn is_integer(&self) -> bool {
        self.values.iter().all(|value| value.fract() == 0.0)
    }

    pub(crate) fn increases(&self) -> bool {
        self.values.len() > 2 && self.values.windows(2).all(|pair| pair[1] > pair[0])
    }

    /// How many values it holds, if they are not more than so many.
    pub(crate) fn distinct(&self, most: usize) -> Option<usize> {
        let mut seen = BTreeSet::new();
        for value in &self.values {
            seen.insert(value.to_bits());
            if seen.len() > most {
                return None;
            }
        }
        Some(seen.len())
    }
}
