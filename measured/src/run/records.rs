//! Records for hysteresis laws: whatever drives and whatever answers, in any order of rows, on any clock.
//!
//! A law needs the order of what happened, and what time passed between two samples if creep is to be told; it needs no uniform clock and
//! no unit. So rows that time finds shuffled are sorted, a time that begins anew begins another record, and a magnitude that no actuator of
//! ours has is told, not refused.

use std::path::Path;

use super::options::RunReadOptions;
use super::read::two_sided;
use super::record::{LAW_INPUTS, LAW_OUTPUTS, MeasuredRun};
use super::selection::{MIN_RUN_ROWS, Selection, chosen};
use super::time;
use crate::error::{MeasuredError, Remedy};
use crate::quantity::Quantity;
use crate::sheet::Sheet;
use crate::units;

/// Time that runs back in more than this share of the rows was shuffled; in fewer, it begins anew.
const SHUFFLED: f64 = 0.1;

impl MeasuredRun {
    /// One record, or every loop of a table that holds several; loops may be short or stand still.
    ///
    /// # Errors
    /// A table that is none, or without an input or an output, and values that no material reaches.
    pub fn read_records(file: &Path, options: &RunReadOptions) -> Result<Vec<Self>, MeasuredError> {
        Self::records_of(&Sheet::open(file, &options.mappings)?, options)
    }

    /// The records of a table that was opened.
    pub(crate) fn records_of(sheet: &Sheet, options: &RunReadOptions) -> Result<Vec<Self>, MeasuredError> {
        let columns = two_sided(sheet, [&LAW_INPUTS, &LAW_OUTPUTS])?;
        let all = Selection {
            rows: chosen(sheet, options),
            sheet,
            columns: &columns,
            remedy: Remedy::DropRow,
        };
        let mut records = Vec::new();
        let mut longest = 0;
        for selection in all.by_loop()? {
            let (parts, doubt) = in_order(selection)?;
            let several = parts.len() > 1;
            longest = parts.iter().map(|part| part.rows.len()).fold(longest, usize::max);
            // One row has no motion.
            for (number, part) in parts.iter().filter(|part| part.rows.len() > 1).enumerate() {
                let mut run = part.record()?;
                run.doubts.extend(doubt.clone().filter(|_| number == 0));
                if several {
                    run.loop_id = format!("{} part {number}", run.loop_id);
                }
                records.push(run);
            }
        }
        if records.is_empty() {
            return Err(MeasuredError::RunTooShort {
                file: sheet.file.clone(),
                rows: longest,
                in_file: sheet.rows(),
                least: MIN_RUN_ROWS,
            });
        }
        Ok(records)
    }
}

impl Selection<'_> {
    fn record(&self) -> Result<MeasuredRun, MeasuredError> {
        let mut series = self.series()?;
        let time_s = series[Quantity::Time.index()].take().and_then(told_apart);
        let doubt = units::doubt(self, &series)?;
        let steady = time_s.as_deref().filter(|time_s| time_s.len() >= MIN_RUN_ROWS);
        // A clock that cannot be mended is kept as it is.
        let clock = steady.and_then(|time_s| time::clock(self, time_s, &series).ok());
        let mut run = self.run(series, time_s);
        run.doubts.extend(doubt);
        if let Some(clock) = clock {
            run.keep_time(clock);
        }
        Ok(run)
    }
}

/// Its rows in the order of time, one part for every time that time begins anew; and what was done, in words.
fn in_order(selection: Selection) -> Result<(Vec<Selection>, Option<String>), MeasuredError> {
    let Some(column) = selection.columns.of(Quantity::Time) else {
        return Ok((vec![selection], None));
    };
    let time_of = |row: &usize| selection.sheet.value(*row, column, selection.remedy);
    let time_s: Vec<f64> = selection.rows.iter().map(time_of).collect::<Result<_, _>>()?;
    let back: Vec<usize> = (1..time_s.len()).filter(|row| time_s[*row] < time_s[row - 1]).collect();
    if back.is_empty() {
        return Ok((vec![selection], None));
    }
    let file = selection.sheet.file.display();
    if back.len() as f64 > SHUFFLED * time_s.len() as f64 {
        let mut order: Vec<usize> = (0..time_s.len()).collect();
        order.sort_by(|one, other| time_s[*one].total_cmp(&time_s[*other]));
        let doubt = format!(
            "{file}: its rows do not stand in the order of time; they were sorted by column \"{}\"",
            column.header
        );
        let rows = order.into_iter().map(|index| selection.rows[index]).collect();
        return Ok((vec![Selection { rows, ..selection }], Some(doubt)));
    }
    let place = selection.sheet.place(selection.rows[back[0]], column);
    let doubt = format!(
        "{place}: time begins anew there, and {} times in all: another record was begun at each",
        back.len()
    );
    let begins = std::iter::once(0).chain(back.iter().copied());
    let ends = back.iter().copied().chain([time_s.len()]);
    let part = |(begin, end): (usize, usize)| Selection {
        rows: selection.rows[begin..end].to_vec(),
        ..selection.clone()
    };
    Ok((begins.zip(ends).map(part).collect(), Some(doubt)))
}

/// Stamps of too few digits spread evenly, where that moves none of them by more than a step of theirs; none where time stands still.
fn told_apart(time_s: Vec<f64>) -> Option<Vec<f64>> {
    let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
    if steps().all(|step_s| step_s > 0.0) {
        return Some(time_s);
    }
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    if last <= first {
        return None;
    }
    let tick_s = (last - first) / (time_s.len() - 1) as f64;
    let even = |sample: usize| first + sample as f64 * tick_s;
    let longest = steps().fold(0.0, f64::max);
    let close = (0..time_s.len()).all(|sample| (even(sample) - time_s[sample]).abs() <= longest);
    Some(if close {
        (0..time_s.len()).map(even).collect()
    } else {
        time_s
    })
}
