//! One record of an actuator: all series in SI units and of one length.

use crate::columns::{Column, Columns};
use crate::error::MeasuredError;
use crate::quantity::Quantity;

/// What can drive an actuator.
pub const INPUTS: [Quantity; 4] = [
    Quantity::FieldCommand,
    Quantity::Field,
    Quantity::Current,
    Quantity::Voltage,
];

/// What an actuator can answer with.
pub const OUTPUTS: [Quantity; 4] = [
    Quantity::Displacement,
    Quantity::Strain,
    Quantity::Magnetization,
    Quantity::FluxDensity,
];

/// One record of an actuator. Every present series has [`MeasuredRun::len`] samples.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRun {
    /// Where the data come from: the path as given.
    pub source: String,
    /// XXH3 of the file's bytes, 16 hexadecimal digits; empty for a run that was never in a file.
    pub data_hash: String,
    /// Row of each sample in the file, from 0 after the header.
    pub rows: Vec<u64>,
    /// Line of each sample in the file; a Parquet file has none.
    pub lines: Option<Vec<u64>>,
    pub dropped_rows: usize,
    /// As measured; strictly increasing.
    pub time_s: Option<Vec<f64>>,
    /// The uniform interval between samples.
    pub tick_s: Option<f64>,
    /// By [`Quantity::index`].
    pub(super) series: [Option<Vec<f64>>; Quantity::ALL.len()],
    pub(super) columns: Option<Columns>,
}

impl MeasuredRun {
    /// A run that was made, not measured: uniform in time from 0 s if it has a tick.
    pub fn in_memory(
        source: &str,
        tick_s: Option<f64>,
        series: Vec<(Quantity, Vec<f64>)>,
    ) -> Result<Self, MeasuredError> {
        let samples = series.first().map_or(0, |(_, values)| values.len());
        let mut run = MeasuredRun {
            source: source.to_owned(),
            data_hash: String::new(),
            rows: (0..samples as u64).collect(),
            lines: None,
            dropped_rows: 0,
            time_s: tick_s.map(|tick_s| (0..samples).map(|sample| sample as f64 * tick_s).collect()),
            tick_s,
            series: Default::default(),
            columns: None,
        };
        for (quantity, values) in series {
            if values.len() != samples {
                return Err(MeasuredError::UnequalLengths {
                    source_of_data: run.source,
                    quantity: quantity.name(),
                    samples: values.len(),
                    expected: samples,
                });
            }
            run.series[quantity.index()] = Some(values);
        }
        Ok(run)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// One quantity in SI units, if the run holds it. Time is [`MeasuredRun::time_s`].
    pub fn series(&self, quantity: Quantity) -> Option<&[f64]> {
        self.series[quantity.index()].as_deref()
    }

    /// What drove the actuator: those of [`INPUTS`] that the run holds.
    pub fn inputs(&self) -> impl Iterator<Item = Quantity> {
        INPUTS.into_iter().filter(|quantity| self.series(*quantity).is_some())
    }

    /// What it answered with: those of [`OUTPUTS`] that the run holds.
    pub fn outputs(&self) -> impl Iterator<Item = Quantity> {
        OUTPUTS.into_iter().filter(|quantity| self.series(*quantity).is_some())
    }

    /// The column that a quantity was read from; none for a derived magnetization or a run that was made.
    pub fn column(&self, quantity: Quantity) -> Option<&Column> {
        self.columns.as_ref()?.of(quantity)
    }
}
