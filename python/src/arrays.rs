//! Arrays in and out.

use numpy::{AllowTypeChange, PyArray1, PyArrayLike1};
use pyo3::prelude::*;
use std::borrow::Cow;

use crate::refusal::refused;

/// Numbers as Python gives them: an array is read in place, a list is made one.
pub type Given<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;
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
