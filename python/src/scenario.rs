//! A scenario that was read and checked.

use crate::refusal::refused;
use anhyst_ipc::Invalid;
use anhyst_scenario::{Placement, Setting, load_changed};
use pyo3::prelude::*;
use std::path::PathBuf;

/// A run before it is run: read, changed, checked.
#[pyclass(frozen, from_py_object, subclass, module = "anhyst")]
#[derive(Clone)]
pub struct Scenario {
    pub scenario: anhyst_scenario::Scenario,
    path: PathBuf,
    settings: Vec<String>,
}

#[pymethods]
impl Scenario {
    /// Reads a file (or `built-in/milling.ron`), changes it by `path=value`, and checks it.
    #[new]
    #[pyo3(signature = (path, settings = Vec::new()))]
    fn new(path: PathBuf, settings: Vec<String>) -> PyResult<Self> {
        let parsed: Vec<Setting> = settings
            .iter()
            .map(|setting| setting.parse().map_err(|sentence: String| refused(sentence)))
            .collect::<PyResult<_>>()?;
        let scenario = load_changed(&path, &parsed, |_| ()).map_err(refused)?;
        Ok(Self {
            scenario,
            path,
            settings,
        })
    }

    /// The file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// What was changed in it.
    #[getter]
    fn settings(&self) -> Vec<String> {
        self.settings.clone()
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.scenario.name
    }

    /// Length of a tick, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.scenario.tick_s
    }

    /// How long it runs, s.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.scenario.duration_s
    }

    /// How many ticks that is.
    #[getter]
    fn ticks(&self) -> u64 {
        self.scenario.ticks()
    }

    /// Where noise comes from.
    #[getter]
    fn seed(&self) -> u64 {
        self.scenario.seed
    }

    /// Whether all nodes run in this process.
    #[getter]
    fn embedded(&self) -> bool {
        self.scenario.placement == Placement::Embedded
    }

    /// Units of what drives the actuator and of what it gives.
    #[getter]
    fn units(&self) -> (String, String) {
        let units = self.scenario.units();
        (units.input, units.output)
    }

    /// Unit of a message's number in a run of this scenario; `unit` is what it has in one of a magnetostrictive rod.
    fn unit_of(&self, field: &str, unit: &str) -> String {
        self.scenario.units().of_message(field, unit)
    }

    /// The material that the plant and the controller's side start from.
    #[getter]
    fn material(&self) -> PyResult<crate::material::Material> {
        let material = self.scenario.material().map_err(refused)?;
        Ok(crate::material::Material(material.clone()))
    }

    /// The whole, with every default, as a RON text.
    #[getter]
    fn ron(&self) -> PyResult<String> {
        self.scenario.to_ron().map_err(refused)
    }

    /// What can be told before the run, as sentences.
    fn warnings(&self) -> Vec<String> {
        self.scenario.warnings()
    }

    fn __repr__(&self) -> String {
        format!("Scenario({:?})", self.scenario.name)
    }
}

impl Scenario {
    /// Builds something of it.
    pub fn block<T>(&self, build: impl FnOnce(&anhyst_scenario::Scenario) -> Result<T, Invalid>) -> PyResult<T> {
        build(&self.scenario).map_err(refused)
    }
}
