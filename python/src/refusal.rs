//! Errors of this project as exceptions of Python, with the sentence of the command line.

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::fmt::Display;

create_exception!(
    anhyst,
    BadInput,
    PyValueError,
    "Input that cannot be used: a sentence with value, limit and place."
);
create_exception!(
    anhyst,
    ProcessFailed,
    PyRuntimeError,
    "A process of a run failed, or there is no room: a sentence that says who, and where the logs are."
);

/// Bad input, in its own words.
pub fn refused(error: impl Display) -> PyErr {
    BadInput::new_err(error.to_string())
}
