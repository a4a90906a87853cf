//! One record of an actuator: all series in SI units and of one length.

use super::repair::ClockRepair;
use crate::columns::{Column, Columns};
use crate::error::MeasuredError;
use crate::magnetization::magnetization_a_per_m;
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

/// What can drive a hysteresis law: what was named so, what drives an actuator, a motion that a force answers to, a temperature.
pub const LAW_INPUTS: [Quantity; 7] = [
    Quantity::Input,
    Quantity::FieldCommand,
    Quantity::Field,
    Quantity::Current,
    Quantity::Voltage,
    Quantity::Displacement,
    Quantity::Temperature,
];

/// What a hysteresis law can give. Strain late: over a field it is no hysteresis of one input but the square of one.
pub const LAW_OUTPUTS: [Quantity; 6] = [
    Quantity::Output,
    Quantity::Displacement,
    Quantity::Magnetization,
    Quantity::FluxDensity,
    Quantity::Strain,
    Quantity::Force,
];

/// By [`Quantity::index`].
pub(crate) type Series = [Option<Vec<f64>>; Quantity::ALL.len()];

/// One record of an actuator. Every present series has [`MeasuredRun::len`] samples.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRun {
    /// Where the data come from: the path as given.
    pub source: String,
    /// XXH3 of the file's bytes, 16 hexadecimal digits; empty for a run that was never in a file.
    pub data_hash: String,
    /// What tells it from other loops of its file; 0 where nothing does.
    pub loop_id: String,
    /// Row of each sample in the file, from 0 after the header; a sample that was filled in has the row before it.
    pub rows: Vec<u64>,
    /// Line of each sample in the file; a Parquet file has none.
    pub lines: Option<Vec<u64>>,
    pub dropped_rows: usize,
    /// Strictly increasing; as measured, unless it was repaired.
    pub time_s: Option<Vec<f64>>,
    /// The uniform interval between samples; none for a sweep.
    pub tick_s: Option<f64>,
    /// What had to be done to make the time uniform.
    pub repair: Option<ClockRepair>,
    /// What a record for laws was taken for, in sentences: sorted rows, an odd unit.
    pub doubts: Vec<String>,
    pub(super) series: Series,
    /// The magnetization was made from flux density and field.
    pub(super) derived: bool,
    pub(super) columns: Option<Columns>,
}

impl MeasuredRun {
    /// A run that was made, not measured: uniform in time from 0 s if it has a tick.
    ///
    /// # Errors
    /// Series of different lengths.
    pub fn in_memory(
        source: &str,
        tick_s: Option<f64>,
        series: Vec<(Quantity, Vec<f64>)>,
    ) -> Result<Self, MeasuredError> {
        let samples = series.first().map_or(0, |(_, values)| values.len());
        let mut run = MeasuredRun {
            source: source.to_owned(),
            data_hash: String::new(),
            loop_id: "0".to_owned(),
            rows: (0..samples as u64).collect(),
            lines: None,
            dropped_rows: 0,
            time_s: tick_s.map(|tick_s| (0..samples).map(|sample| sample as f64 * tick_s).collect()),
            tick_s,
            repair: None,
            doubts: Vec::new(),
            series: Default::default(),
            derived: false,
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
        run.derived = derive_magnetization(&mut run.series);
        Ok(run)
    }

    /// The same with what drives it, a voltage or a current, as the command.
    pub fn driven_by(mut self, input: Quantity) -> Self {
        if let Some(series) = self.series[input.index()].take() {
            self.series[Quantity::FieldCommand.index()] = Some(series);
        }
        self
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

    /// A magnetization that was made from flux density and field.
    pub(crate) fn is_derived(&self, quantity: Quantity) -> bool {
        self.derived && quantity == Quantity::Magnetization
    }

    /// As if the quantity's column, or the time's, had another scale.
    pub(crate) fn multiply(&mut self, quantity: Quantity, factor: f64) {
        if quantity == Quantity::Time {
            self.tick_s = self.tick_s.map(|tick_s| factor * tick_s);
        }
        let values = match quantity {
            Quantity::Time => &mut self.time_s,
            _ => &mut self.series[quantity.index()],
        };
        values.iter_mut().flatten().for_each(|value| *value *= factor);
        self.derive_again();
    }

    /// As if two quantities had been read from each other's columns, each in its own unit; `scales`: that of the one over that of the other.
    pub(crate) fn exchange(&mut self, one: Quantity, other: Quantity, scales: f64) {
        self.series.swap(one.index(), other.index());
        for (quantity, factor) in [(one, scales), (other, 1.0 / scales)] {
            let values = &mut self.series[quantity.index()];
            values.iter_mut().flatten().for_each(|value| *value *= factor);
        }
        self.derive_again();
    }

    fn derive_again(&mut self) {
        if self.derived {
            self.series[Quantity::Magnetization.index()] = None;
            derive_magnetization(&mut self.series);
        }
    }

    /// The column that a quantity was read from; none for a derived magnetization or a run that was made.
    pub fn column(&self, quantity: Quantity) -> Option<&Column> {
        self.columns.as_ref()?.of(quantity)
    }
}

/// M = B/μ0 − H, where flux density and field are there and no magnetization; whether it was so.
pub(super) fn derive_magnetization(series: &mut Series) -> bool {
    let of = |quantity: Quantity| series[quantity.index()].as_deref();
    let made = match (
        of(Quantity::Magnetization),
        of(Quantity::FluxDensity),
        of(Quantity::Field),
    ) {
        (None, Some(flux_density_t), Some(field)) => flux_density_t.iter().zip(field),
        _ => return false,
    };
    let made = made.map(|(flux_density_t, field)| magnetization_a_per_m(*flux_density_t, *field));
    series[Quantity::Magnetization.index()] = Some(made.collect());
    true
}
