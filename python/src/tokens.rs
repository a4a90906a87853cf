//! Tokens as columns.

use crate::arrays::array;
use crate::refusal::refused;
use anhyst_ipc::{
    Channel, CoilField, Demand, Estimate, FieldCommand, MAX_FIELDS, Measurement, Message, SafeField, Truth,
};
use anhyst_recorder::Recording;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// The tokens of one channel, a column a field. Counts and flags are whole numbers in float64.
pub struct Columns {
    fields: Vec<&'static str>,
    columns: Vec<Vec<f64>>,
}

impl Columns {
    pub fn of<M: Message>(tokens: usize) -> Self {
        Self {
            fields: M::FIELDS.iter().map(|field| field.name).collect(),
            columns: M::FIELDS.iter().map(|_| Vec::with_capacity(tokens)).collect(),
        }
    }

    pub fn push<M: Message>(&mut self, token: &M) {
        let mut values = [0.0; MAX_FIELDS];
        token.write_values(&mut values);
        for (column, value) in self.columns.iter_mut().zip(values) {
            column.push(value);
        }
    }

    pub fn told(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let told = PyDict::new(py);
        for (field, column) in self.fields.into_iter().zip(self.columns) {
            told.set_item(field, array(py, column))?;
        }
        Ok(told)
    }
}

/// One token by the names of its fields.
pub fn one<'py, M: Message>(py: Python<'py>, token: &M) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    let mut values = [0.0; MAX_FIELDS];
    token.write_values(&mut values);
    for (field, value) in M::FIELDS.iter().zip(values) {
        told.set_item(field.name, value)?;
    }
    Ok(told)
}

/// Every field of every channel: channel, name, unit, what it says.
#[pyfunction]
pub fn fields() -> Vec<(&'static str, &'static str, &'static str, &'static str)> {
    let of = |channel: Channel| {
        let each = channel.fields().iter();
        each.map(move |field| (channel.name(), field.name, field.unit, field.doc.trim()))
    };
    Channel::ALL.into_iter().flat_map(of).collect()
}

/// All tokens of recordings that follow each other: the length of a tick (s), and by channel the ticks and the fields as arrays.
#[pyfunction]
pub fn read_tokens(py: Python<'_>, recordings: Vec<PathBuf>) -> PyResult<(f64, Bound<'_, PyDict>)> {
    let opened = py.detach(|| {
        recordings
            .iter()
            .map(|path| Recording::open(path))
            .collect::<Result<Vec<_>, _>>()
    });
    let opened = opened.map_err(refused)?;
    let tick_s = opened.first().map_or(f64::NAN, Recording::tick_s);
    let told = PyDict::new(py);
    channel::<Measurement>(py, &opened, &told)?;
    channel::<Truth>(py, &opened, &told)?;
    channel::<Estimate>(py, &opened, &told)?;
    channel::<Demand>(py, &opened, &told)?;
    channel::<FieldCommand>(py, &opened, &told)?;
    channel::<SafeField>(py, &opened, &told)?;
    channel::<CoilField>(py, &opened, &told)?;
    Ok((tick_s, told))
}

fn channel<'py, M: Message + Send>(py: Python<'py>, opened: &[Recording], told: &Bound<'py, PyDict>) -> PyResult<()> {
    let read = py.detach(|| opened.iter().map(Recording::tokens::<M>).collect::<Result<Vec<_>, _>>());
    let tokens: Vec<M> = read.map_err(refused)?.concat();
    let mut columns = Columns::of::<M>(tokens.len());
    tokens.iter().for_each(|token| columns.push(token));
    let columns = columns.told(py)?;
    columns.set_item(
        "tick",
        numpy::PyArray1::from_vec(py, tokens.iter().map(Message::tick).collect()),
    )?;
    told.set_item(M::CHANNEL.name(), columns)
}
