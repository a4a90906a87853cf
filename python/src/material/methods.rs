//! What a material can be asked.

use super::Material;
use crate::arrays::{Array, Given, array, row};
use crate::law::Law;
use crate::refusal::refused;
use anhyst_scenario::{load_model, to_ron};
use pyo3::prelude::*;
use std::path::PathBuf;

#[pymethods]
impl Material {
    /// The paper's Terfenol-D.
    #[staticmethod]
    fn terfenol_d() -> Self {
        Self(anhyst_model::Material::terfenol_d())
    }

    /// From a file: a material, an actuator's model, a hysteresis alone, or a law as `anhyst fit --law` writes it.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        load_model(&path).map(|model| Self(model.material)).map_err(refused)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Where its numbers come from.
    #[getter]
    fn source(&self) -> &str {
        &self.0.source
    }

    /// As a RON text, which a scenario takes.
    #[getter]
    fn ron(&self) -> PyResult<String> {
        to_ron(&self.0).map_err(refused)
    }

    /// As a JSON text.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(refused)
    }

    /// From the JSON text of [`Material.to_json`], changed or not.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        let material: anhyst_model::Material = serde_json::from_str(text).map_err(refused)?;
        material.validate().map_err(refused)?;
        Ok(Self(material))
    }

    /// Units of what drives it and of what it gives.
    #[getter]
    fn units(&self) -> (String, String) {
        let [input, output] = self.0.units();
        (input.to_owned(), output.to_owned())
    }

    /// Its hysteresis from rest: field (A/m) to magnetization (A/m), or whatever the law of its own is of.
    #[getter]
    pub fn law(&self) -> PyResult<Law> {
        match &self.0.law {
            Some(own) => Law::of(own.model.clone()),
            None => Law::domain_wall(self, 1.0),
        }
    }

    /// The same material with another shape `a`, A/m.
    fn with_shape(&self, shape_a_per_m: f64) -> PyResult<Self> {
        let mut material = self.0.clone();
        material.hysteresis = material.hysteresis.with_shape(shape_a_per_m);
        material.hysteresis.validate().map_err(refused)?;
        Ok(Self(material))
    }

    /// Free strain (no unit) at each magnetization (A/m).
    fn strain<'py>(&self, py: Python<'py>, magnetization_a_per_m: Given<'py>) -> Array<'py> {
        self.each(py, &magnetization_a_per_m, |own, saturation, m| {
            own.magnetostriction.strain(m, saturation)
        })
    }

    /// The magnetization (A/m) on the rising branch that gives each strain; nan where none does.
    fn magnetization_for<'py>(&self, py: Python<'py>, strain: Given<'py>) -> Array<'py> {
        self.each(py, &strain, |own, saturation, strain| {
            own.magnetostriction.inverse(strain, saturation).unwrap_or(f64::NAN)
        })
    }

    /// d strain/d magnetization at 0, m/A.
    #[getter]
    fn strain_per_magnetization(&self) -> f64 {
        self.0.strain_per_magnetization()
    }

    fn __repr__(&self) -> String {
        format!("Material({:?})", self.0.name)
    }
}

impl Material {
    fn each<'py>(
        &self,
        py: Python<'py>,
        given: &Given<'py>,
        of: impl Fn(&anhyst_model::Material, f64, f64) -> f64,
    ) -> Array<'py> {
        let saturation = self.0.hysteresis.saturation_magnetization_a_per_m;
        array(py, row(given).iter().map(|own| of(&self.0, saturation, *own)).collect())
    }
}
