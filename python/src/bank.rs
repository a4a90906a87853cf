//! A bank of materials over the shape `a`.

use crate::arrays::{Array, Given, array, finite, row};
use crate::material::Material;
use crate::refusal::refused;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// Copies of a material that differ in the shape `a` (A/m), driven by one field; they begin demagnetised.
#[pyclass(module = "anhyst")]
pub struct Bank(anhyst_model::Bank);

#[pymethods]
impl Bank {
    #[new]
    fn new(material: &Material, shapes_a_per_m: Given<'_>) -> PyResult<Self> {
        anhyst_model::Bank::new(material.0.hysteresis, &row(&shapes_a_per_m))
            .map(Self)
            .map_err(refused)
    }

    /// Moves the field (A/m, shape (n,)) from sample to sample; magnetizations (A/m), shape (n, members).
    fn run<'py>(&mut self, py: Python<'py>, field_a_per_m: Given<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (fields, bank) = (row(&field_a_per_m), &mut self.0);
        let members = bank.shapes().len();
        let fields: &[f64] = &fields;
        finite("field_a_per_m", fields)?;
        let all = py.detach(|| {
            let mut all = Vec::with_capacity(members * fields.len());
            for field in fields {
                bank.advance(*field);
                all.extend_from_slice(bank.magnetizations());
            }
            all
        });
        PyArray1::from_vec(py, all).reshape([fields.len(), members])
    }

    /// The shapes of the members, A/m.
    #[getter]
    fn shapes_a_per_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.shapes().to_vec())
    }

    /// Where they are, A/m, shape (members,).
    #[getter]
    fn magnetizations_a_per_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.magnetizations().to_vec())
    }

    /// The field, A/m.
    #[getter]
    fn field_a_per_m(&self) -> f64 {
        self.0.field_a_per_m()
    }

    /// Another bank that goes on as this one would.
    fn copy(&self) -> Self {
        Self(self.0.clone())
    }

    fn __len__(&self) -> usize {
        self.0.shapes().len()
    }
}
