//! The one door for measured tables: columns, rows, values, and the checks in the order in which they explain one another.
//!
//! A run is one record over time, or one slow sweep without; loops are such sweeps one behind the other, told apart by a column.

use std::path::Path;

use super::options::RunReadOptions;
use super::record::{INPUTS, MeasuredRun, OUTPUTS, Series, derive_magnetization};
use super::selection::{Selection, chosen};
use super::{sweeps, time};
use crate::columns::{Columns, missing, quoted};
use crate::error::{MeasuredError, Remedy};
use crate::quantity::Quantity;
use crate::sheet::Sheet;
use crate::units;

/// What is looked for in a table of loops.
pub(crate) const OF_LOOPS: [Quantity; 6] = [
    Quantity::LoopId,
    Quantity::Time,
    Quantity::Field,
    Quantity::FluxDensity,
    Quantity::Magnetization,
    Quantity::Strain,
];

impl MeasuredRun {
    /// Reads and checks one record from a file of any format that is read; every refusal says the value, its limit, its place and what to do.
    ///
    /// # Errors
    /// A table that is none, or holds no run.
    pub fn read(file: &Path, options: &RunReadOptions) -> Result<Self, MeasuredError> {
        Self::of(&Sheet::open(file, &options.mappings)?, options)
    }

    /// One record from a table that was opened.
    pub(crate) fn of(sheet: &Sheet, options: &RunReadOptions) -> Result<Self, MeasuredError> {
        let columns = two_sided(sheet, [&INPUTS, &OUTPUTS])?;
        let selection = Selection {
            rows: chosen(sheet, options),
            sheet,
            columns: &columns,
            remedy: Remedy::CutRun,
        };
        selection.refuse_short_run()?;
        selection.refuse_several_loops()?;
        let mut series = selection.series()?;
        let time_s = series[Quantity::Time.index()].take();
        if let Some(time_s) = &time_s {
            time::refuse_disorder(&selection, time_s)?;
        }
        selection.refuse_constants(&series)?;
        units::check(&selection, &series, time_s.as_deref())?;
        let clock = time_s
            .as_ref()
            .map(|time_s| time::clock(&selection, time_s, &series))
            .transpose()?;
        let mut run = selection.run(series, time_s);
        if let Some(clock) = clock {
            run.keep_time(clock);
        }
        Ok(run)
    }

    /// One record, or the loops of a table that holds several.
    ///
    /// # Errors
    /// As those of [`MeasuredRun::read`] and [`MeasuredRun::read_loops`].
    pub fn read_each(file: &Path, options: &RunReadOptions) -> Result<Vec<Self>, MeasuredError> {
        match Self::read(file, options) {
            Err(MeasuredError::SeveralLoops { .. }) => Self::read_loops(file, options),
            one => one.map(|run| vec![run]),
        }
    }

    /// Reads and checks sweeps of the field, one a loop, in the order of their first rows. Their time need not be uniform, and is not
    /// looked at.
    ///
    /// # Errors
    /// A table that is none, or holds no loops of magnetization over field.
    pub fn read_loops(file: &Path, options: &RunReadOptions) -> Result<Vec<Self>, MeasuredError> {
        Self::loops_of(&Sheet::open(file, &options.mappings)?, options)
    }

    /// The sweeps of a table that was opened.
    pub(crate) fn loops_of(sheet: &Sheet, options: &RunReadOptions) -> Result<Vec<Self>, MeasuredError> {
        let columns = Columns::resolve(&sheet.file, &sheet.headers, &sheet.mappings, &OF_LOOPS)?;
        require_magnetization(sheet, &columns)?;
        let all = Selection {
            rows: chosen(sheet, options),
            sheet,
            columns: &columns,
            remedy: Remedy::DropRow,
        };
        let loop_of = |selection: Selection| {
            selection.refuse_short_loop()?;
            let mut series = selection.series()?;
            let time_s = series[Quantity::Time.index()].take();
            if let Some(time_s) = &time_s {
                time::refuse_disorder(&selection, time_s)?;
            }
            selection.refuse_constants(&series)?;
            derive_magnetization(&mut series);
            units::limits(&selection, &series)?;
            let run = MeasuredRun {
                dropped_rows: sheet.rows() - all.rows.len(),
                ..selection.run(series, time_s)
            };
            sweeps::check(&selection, &run)?;
            Ok(run)
        };
        all.by_loop()?.into_iter().map(loop_of).collect()
    }
}

impl Selection<'_> {
    pub(super) fn run(&self, mut series: Series, time_s: Option<Vec<f64>>) -> MeasuredRun {
        derive_magnetization(&mut series);
        let derived = self.columns.of(Quantity::Magnetization).is_none();
        let (sheet, rows) = (self.sheet, &self.rows);
        MeasuredRun {
            source: sheet.file.display().to_string(),
            data_hash: sheet.data_hash.clone(),
            loop_id: self.loop_id(),
            lines: rows.iter().map(|row| sheet.line(*row)).collect(),
            dropped_rows: sheet.rows() - rows.len(),
            rows: rows.iter().map(|row| *row as u64).collect(),
            time_s,
            tick_s: None,
            repair: None,
            doubts: Vec::new(),
            derived: derived && series[Quantity::Magnetization.index()].is_some(),
            series,
            columns: Some(self.columns.clone()),
        }
    }
}

/// The columns of a table with an input and an output: one of each list.
pub(super) fn two_sided(sheet: &Sheet, [inputs, outputs]: [&[Quantity]; 2]) -> Result<Columns, MeasuredError> {
    let columns = Columns::resolve(&sheet.file, &sheet.headers, &sheet.mappings, &Quantity::ALL)?;
    let sides = [
        ("input", inputs, "command=HEADER*SCALE"),
        ("output", outputs, "displacement=HEADER*SCALE"),
    ];
    // Without one of them it says nothing about an actuator.
    for (side, wanted, example) in sides {
        if wanted.iter().all(|quantity| columns.of(*quantity).is_none()) {
            let names: Vec<_> = wanted.iter().map(|quantity| quantity.header()).collect();
            return Err(MeasuredError::OneSided {
                file: sheet.file.clone(),
                side,
                wanted: names.join(", "),
                present: quoted(&sheet.headers),
                example,
            });
        }
    }
    Ok(columns)
}

/// Loops are of magnetization over field, and no name may contradict its scale.
fn require_magnetization(sheet: &Sheet, columns: &Columns) -> Result<(), MeasuredError> {
    let file = &sheet.file;
    if columns.of(Quantity::Field).is_none() {
        return Err(missing(file, &sheet.headers, Quantity::Field));
    }
    if columns.of(Quantity::FluxDensity).is_none() && columns.of(Quantity::Magnetization).is_none() {
        return Err(MeasuredError::NothingToFit { file: file.clone() });
    }
    let contradiction = columns.iter().find_map(|(_, column)| column.contradiction(file));
    contradiction.map_or(Ok(()), Err)
}
