//! The estimation laws over arrays.

use crate::arrays::{Given, row, same_length};
use crate::scenario::Scenario;
use crate::tokens::{Columns, one};
use anhyst_ipc::{Block, Estimate, Measurement, Message, Now, Previous, SafeField};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The estimator of a scenario, tick by tick; which law it follows is the scenario's `estimator.law`.
#[pyclass(module = "anhyst")]
pub struct Estimator {
    block: anhyst_estimator::Estimator,
    tick: u64,
    /// What was commanded a tick ago.
    safe: SafeField,
    estimate: Estimate,
}

impl Estimator {
    fn next(&mut self, command: f64, displacement_m: f64, coil_field_a_per_m: f64) {
        let mut measured = Measurement {
            displacement_m,
            coil_field_a_per_m,
            ..Measurement::default()
        };
        measured.stamp(self.tick, 0);
        let heard = (Now(measured), Previous(self.safe));
        (self.estimate,) = Block::step(&mut self.block, self.tick, heard);
        self.estimate.stamp(self.tick, 0);
        self.safe = SafeField {
            field_a_per_m: command,
            ..SafeField::default()
        };
        self.safe.stamp(self.tick, 0);
        self.tick += 1;
    }
}

#[pymethods]
impl Estimator {
    #[new]
    fn new(scenario: &Scenario) -> PyResult<Self> {
        Ok(Self {
            block: scenario.block(anhyst_scenario::Scenario::estimator_block)?,
            tick: 0,
            safe: SafeField::default(),
            estimate: Estimate::default(),
        })
    }

    /// A tick: what was measured in it (displacement in m, coil's field in A/m), and what the amplifier was told in it (A/m), which is
    /// heard a tick later. The estimate by field.
    #[pyo3(signature = (command_a_per_m, displacement_m, coil_field_a_per_m = 0.0))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        command_a_per_m: f64,
        displacement_m: f64,
        coil_field_a_per_m: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.next(command_a_per_m, displacement_m, coil_field_a_per_m);
        one(py, &self.estimate)
    }

    /// The same over arrays of shape (n,): the estimate by field, an array of shape (n,) each.
    #[pyo3(signature = (command_a_per_m, displacement_m, coil_field_a_per_m = None))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        command_a_per_m: Given<'py>,
        displacement_m: Given<'py>,
        coil_field_a_per_m: Option<Given<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (commands, displacements) = (row(&command_a_per_m), row(&displacement_m));
        let fields = coil_field_a_per_m.as_ref().map(row);
        same_length(("command", commands.len()), ("displacement", displacements.len()))?;
        if let Some(fields) = &fields {
            same_length(("command", commands.len()), ("coil field", fields.len()))?;
        }
        let mut columns = Columns::of::<Estimate>(commands.len());
        let (commands, displacements, fields): (&[f64], &[f64], Option<&[f64]>) =
            (&commands, &displacements, fields.as_deref());
        py.detach(|| {
            for (sample, (command, displacement)) in commands.iter().zip(displacements).enumerate() {
                self.next(*command, *displacement, fields.map_or(0.0, |fields| fields[sample]));
                columns.push(&self.estimate);
            }
        });
        columns.told(py)
    }

    /// The tick that comes next.
    #[getter]
    fn tick(&self) -> u64 {
        self.tick
    }

    /// An estimator that goes on as this one would.
    fn copy(&self) -> Self {
        Self {
            block: self.block.clone(),
            ..*self
        }
    }
}
