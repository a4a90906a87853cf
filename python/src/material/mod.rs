//! A material: its hysteresis and its strain.

mod methods;

use pyo3::prelude::*;

/// What describes a magnetostrictive material at one temperature and stress, or what stands in its place.
#[pyclass(frozen, from_py_object, eq, module = "anhyst")]
#[derive(Clone, PartialEq)]
pub struct Material(pub anhyst_model::Material);
