//! The whole chain of an actuator over arrays.

use crate::arrays::{Given, array, finite, row, same_length};
use crate::refusal::refused;
use anhyst_model::{ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs};
use anhyst_scenario::{load_model, to_ron};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// From the command to what moves: amplifier, hysteresis, strain, rod and every effect of a model, samples `tick_s` apart.
#[pyclass(module = "anhyst")]
pub struct Actuator {
    model: ActuatorModel,
    tick_s: f64,
    chain: anhyst_model::Actuator,
}

#[pymethods]
impl Actuator {
    /// From a file of a model (of a material alone: without a rod, the output is then the strain).
    #[new]
    fn new(path: PathBuf, tick_s: f64) -> PyResult<Self> {
        Self::of(load_model(&path).map_err(refused)?, tick_s)
    }

    /// The paper's actuator.
    #[staticmethod]
    fn terfenol_d(tick_s: f64) -> PyResult<Self> {
        Self::of(ActuatorModel::terfenol_d(), tick_s)
    }

    /// From the demagnetised state, or on from where it is: `field_a_per_m`, `magnetization_a_per_m`, `strain`, `displacement_m`,
    /// `temperature_k`, of shape (n,) each, for commands of shape (n,) in the unit of the model's input.
    #[pyo3(signature = (command, force_n = None))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        command: Given<'py>,
        force_n: Option<Given<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let commands = row(&command);
        let forces = force_n.as_ref().map(row);
        finite("command", &commands)?;
        if let Some(forces) = &forces {
            finite("force_n", forces)?;
            same_length(("command", commands.len()), ("force", forces.len()))?;
        }
        let inputs = ActuatorInputs {
            force_n: forces.as_deref(),
            ..ActuatorInputs::commands(&commands)
        };
        let mut outputs = ActuatorOutputs::default();
        let chain = &mut self.chain;
        py.detach(|| chain.run(inputs, &mut outputs)).map_err(refused)?;
        let told = PyDict::new(py);
        told.set_item("field_a_per_m", array(py, outputs.field_a_per_m))?;
        told.set_item("magnetization_a_per_m", array(py, outputs.magnetization_a_per_m))?;
        told.set_item("strain", array(py, outputs.strain))?;
        told.set_item("displacement_m", array(py, outputs.displacement_m))?;
        told.set_item("temperature_k", array(py, outputs.temperature_k))?;
        Ok(told)
    }

    /// A sample on: the displacement (m), or of a model without a rod the strain.
    fn step(&mut self, command: f64) -> PyResult<f64> {
        finite("command", &[command])?;
        let output = self.chain.step(ActuatorInput::command(command));
        Ok(if self.model.rod.is_some() {
            output.displacement_m
        } else {
            output.strain
        })
    }

    /// Back to the demagnetised state.
    fn reset(&mut self) -> PyResult<()> {
        self.chain = anhyst_model::Actuator::new(&self.model, self.tick_s).map_err(refused)?;
        Ok(())
    }

    /// The model as a RON text.
    #[getter]
    fn ron(&self) -> PyResult<String> {
        to_ron(&self.model).map_err(refused)
    }

    /// The time between two samples, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// Where it is magnetically: field and magnetization, A/m.
    #[getter]
    fn magnetic_state(&self) -> (f64, f64) {
        let state = self.chain.magnetic_state();
        (state.field_a_per_m, state.magnetization_a_per_m)
    }

    fn __repr__(&self) -> String {
        format!("Actuator({:?})", self.model.name)
    }
}

impl Actuator {
    fn of(model: ActuatorModel, tick_s: f64) -> PyResult<Self> {
        let chain = anhyst_model::Actuator::new(&model, tick_s).map_err(refused)?;
        Ok(Self { model, tick_s, chain })
    }
}
