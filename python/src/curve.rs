//! Anhysteretic curves over arrays.

use crate::arrays::{Array, Given, array, row};
use crate::refusal::refused;
use anhyst_model::Anhysteretic as Curve;
use pyo3::prelude::*;

/// Man/Ms over x = He/a, both without unit: `"langevin"` is coth x − 1/x, `"ising"` tanh x.
#[pyclass(frozen, from_py_object, eq, module = "anhyst")]
#[derive(Clone, PartialEq)]
pub struct Anhysteretic(pub Curve);

#[pymethods]
impl Anhysteretic {
    #[new]
    #[pyo3(signature = (curve = "langevin"))]
    fn new(curve: &str) -> PyResult<Self> {
        match curve {
            "langevin" => Ok(Self(Curve::Langevin)),
            "ising" => Ok(Self(Curve::Ising)),
            other => Err(refused(format!(
                "there is no curve {other:?}; there are langevin, ising"
            ))),
        }
    }

    /// The curve at each x, in [−1, 1].
    fn value<'py>(&self, py: Python<'py>, x: Given<'py>) -> Array<'py> {
        self.each(py, &x, |curve, x| curve.value(x))
    }

    /// d value/dx at each x.
    fn slope<'py>(&self, py: Python<'py>, x: Given<'py>) -> Array<'py> {
        self.each(py, &x, |curve, x| curve.derivative(x))
    }

    /// The x at which the curve has each value; ±inf from ±1 on.
    fn inverse<'py>(&self, py: Python<'py>, value: Given<'py>) -> Array<'py> {
        self.each(py, &value, |curve, value| curve.inverse(value))
    }

    fn __repr__(&self) -> String {
        format!("Anhysteretic({:?})", format!("{:?}", self.0).to_lowercase())
    }
}

impl Anhysteretic {
    fn each<'py>(&self, py: Python<'py>, given: &Given<'py>, of: impl Fn(Curve, f64) -> f64) -> Array<'py> {
        array(py, row(given).iter().map(|own| of(self.0, *own)).collect())
    }
}
