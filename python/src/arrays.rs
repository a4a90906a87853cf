//! Arrays in and out.

use numpy::{AllowTypeChange, PyArray1, PyArrayLike1};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::borrow::Cow;
use std::ops::Deref;

use crate::refusal::refused;

/// Real numbers in a row, as Python gives them: an array is read in place, a list is made one.
pub struct Given<'py>(PyArrayLike1<'py, f64, AllowTypeChange>);

impl<'py> Deref for Given<'py> {
    type Target = PyArrayLike1<'py, f64, AllowTypeChange>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Given<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let told = |name: &str| given.getattr(name).map(|own| own.to_string()).ok();
        let kind = given.getattr("dtype").and_then(|own| own.getattr("kind")).ok();
        let kind = kind.and_then(|own| own.extract::<char>().ok());
        // NumPy would leave out imaginary parts, and take instants for counts.
        let real = kind.is_none_or(|kind| "fiubO".contains(kind));
        let read = real.then(|| given.extract().map(Self).ok()).flatten();
        read.ok_or_else(|| {
            let given = match (told("dtype"), told("shape")) {
                (Some(kind), Some(shape)) => format!("{kind} of shape {shape}"),
                _ => given.get_type().to_string(),
            };
            PyTypeError::new_err(format!("real numbers in a row, shape (n,), are wanted, not {given}"))
        })
    }
}

/// Refuses what is not finite: a law remembers whatever it was given.
///
/// # Errors
/// A sentence with the place.
pub fn finite(name: &str, values: &[f64]) -> PyResult<()> {
    match values.iter().position(|own| !own.is_finite()) {
        None => Ok(()),
        Some(place) if values.len() == 1 => Err(refused(format!("{name}, {}, must be finite", values[place]))),
        Some(place) => Err(refused(format!(
            "{name}[{place}] is {}: it must be finite",
            values[place]
        ))),
    }
}

/// Refuses what is negative, or not finite.
///
/// # Errors
/// A sentence with the value.
pub fn not_negative(name: &str, value: f64) -> PyResult<()> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(refused(format!("{name}, {value}, must be finite and not negative")))
}
/// An array that Python gets.
pub type Array<'py> = Bound<'py, PyArray1<f64>>;

/// The numbers in a row: in place if they are, else a copy.
pub fn row<'a>(given: &'a Given<'_>) -> Cow<'a, [f64]> {
    match given.as_slice() {
        Ok(slice) => Cow::Borrowed(slice),
        Err(_) => Cow::Owned(given.as_array().to_vec()),
    }
}

/// An array that owns what was a vector; nothing is copied.
pub fn array(py: Python<'_>, values: Vec<f64>) -> Array<'_> {
    PyArray1::from_vec(py, values)
}

/// Refuses arrays of different lengths.
///
/// # Errors
/// A sentence with both.
pub fn same_length(one: (&str, usize), other: (&str, usize)) -> PyResult<()> {
    if one.1 == other.1 {
        return Ok(());
    }
    Err(refused(format!(
        "{} has {} samples and {} has {}: they must be as many",
        one.0, one.1, other.0, other.1
    )))
}
